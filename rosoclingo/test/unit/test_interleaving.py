"""Horizons that take turns."""

from __future__ import annotations

from itertools import islice

from rosoclingo.loop.planner.interleaving import Interleaving


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
