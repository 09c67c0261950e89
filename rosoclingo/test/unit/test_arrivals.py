"""Puts the events of a journal in order while they come."""

from __future__ import annotations

import struct
import tracemalloc
from typing import List

import pytest
from bag_maker import BEGIN, data, source, stamp
from hypothesis import given
from hypothesis import strategies as st

from rosoclingo.bags.record.arrivals import Journal
from rosoclingo.bags.topics import LOOP_TYPES
from rosoclingo.bags.wire import Message

KIND = LOOP_TYPES["journal"]
SOURCE = source("/rosoclingo/journal", KIND)


def _event(number: int, received: float = 0.0, *, begin: float = 0.0) -> Message:
    content = data(KIND, stamp=stamp(begin + number * 0.001), number=number)
    return Message(SOURCE, BEGIN + round(received * 10**9), content)


def _stamped(seconds: int, number: int) -> Message:
    return Message(SOURCE, BEGIN, struct.pack("<III", seconds, 0, number))


def _numbers(events: List[Message]) -> List[int]:
    return [int.from_bytes(event.data[8:12], "little") for event in events]


def test_history_after_newer_events() -> None:
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


def test_numbers_and_bytes_that_no_rosoclingo_sends() -> None:
    journal = Journal()
    short = Message(SOURCE, BEGIN, b"short")
    tracemalloc.start()
    odd = journal.sort([_event(0), _stamped(2**32 - 1, 2**32 - 1), _stamped(0, 0), short])
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 2**20
    assert _numbers(odd) == [0, 0, 0, 2**32 - 1]  # that of the short one first
    assert journal.sort([short]) == []
    events = [_event(number) for number in (1, 2, 3)]
    assert _numbers(journal.sort(events)) == [1, 2, 3]
    assert journal.sort(events) == []
    assert _numbers(journal.sort([_event(1, begin=10.0)])) == [1]


@pytest.mark.costly
def test_a_long_journal_takes_little_memory() -> None:
    journal = Journal()
    for begin in range(1, 80_001, 1_000):
        journal.sort([_stamped(number, number) for number in range(begin, begin + 1_000)])
        if begin == 20_001:
            tracemalloc.start()
    grown, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert grown < 3 * 2**20
    history = [_stamped(number, number) for number in range(78_001, 80_001)]
    assert journal.sort(history) == []


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
