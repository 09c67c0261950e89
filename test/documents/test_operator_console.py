"""The README of rosoclingo_console."""

from __future__ import annotations

from page import Page, of


def takes_any_port(page: Page) -> None:
    """Another console may run on this machine."""
    page.terminals.run("rosparam", "set", "/console/port", "0")


@of("rosoclingo_console/README.md", "rosoclingo_console")
def test_a_console(page: Page) -> None:
    takes_any_port(page)
    page.type("mailbot_dynamic.launch")
    page.hears("/rosoclingo/about")
    page.type("console.py").wait_for("open http://localhost:")


@of("rosoclingo_console/README.md", "Parameters")
def test_a_console_of_two_systems(page: Page) -> None:
    takes_any_port(page)
    console = page.type("_systems:=")
    console.wait_for("open http://localhost:")
    assert "serving /robot1/rosoclingo, /robot2/rosoclingo" in console.output
