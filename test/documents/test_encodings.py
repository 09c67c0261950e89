"""Encodings: the mailbot's, the library's, and examples."""

from __future__ import annotations

from pathlib import Path

import pytest
from page import ASP, Page, of
from readmes import ROOT, check_output, section
from typist import pipe
from waiting import wait_for

from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.wire.commands import Ground, Part
from rosoclingo.tools.plan import command as plan


@of("docs/grounding_on_demand.md", "Asking")
def test_asking(tmp_path: Path) -> None:
    """The parts find what can be reached, each place once and by the shortest way."""
    (program,) = [piece.text for piece in section("docs/grounding_on_demand.md", "Asking")]
    file = tmp_path / "reach.lp"
    file.write_text(
        f"way(1,(2;3)). way(2,3). way(3,(1;4)). #program from(k). reach(k,k,0). {program}"
        "#show reach/3."
    )
    engine = Engine(Options(files=(str(file),)))
    engine.apply(Ground((Part("base"),)))
    engine.apply(Ground((Part("from", ("1",)),)))
    engine.apply(Ground((Part("spread", ("1", "1")),), asking=True))
    expected = ["reach(1,1,0)", "reach(1,2,1)", "reach(1,3,1)", "reach(1,4,2)"]
    assert sorted(engine.solve().symbols) == expected


@of("docs/grounding_on_demand.md", "Shortest ways")
def test_shortest_ways(tmp_path: Path) -> None:
    """The way that is closed in graph 2 is open in graph 1."""
    (program,) = [piece.text for piece in section("docs/grounding_on_demand.md", "Shortest ways")]
    file = tmp_path / "ways.lp"
    file.write_text(
        f"way(1,2,5). way(1,3,2). way(3,2,2). closed(3,2,2). {program}#show distance/4."
    )
    engine = Engine(Options(files=(str(file),)))
    for part in ("base",), ("closing", "1"), ("closing", "2"):
        engine.apply(Ground((Part(part[0], part[1:]),)))
    for graph in ("1", "2"):
        engine.apply(Ground((Part("asking", (graph, "1", "2")),)))
    assert sorted(engine.solve().symbols) == ["distance(1,2,4,1)", "distance(1,2,5,2)"]


@of("docs/grounding_on_demand.md", "Schedules")
def test_schedules(tmp_path: Path) -> None:
    (program,) = [piece.text for piece in section("docs/grounding_on_demand.md", "Schedules")]
    facts = "precedes(boil,fry). precedes(chop,fry). takes(boil,9). takes(chop,2)."
    file = tmp_path / "schedule.lp"
    file.write_text(f"{facts} item((boil;chop;fry)). {program}#show begins/2.")
    engine = Engine(Options(files=(str(file),)))
    for part in ("base", "timing"):
        engine.apply(Ground((Part(part),)))
    assert sorted(engine.solve().symbols) == ["begins(boil,0)", "begins(chop,0)", "begins(fry,9)"]


def test_examples_of_an_encoding() -> None:
    check_output("docs/check.md", "Examples", (ASP / "mailbot.examples").read_text())


@pytest.mark.costly
@of("rosoclingo_aspprograms/README.md", "rosoclingo_aspprograms")
def test_aspprograms(page: Page) -> None:
    for _ in range(3):
        page.type("run.py")
    heard = page.type("rostopic echo")
    heard.wait_for("do(mailbot,deliver(1),6)")
    assert "do(mailbot,go(1),1)" in heard.output
    check_output("rosoclingo_aspprograms/README.md", "rosoclingo_aspprograms", heard.output)
    page.interrupt()
    page.type("run-1.0.py")
    page.hears("/rosoclingo/about")


@pytest.mark.costly
@of("rosoclingo_aspprograms/README.md", "An encoding of your own")
def test_plants(page: Page) -> None:
    page.type("roscore")
    page.type("run-1.0.py")
    page.hears("/rosoclingo/about")
    heard = page.type("rostopic echo")
    wait_for(lambda: any(name.startswith("/rostopic_") for name in page.terminals.names()))
    page.run("/rosoclingo/goal")
    heard.wait_for("go(")
    page.run("/rosoclingo/in")
    wait_for(lambda: heard.output.count("go(") == 2)
    assert "goal 1, water((3,4)): succeeded" in page.run("plan.py")
    page.block("prolog")  # which test_library.py plans with


@of("rosoclingo_aspprograms/README.md", "Actions in general")
def test_actions_in_general(page: Page, capsys: pytest.CaptureFixture[str]) -> None:
    """The encoding is written beside the library, as it names that."""
    library = Path("rosoclingo_aspprograms/lib/actions.lp")
    (page.folder / "lamp.lp").write_text(
        page.block("prolog").replace(library.name, str(ROOT / library))
    )
    assert plan.run([str(page.folder / "lamp.lp"), "--goal", "light"]) == 0
    assert "arm: press" in capsys.readouterr().out


@of("rosoclingo_aspprograms/README.md", "Seconds")
def test_seconds(page: Page) -> None:
    assert "goal 1, bring(o9,o14), succeeds in step 9" in page.run("plan.py")


@pytest.mark.costly
@of("rosoclingo_aspprograms/README.md", "Requests, actions, messages")
def test_goal_information(page: Page) -> None:
    page.terminals.start("roslaunch", "rosoclingo_examples", "mailbot_office.launch")
    client, typist = pipe(
        page.terminals, page.folder, "rosrun", "rosoclingo_examples", "mailbot.py"
    )
    typist.type("o9 o14 box_of_chocolate\n")
    client.wait_for("[1] bring(o9,o14) box_of_chocolate: accepted")
    assert "box_of_chocolate" in page.run("get_goal_information")
    client.interrupt()
    typist.close()
