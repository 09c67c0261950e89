"""A recorded run, at any time."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any, Dict

import pytest
from console_server import awaited, until

from rosoclingo.bags.holds import OperatorDecisions
from rosoclingo.bags.model import FeedbackLine, Recording
from rosoclingo.bags.read.reader import read_recording
from rosoclingo.loop import journal
from rosoclingo.loop.journal import Control, Entry
from rosoclingo.loop.quality import Quality
from rosoclingo_console import bag_console
from rosoclingo_console.model.playback import Playback
from rosoclingo_console.web.player import Player

BAGS = Path(__file__).resolve().parents[3] / "test" / "bags"


def shown(playback: Playback, seconds: float) -> Dict[str, Any]:
    """What a page shows of a time."""
    model = playback.seek(seconds)
    model.changes()
    return model.snapshot()


@pytest.mark.parametrize(
    "name", ["mailbot_dynamic_reset", "scenario3_dyn_reset", "line_single_2.0"]
)
def test_a_bag_to_and_fro(name: str) -> None:
    """Whatever was seen before, a time is shown in the same way."""
    recording = read_recording(BAGS / f"{name}.bag", with_feedback=True)
    assert recording.feedback
    playback = Playback(recording)
    times = [playback.seconds * part for part in (1.0, 0.3, 0.0, 0.6, 0.5, 2.0)]
    for seconds in times:
        assert shown(playback, seconds) == shown(Playback(recording), seconds)
    ended = [goal for goal in playback.model.goals.rows({}).values() if goal["ended"] is not None]
    assert ended
    assert {goal["status"] for goal in ended} <= {"succeeded", "canceled", "aborted", "rejected"}


def entries(*events: journal.Event, **others: Any) -> Playback:
    made = [Entry(event, 1, 3, number, float(number)) for number, event in enumerate(events, 1)]
    return Playback(Recording("/rosoclingo", tuple(made), **others))


def test_what_follows_from_a_journal() -> None:
    playback = entries(
        journal.PlanFound(("do(robot,go(2),1)", "do(robot,go(3),2)")),
        journal.ActionPublished("robot", "go(2)"),
        journal.ControlArrived(Control.PAUSE),
        journal.ControlArrived(Control.HOLD, "robot"),
        journal.MessageArrived("robot", "success"),
        journal.ControlArrived(Control.RELEASE, "robot"),
        journal.ControlArrived(Control.RESUME),
        journal.CommandDone("reset(1)"),
    )

    def robot(seconds: float) -> Any:
        return shown(playback, seconds)["tables"]["actuators"]["robot"]

    assert robot(1.5)["state"] == "begins"
    assert (robot(2.5)["state"], robot(2.5)["action"]) == ("acts", "go(2)")
    assert shown(playback, 3.5)["tables"]["run"]["run"]["paused"]
    assert (robot(5.5)["state"], robot(5.5)["next"]) == ("hold", [2, "go(3)"])
    assert robot(6.5)["state"] == "pause"
    assert not shown(playback, 7.5)["tables"]["run"]["run"]["paused"]
    assert shown(playback, 8.5)["tables"]["plan"]["plan"]["actions"] == []
    assert robot(1.5)["state"] == "begins"


def test_what_an_operator_held() -> None:
    """The bag says it, so it is not guessed from the requests of the journal."""
    playback = entries(
        journal.PlanFound(("do(robot,go(2),1)",)),
        journal.ControlArrived(Control.PAUSE),
        journal.ActionPublished("robot", "go(2)"),
        held=(
            (0.5, OperatorDecisions()),
            (1.25, OperatorDecisions(held=(("robot", "go(2)", "approval"),))),
            (1.75, OperatorDecisions(True, ("lift",), (("robot", "go(2)", "pause"),))),
            (2.5, OperatorDecisions()),
        ),
    )

    def state(seconds: float) -> Any:
        tables = shown(playback, seconds)["tables"]
        return tables["actuators"].get("robot", {}).get("state"), tables["run"]["run"]["paused"]

    expected = {1.5: ("approval", False), 2.25: ("pause", True), 2.75: ("begins", False)}
    assert {seconds: state(seconds) for seconds in expected} == expected
    assert state(1.5) == expected[1.5]
    player = Player(playback)
    assert player.about()["holds"] == [
        (1.25, "robot: go(2) for approval"), (1.75, "paused, lift on hold"),
    ]  # fmt: skip


def test_what_goals_were_told_and_what_the_plan_costs() -> None:
    playback = entries(
        journal.GoalArrived("g", "visit(2)"),
        journal.PlanFound((), quality=Quality((3, 7), (3, 7))),
        feedback=(FeedbackLine(1.5, "g", "why: 2 is closed"), FeedbackLine(2.5, "g", "plan 7")),
    )

    def why(seconds: float) -> Any:
        return shown(playback, seconds)["tables"]["goals"]["g"]["why"]

    assert [why(seconds) for seconds in (1.25, 2.0, 3.0, 2.0)] == [
        "", "2 is closed", "", "2 is closed",
    ]  # fmt: skip
    assert shown(playback, 2.0)["tables"]["run"]["run"]["quality"] == "3 7, the best"


@awaited
async def test_a_player() -> None:
    player = Player(entries(journal.GoalArrived("g", "visit(2)"), journal.LoopWaits()))
    player.hub.start(asyncio.get_event_loop())
    player.start()
    name = "/rosoclingo"

    def goals() -> Any:
        return player.hub.models[name].snapshot()["tables"].get("goals", {})

    await until(goals)
    assert player.clock() == {"now": 2.0, "ros": 2.0, "rate": 0.0}
    assert player.play(False, -5.0, 1.0).done
    await until(lambda: player.clock()["now"] == 0.0 and not goals())
    assert player.play(True, 0.0, 20.0).done
    await until(goals)
    await until(lambda: player.clock()["rate"] == 0.0)
    assert player.clock()["now"] == 2.0
    for refused in (
        player.control(name, Control.PAUSE, "", "", 0), player.send_goal(name, "visit(2)", ()),
        player.send_message(name, "info", "close(2)"),
        player.cancel(name, "g"), player.ask(name, "plan", ()), player.record(name, True),
    ):  # fmt: skip
        assert not refused.done


@pytest.mark.parametrize(
    ("arguments", "said"),
    [(["none.bag"], "none.bag"), ([str(Path(__file__))], "bag"), (["--port"], "--port")],
)
def test_what_is_no_bag(arguments: Any, said: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        bag_console.main(arguments)
    assert ended.value.code == 2
    assert said in capsys.readouterr().err
