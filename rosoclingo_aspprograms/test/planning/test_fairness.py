"""No request waits for ever: one that is far away is served, however many come that are nearer."""

from __future__ import annotations

from pathlib import Path
from typing import List

import pytest
from episode import DYN_RESET, MAILBOT, RESET, Request
from test_actions import World, write

SIDE = 10
FAR = "bring(100,90)"
NEAR = ("bring(1,2)", "bring(2,11)", "bring(11,12)", "bring(12,1)", "bring(2,1)", "bring(11,2)")
MOST = 60  # requests that come one after the other


def _grid() -> str:
    """Returns the ways of a map of 10 x 10 places, from 1 in one corner to 100 in the other."""
    places = range(1, SIDE * SIDE + 1)
    ways = [(n, n + 1) for n in places if n % SIDE] + [
        (n, n + SIDE) for n in places if n <= SIDE * (SIDE - 1)
    ]
    return " ".join(f"connection({a},{b})." for a, b in ways)


COURIER = """
#include "{actions}".
#program base.
way(V,W) :- connection(V,W).
way(W,V) :- connection(V,W).
moves(r). initially(at(r),1). number(room,1).
request(bring(A,B)) :- place(A), place(B), A != B.
#program present(k,t).
own(ID,thing(ID),A,k) :- asked(ID,bring(A,B),k).
wants(ID,thing(ID),B,k) :- asked(ID,bring(A,B),k).
action(r,pick(ID),k) :- asked(ID,bring(A,B),k).
needs(r,pick(ID),at(r),A,k) :- asked(ID,bring(A,B),k).
needs(r,pick(ID),thing(ID),A,k) :- asked(ID,bring(A,B),k).
sets(r,pick(ID),thing(ID),r,k) :- asked(ID,bring(A,B),k).
uses(r,pick(ID),room,1,k) :- asked(ID,bring(A,B),k).
action(r,put(ID),k) :- asked(ID,bring(A,B),k).
needs(r,put(ID),at(r),B,k) :- asked(ID,bring(A,B),k).
needs(r,put(ID),thing(ID),r,k) :- asked(ID,bring(A,B),k).
sets(r,put(ID),thing(ID),B,k) :- asked(ID,bring(A,B),k).
gives(r,put(ID),room,1,k) :- asked(ID,bring(A,B),k).
#program base.
"""


def _serve(world: World) -> None:
    """Has three near requests open at any time, until the far one is served."""
    far = world.request(FAR)
    near: List[Request] = []

    def turn() -> bool:
        for actuator in sorted(world.acting):
            world.answer(actuator)
        open_ones = [one for one in near if not one.ended]
        while not far.ended and len(open_ones) < 3 and len(near) < MOST:
            near.append(world.request(NEAR[len(near) % len(NEAR)]))
            open_ones.append(near[-1])
        return bool(world._items)

    world.turn = turn  # type: ignore[method-assign]
    assert world.run() is None
    assert far.words[-1] == "succeeded"
    assert len(near) < MOST, "it was served only when nothing else came any more"


@pytest.mark.costly
@pytest.mark.parametrize("mode", [RESET, DYN_RESET])
def test_the_mailbot_serves_a_far_request(mode: str, tmp_path: Path) -> None:
    grid = write(tmp_path, f"office(1..100). start(r,1). {_grid()}")
    _serve(World(mode, [grid, MAILBOT], ["-c", "slots=4"]))


@pytest.mark.costly
@pytest.mark.parametrize("mode", [RESET, DYN_RESET])
def test_a_far_request_is_served_with_actions(mode: str, tmp_path: Path) -> None:
    courier = write(tmp_path, COURIER + _grid())
    _serve(World(mode, [courier], ["-c", "slots=4"]))
