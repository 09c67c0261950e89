"""The README of rosoclingo_rviz."""

from __future__ import annotations

import pytest
from page import OFFICE, Page, of


@pytest.mark.costly
@of("rosoclingo_rviz/README.md", "rosoclingo_rviz")
def test_rviz(page: Page, screen: str) -> None:
    """The office is drawn, and rviz answers."""
    page.terminals.environment["DISPLAY"] = screen
    picture = str(page.folder / "rviz.png")

    def is_drawn() -> bool:
        # Within rviz's window, which fills the screen, the part that OpenGL draws.
        page.terminals.run("import", "-window", "root", "-crop", "1100x780+370+70", picture)
        return int(page.terminals.run("identify", "-format", "%k", picture).output) > 100

    office = page.type_with_rviz("rviz:=true", lambda: hears_markers(page) and is_drawn())
    assert "xmlrpc reply" in page.terminals.run("rosnode", "ping", "-c", "1", "/rviz").output
    assert "process has died" not in office.output, office.output


@pytest.mark.costly
@of("rosoclingo_rviz/README.md", "rviz.launch")
def test_a_graph_in_rviz(page: Page, screen: str) -> None:
    page.terminals.environment["DISPLAY"] = screen
    page.has(graph_lp=OFFICE)
    page.type_with_rviz("rviz.launch", lambda: hears_markers(page))


def hears_markers(page: Page) -> bool:
    return "/rviz" in page.terminals.receivers("/graph_markers", "/graph_markers/markers")


@of("rosoclingo_rviz/README.md", "graph_markers.py")
def test_graph_markers(page: Page) -> None:
    page.has(graph_lp=OFFICE)
    page.type("graph_markers.py")
    page.hears("/graph_markers/markers")
