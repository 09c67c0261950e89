"""The README of rosoclingo_examples."""

from __future__ import annotations

import pytest
from page import Page, of
from readmes import check_output


@pytest.mark.costly
@of("rosoclingo_examples/README.md", "rosoclingo_examples")
def test_examples(page: Page) -> None:
    page.type("mailbot_dynamic.launch")
    said = page.run("mailbot_manual.py", lines="1 3\n")
    check_output("rosoclingo_examples/README.md", "rosoclingo_examples", said)


@pytest.mark.costly
@of("rosoclingo_examples/README.md", "mailbot_manual.py and mailbot.py")
def test_clients(page: Page) -> None:
    page.terminals.start("roslaunch", "rosoclingo_examples", "mailbot_dynamic.launch")
    assert "2 deliveries" in page.run("printf")


@pytest.mark.costly
@of("rosoclingo_examples/README.md", "Launch files")
def test_launch_files(page: Page) -> None:
    assert "seed" in page.run("--ros-args").partition("Optional Arguments:")[2]
    client = page.type("echo 1 3")
    client.wait_for("waiting for the server")
    fixed = "mode:=dynamic.fixed.recording"
    page.terminals.start("roslaunch", "rosoclingo_examples", "mailbot_dynamic.launch", fixed)
    assert client.wait() == 0, client.output
    assert client.output.splitlines()[-1] == "1 delivery"


@of("rosoclingo_examples/README.md", "The manual's commands")
def test_the_manuals_commands(page: Page) -> None:
    page.type("roscore")
    for word in ("run.py", "run.py", "run.py", "fulfill.py"):
        page.type(word)
    assert "1 delivery" in page.run("mailbot_manual.py", lines="1 3\n")
    page.interrupt()
    page.terminals.start_master()
    for _ in range(3):
        page.type("run.py")
    page.type("rostopic echo").wait_for("do(mailbot,deliver(1),6)")
