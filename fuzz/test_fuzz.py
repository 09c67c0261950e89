"""Each door stands hostile inputs: scripts/fuzz gives it more."""

from __future__ import annotations

import json
from typing import List

import pytest
from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

import fuzzing
from all_doors import DOORS, find_door
from fuzzing import Door, fuzz, limits

SEED = 1


@pytest.mark.costly
@pytest.mark.parametrize("name", DOORS)
def test_a_door(name: str) -> None:
    with limits(), find_door(name) as door:
        report = fuzz(door, door.inputs, SEED)
    assert not report.faults, "\n".join(map(str, report.faults.values()))
    assert report.inputs >= door.inputs
    assert report.taken > report.inputs // 500  # what is valid is not refused


class WeakDoor(Door):
    """A door with a fault of each kind."""

    name = "weak"
    errors = (KeyError, IndexError)
    words = (b"slow", b"large", b"bad", b"silent", b"long")

    def valid(self) -> SearchStrategy[bytes]:
        return st.just(b'{"a": 1}')

    def read(self, data: bytes) -> None:
        if b"slow" in data:
            while True:
                pass
        if b"large" in data:
            bytes(2**40)
        if b"silent" in data:
            raise KeyError
        if b"long" in data:
            raise IndexError("a" * 9_999)
        try:
            json.loads(data)
        except UnicodeDecodeError as err:
            raise KeyError("no text") from err


def test_faults_are_found_and_made_smaller(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fuzzing, "SECONDS", 0.02)
    monkeypatch.setattr(fuzzing, "_REDUCTION_SECONDS", 0.5)
    with limits(), WeakDoor() as door:
        report = fuzz(door, 600, SEED)
    kinds = {key.split()[0]: fault for key, fault in report.faults.items()}
    assert set(kinds) >= {"SlowInputError", "MemoryError", "AssertionError", "JSONDecodeError"}
    assert len(kinds["JSONDecodeError"].data) <= 2
    reasons: List[str] = [fault.reason for fault in report.faults.values()]
    assert any("an error of 10" in reason or "an error of 99" in reason for reason in reasons)
    assert report.taken
    assert report.refused


def test_the_same_seed_gives_the_same_inputs() -> None:
    def inputs(seed: int) -> List[bytes]:
        found: List[bytes] = []
        with limits(), find_door("requests") as door:
            fuzz(door, 200, seed, found.append)
        return found

    assert inputs(7) == inputs(7)
    assert inputs(7) != inputs(8)
