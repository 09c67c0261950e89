"""Puts the events of a journal in order while they come."""

from __future__ import annotations

from typing import List

from bag_maker import BEGIN, data, source, stamp
from hypothesis import given
from hypothesis import strategies as st

from rosoclingo.bags.arrivals import Journal, Received
from rosoclingo.bags.topics import LOOP_TYPES

KIND = LOOP_TYPES["journal"]
SOURCE = source("/rosoclingo/journal", KIND)


def _event(number: int, received: float = 0.0, *, begin: float = 0.0) -> Received:
    content = data(KIND, stamp=stamp(begin + number * 0.001), number=number)
    return Received(SOURCE, BEGIN + round(received * 10**9), content)


def _numbers(events: List[Received]) -> List[int]:
    return [int.from_bytes(event.data[8:12], "little") for event in events]


def test_backlog_after_newer_events() -> None:
    journal = Journal()
    assert _numbers(journal.sort([_event(4), _event(1), _event(2), _event(4)])) == [1, 2, 4]
    assert _numbers(journal.sort([_event(3), _event(2), _event(5)])) == [3, 5]


def test_times_have_the_order_of_the_numbers() -> None:
    events = Journal().sort([_event(2, 0.1), _event(1, 0.3), _event(3, 0.2)])
    times = [event.time - BEGIN for event in events]
    assert times == [300_000_000] * 3


def test_node_started_again() -> None:
    journal = Journal()
    journal.sort([_event(number) for number in range(1, 5)])
    again = [_event(number, begin=10.0) for number in (1, 2, 2)]
    assert _numbers(journal.sort(again)) == [1, 2]


@given(st.lists(st.integers(1, 30)), st.integers(1, 8))
def test_each_event_once(numbers: List[int], size: int) -> None:
    journal = Journal()
    events = [_event(number) for number in numbers]
    found = []
    for begin in range(0, len(events), size):
        batch = _numbers(journal.sort(events[begin : begin + size]))
        assert batch == sorted(batch)
        found += batch
    assert sorted(found) == sorted(set(numbers))
