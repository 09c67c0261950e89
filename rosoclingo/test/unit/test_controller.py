"""What the controller decides, be it ahead or not."""

from __future__ import annotations

from pathlib import Path

import pytest
from conftest import PACKAGE

from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.wire.commands import Result
from rosoclingo.errors import ControllerError
from rosoclingo.loop.mode.controller import Controller, Info

MODE = str(PACKAGE / "modes" / "dynamic.incremental.recording.lp")
UNSAT, SAT = Info(Result.UNSAT), Info(Result.SAT)


def make(file: str = MODE) -> Controller:
    controller = Controller(Engine(Options((file,))), is_remote=True)
    controller.prepare()
    return controller


def write(folder: Path, text: str) -> Controller:
    """Makes a controller with a mode of its own."""
    file = folder / "mode.lp"
    file.write_text(text)
    return make(str(file))


def test_a_right_guess_is_taken_and_a_wrong_one_changes_nothing() -> None:
    wary, bold = make(), make()
    run = [Info(), Info(), Info(), UNSAT, Info(Result.UNSAT, asked=1), SAT,
           Info(pending_actions=True)]  # fmt: skip
    guesses = [Info(), Info(), UNSAT, SAT, UNSAT, SAT, UNSAT]
    said = []
    for info, guess in zip(run, guesses):
        said.append(str(bold.decide(info)))
        assert said[-1] == str(wary.decide(info))
        bold.look_ahead(guess)
    assert said == [
        "initialize", "query(0)", "solve", "plan(1)", "plan(2)", "commit_actions(0)", "idle",
    ]  # fmt: skip


def test_a_wrong_guess_does_not_hold_up_the_loop(tmp_path: Path) -> None:
    controller = write(
        tmp_path,
        "#external event(info,(new_messages;result(sat;unsat)),0). do(controller,idle,1)."
        "1 { at(P,H) : H = 1..11 } 1 :- P = 1..12, event(info,result(sat),0)."
        ":- at(P,H), at(Q,H), P < Q.",
    )
    controller.look_ahead(SAT)  # takes minutes
    assert str(controller.decide(UNSAT)) == "idle"
    controller.look_ahead(SAT)
    controller.prepare()
    assert str(controller.decide(UNSAT)) == "idle"


def test_the_mode_is_told_the_numbers_that_it_declares(tmp_path: Path) -> None:
    controller = write(
        tmp_path,
        "#external event(info,(new_messages;step(3);query(7);left(4);left(0);planned_actions),0)."
        "do(controller,told(N),1) :- N = { event(info,(step(3);query(7);left(4)),0) }.",
    )
    told = [(3, 7), (3, 8), (0, 4), (3, 3), (9, 2)]
    said = [str(controller.decide(Info(step=step, asked=asked))) for step, asked in told]
    assert said == ["told(3)", "told(1)", "told(1)", "told(1)", "told(0)"]


def test_a_guess_is_right_whatever_of_it_the_mode_does_not_declare(tmp_path: Path) -> None:
    controller = write(tmp_path, "#external event(info,step(3),0). do(controller,idle,1).")
    controller.look_ahead(Info(step=1, asked=5))
    controller._solver.solve = None  # type: ignore[assignment,method-assign]
    assert str(controller.decide(Info(step=2, asked=9))) == "idle"


def test_a_fresh_start_forgets_what_was_decided_ahead() -> None:
    controller = make()
    controller.decide(Info())
    controller.look_ahead(Info())
    controller.prepare()
    assert str(controller.decide(Info())) == "initialize"


def test_an_error_ahead_counts_if_it_comes_true(tmp_path: Path) -> None:
    controller = write(
        tmp_path,
        "#external event(info,(new_messages;result(sat;unsat)),0)."
        "do(controller,idle,1) :- not event(info,result(sat),0).",
    )
    controller.look_ahead(SAT)
    assert str(controller.decide(Info())) == "idle"
    controller.look_ahead(SAT)
    with pytest.raises(ControllerError, match="has 0 commands"):
        controller.decide(SAT)


def test_an_error_names_what_the_mode_has_forgotten(tmp_path: Path) -> None:
    controller = write(
        tmp_path,
        "#external event(save,stage(ask),0). stage(start) :- not event(save,stage(ask),0)."
        "do(controller,initialize,1) :- stage(start). holds(stage(ask;tell),1) :- stage(start).",
    )
    controller.decide(Info())
    with pytest.raises(ControllerError, match=r"forgotten .*event\(save,F,0\): stage\(tell\)$"):
        controller.decide(Info())
