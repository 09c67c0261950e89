"""What an encoding must not hide, and what goals hear while they wait for a plan."""

from __future__ import annotations

from pathlib import Path

import pytest
from conftest import PACKAGE, Make

from rosoclingo.errors import PlannerError
from rosoclingo.loop import waiting

LINE = (PACKAGE / "example/line.lp").read_text()
PAPER = (PACKAGE / "example/line_paper.lp").read_text()
MODES = sorted(path.stem for path in (PACKAGE / "modes").glob("dynamic.*.lp"))


def hide(folder: Path, text: str, *signatures: str) -> str:
    """Writes an encoding without some of its #show statements."""
    for signature in signatures:
        assert f"#show {signature}." in text
        text = text.replace(f"#show {signature}.", "")
    file = folder / "hiding.lp"
    file.write_text(text)
    return str(file)


@pytest.mark.parametrize("signature", ["do/3", "status/3"])
@pytest.mark.parametrize("mode", MODES)
def test_an_encoding_that_hides(system: Make, tmp_path: Path, mode: str, signature: str) -> None:
    made = system(mode, "-c", "steps=5", encoding=[hide(tmp_path, LINE, signature)])
    goal = made.begin("visit(3)")
    with pytest.raises(PlannerError, match=rf"hides {signature}, .*add #show {signature}\."):
        raise made.wait()
    assert goal.wait() == "aborted"
    assert "accepted" not in goal.lines
    assert made.world.actions == []


def test_actions_are_missed_when_there_have_to_be_some(system: Make, tmp_path: Path) -> None:
    """The first goal needs no action, so that nothing is amiss there."""
    made = system(
        "dynamic.incremental.recording", "-c", "steps=9", encoding=[hide(tmp_path, LINE, "do/3")]
    ).start()
    assert made.goal("visit(1)").wait() == "succeeded"
    assert made.goal("visit(2)").wait() == "aborted"
    assert "hides do/3" in str(made.wait())


@pytest.mark.parametrize("mode", ["static.fixed.recording", "static.incremental.recording"])
def test_a_static_mode_does_not_publish_an_empty_plan(
    system: Make, tmp_path: Path, mode: str
) -> None:
    text = (PACKAGE.parent / "rosclingo/example/itoh.lp").read_text()
    file = hide(tmp_path, text, "do/3")
    Path(file).write_text(Path(file).read_text() + "#show.")
    instance = str(PACKAGE.parent / "rosclingo/example/instance.lp")
    made = system(mode, "-c", "steps=14", encoding=[instance, file]).start()
    assert "hides do/3" in str(made.wait())
    assert made.world.published == []


def test_a_static_mode_needs_no_statuses(system: Make, tmp_path: Path) -> None:
    file = hide(tmp_path, LINE, "status/3")
    Path(file).write_text(Path(file).read_text() + "#program base. before(want(1,3),0).")
    made = system("static.fixed.recording", "-c", "steps=2", encoding=[file]).start()
    made.world.wait_for(lambda world: bool(world.published))
    assert made.world.published == [("solver", "[do(robot,go(2),1), do(robot,go(3),2)]")]


def test_an_encoding_of_the_paper_that_hides(single: Make, tmp_path: Path) -> None:
    made = single(hide(tmp_path, f"{PAPER}\n#show.", "occurs/3")).start()
    made.goal("visit(3)")
    assert "hides do/3" in str(made.wait())


def test_a_long_search_says_how_far_it_is(system: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(waiting, "_SILENT_SECONDS", -1.0)
    made = system("dynamic.incremental.recording", "-c", "steps=9")
    goal = made.begin("visit(4)")
    assert goal.wait() == "succeeded"
    told = [f"planning, horizon {horizon}" for horizon in range(4)]
    begin = goal.lines.index(told[0])
    assert goal.lines[begin : begin + 5] == [*told, "plan 3 steps"]
    assert told[-1] in goal.lines[begin + 5 :]  # again, for the searches after each step


def test_a_short_search_says_nothing(system: Make) -> None:
    made = system("dynamic.incremental.recording", "-c", "steps=9").start()
    goal = made.goal("visit(4)")
    assert goal.wait() == "succeeded"
    assert not any(line.startswith("planning") for line in goal.lines)
