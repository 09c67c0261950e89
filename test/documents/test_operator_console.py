"""The README of rosoclingo_console."""

from __future__ import annotations

import pytest
from page import BAGS, Page, of


def takes_any_port(page: Page) -> None:
    """Another console may run on this machine."""
    page.terminals.run("rosparam", "set", "/console/port", "0")


@pytest.mark.costly
@of("rosoclingo_console/README.md", "rosoclingo_console")
def test_a_console(page: Page) -> None:
    takes_any_port(page)
    page.type("mailbot_dynamic.launch")
    page.hears("/rosoclingo/about")
    page.type("console.py").wait_for("open http://localhost:")


@of("rosoclingo_console/README.md", "A bag")
def test_a_bag(page: Page) -> None:
    page.has(run_bag=BAGS / "mailbot_dynamic_reset.bag")
    shell = page.command("run.bag")
    # Another console may run on this machine.
    console = page.terminals.start(*shell[:-1], f"{shell[-1]} --port 0")
    console.wait_for("open http://localhost:")


@of("rosoclingo_console/README.md", "Parameters")
def test_a_console_of_two_systems(page: Page) -> None:
    takes_any_port(page)
    console = page.type("_systems:=")
    console.wait_for("open http://localhost:")
    assert "serving /robot1/rosoclingo, /robot2/rosoclingo" in console.output
