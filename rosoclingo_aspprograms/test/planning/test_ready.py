"""What becomes so by itself is waited for, by those only who need it."""

from __future__ import annotations

from pathlib import Path
from typing import List, Tuple

import pytest
from episode import DYN_RESET, RECORDING, RESET, SINGLE
from test_actions import ACTIONS, World

from rosoclingo.loop.words import SOLVER

KITCHEN = """
#program base.
actuator(cook;waiter;other).
request((dish;look)).
initially(seen,no).
wants(look,seen,yes).
action(other,look).
sets(other,look,seen,yes).

#program present(k,t).
own(ID,food(ID),raw,k) :- asked(ID,dish,k).
wants(ID,food(ID),served,k) :- asked(ID,dish,k).
action(cook,put_on(ID),k) :- asked(ID,dish,k).
needs(cook,put_on(ID),food(ID),raw,k) :- asked(ID,dish,k).
sets(cook,put_on(ID),food(ID),cooked,k) :- asked(ID,dish,k).
ready(food(ID),cooked,30,k) :- asked(ID,dish,k).
action(waiter,serve(ID),k) :- asked(ID,dish,k).
needs(waiter,serve(ID),food(ID),cooked,k) :- asked(ID,dish,k).
sets(waiter,serve(ID),food(ID),served,k) :- asked(ID,dish,k).
"""


SCRAPES = """
#program base.
says(food(ID,X),food(ID),X) :- rslot(ID), X = (raw;cooked;burnt).

#program present(k,t).
action(cook,scrape(ID),k) :- asked(ID,dish,k).
needs(cook,scrape(ID),food(ID),burnt,k) :- asked(ID,dish,k).
sets(cook,scrape(ID),food(ID),raw,k) :- asked(ID,dish,k).
"""


class Kitchen(World):
    """Each action takes a second."""

    def __init__(self, mode: str, folder: Path, more: str = "") -> None:
        file = folder / "kitchen.lp"
        file.write_text(f'#include "{ACTIONS}".{KITCHEN}{more}')
        self.began: List[Tuple[str, float]] = []
        super().__init__(mode, [str(file)])

    def publish(self, actuator: str, action: str) -> None:
        if actuator != SOLVER:
            self.began.append((action, self.clock))
        super().publish(actuator, action)

    def turn(self) -> bool:
        self.clock += bool(self.acting)
        return super().turn()


@pytest.mark.parametrize("mode", [RECORDING, RESET, DYN_RESET, SINGLE])
def test_a_dish_is_served_when_it_is_cooked(mode: str, tmp_path: Path) -> None:
    kitchen = Kitchen(mode, tmp_path)
    goals = [kitchen.request(text) for text in ("dish", "look", "dish")]
    assert kitchen.run() is None
    assert [goal.words[-1] for goal in goals] == ["succeeded"] * 3
    began = dict(kitchen.began)
    assert len(began) == len(kitchen.began)
    assert began["look"] == 0
    for slot in (1, 3):
        assert began[f"serve({slot})"] >= began[f"put_on({slot})"] + 31


@pytest.mark.parametrize("mode", [RECORDING, RESET, DYN_RESET, SINGLE])
def test_a_cancelled_dish_is_not_waited_for(mode: str, tmp_path: Path) -> None:
    kitchen = Kitchen(mode, tmp_path)
    goal = kitchen.request("dish")
    turn = kitchen.turn

    def cancel_when_it_cooks() -> bool:
        if not kitchen.acting and not goal.ended:
            kitchen.cancel(goal)
            return True
        return turn()

    kitchen.turn = cancel_when_it_cooks  # type: ignore[method-assign]
    assert kitchen.run() is None
    assert goal.words[-1] == "canceled"
    assert kitchen.clock < 30


@pytest.mark.parametrize("mode", [RECORDING, RESET, DYN_RESET, SINGLE])
@pytest.mark.parametrize(
    ("said", "then"),
    [("cooked", ["serve(1)"]), ("raw", ["put_on(1)", "serve(1)"]),
     ("burnt", ["scrape(1)", "put_on(1)", "serve(1)"])],
)  # fmt: skip
def test_a_message_ends_what_becomes_so_by_itself(
    mode: str, said: str, then: List[str], tmp_path: Path
) -> None:
    """What a message says of a dish while it cooks goes before what it would become."""
    kitchen = Kitchen(mode, tmp_path, SCRAPES)
    goal = kitchen.request("dish")
    turn = kitchen.turn
    said_at: List[float] = []

    def tell_when_it_cooks() -> bool:
        if not (kitchen.acting or said_at):
            kitchen.clock += 5
            said_at.append(kitchen.clock)
            kitchen.tell("info", f"food(1,{said})")
            return True
        return turn()

    kitchen.turn = tell_when_it_cooks  # type: ignore[method-assign]
    assert kitchen.run() is None
    assert goal.words[-1] == "succeeded"
    assert [action for action, _ in kitchen.began] == ["put_on(1)", *then]
    assert kitchen.began[1][1] < said_at[0] + 1
