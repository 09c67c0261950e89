"""Horizons that take turns."""

from __future__ import annotations

import math
from itertools import groupby, islice
from typing import Callable, List

from rosoclingo.loop.planner.interleaving import Interleaving, Turn, UnbrokenFirst


def test_each_horizon_gets_a_share_of_the_one_before() -> None:
    turns = list(islice(Interleaving(3, width=2, share=0.5, seconds=1.0).turns(), 5))
    assert [(turn.horizon, turn.seconds) for turn in turns] == [
        (3, 1.0), (4, 0.5), (3, 1.5), (4, 0.75), (5, 0.375)
    ]  # fmt: skip


def test_horizons_grow_geometrically() -> None:
    order = Interleaving(10, width=1, growth=1.5)
    horizons = []
    for turn in islice(order.turns(), 5):
        horizons.append(turn.horizon)
        order.refute(turn.horizon)
    assert horizons == [10, 15, 22, 33, 49]


def test_a_refuted_horizon_gets_no_more_turns() -> None:
    order = Interleaving(0, width=3)
    turns = order.turns()
    assert [next(turns).horizon for _ in range(3)] == [0, 1, 2]
    order.refute(1)
    assert [next(turns).horizon for _ in range(4)] == [0, 2, 3, 4]
    assert [next(turns).horizon for _ in range(5)] == [0, 2, 3, 4, 5]


def test_each_round_has_one_horizon_more() -> None:
    """So a plan is found however many horizons before it are hard."""
    horizons = {turn.horizon for turn in islice(Interleaving(1, growth=1.2).turns(), 200)}
    assert max(horizons) > 40


def unbroken_first(asked: int, last: float = math.inf) -> UnbrokenFirst:
    return UnbrokenFirst(asked, last, Interleaving(asked, last, growth=1.2, seconds=0.1))


def played(order: UnbrokenFirst, is_refuted: Callable[[Turn], bool], number: int) -> List[Turn]:
    """Returns the first turns, where some refute their horizon."""
    turns = []
    for turn in islice(order.turns(), number):
        turns.append(turn)
        if is_refuted(turn):
            order.refute(turn)
    return turns


def test_plans_without_pauses_have_long_turns_with_two_horizons() -> None:
    turns = played(unbroken_first(20), lambda _: False, 40)
    unbroken = [turn for turn in turns if turn.is_unbroken][:4]
    assert [turn.horizon for turn in unbroken] == [28, 35, 28, 35]
    assert [turn.seconds for turn in unbroken] == [2.0, 2.0, 3.0, 3.0]
    near = turns[: turns.index(unbroken[-1])]
    assert {turn.horizon for turn in near if not turn.is_unbroken} <= set(range(20, 36))


def test_rounds_alternate_between_two_restart_strategies() -> None:
    turns = played(unbroken_first(20), lambda _: False, 100)
    rounds = [key for key, _ in groupby(turns, lambda turn: turn.restarts_dynamically)]
    assert rounds[:4] == [True, False, True, False]
    for is_dynamic in (True, False):
        same = [turn for turn in turns if turn.restarts_dynamically == is_dynamic]
        assert {turn.is_unbroken for turn in same} == {True, False}


def test_other_plans_get_any_horizon_in_the_end() -> None:
    """And their horizons are refuted one by one, so that the order ends with the last one."""
    turns = played(unbroken_first(5), lambda _: False, 400)
    assert max(turn.horizon for turn in turns if not turn.is_unbroken) > 40
    assert max(turn.horizon for turn in turns if turn.is_unbroken) == 8
    turns = played(unbroken_first(5, 30), lambda turn: True, 400)
    assert {turn.horizon for turn in turns if not turn.is_unbroken} >= set(range(20, 31))
    assert len(turns) < 400


def test_pauses_may_be_needed() -> None:
    """Then no turns are left for plans without, however far the last horizon is."""
    turns = played(unbroken_first(5), lambda turn: turn.is_unbroken, 100)
    assert [turn.horizon for turn in turns if turn.is_unbroken] == [7, 8, 10, 13, 17]
    assert not turns[-1].is_unbroken
