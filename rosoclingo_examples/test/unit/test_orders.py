"""What a user types, and what is told of it."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path
from typing import List

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rosoclingo_examples.orders import Bring, Order, Orders, parse_line
from rosoclingo_interfaces.errors import LedgerError, LineError


@pytest.mark.parametrize(
    ("line", "with_object", "meant"),
    [
        ("1 3", False, Bring("bring(1,3)")),
        ("  o9\to14 ", False, Bring("bring(o9,o14)")),
        ("f(1,2) 3", False, Bring("bring(f(1,2),3)")),
        ("1 3 box", True, Bring("bring(1,3)", ("box",))),
        ("o9 o14 box_of_chocolate", True, Bring("bring(o9,o14)", ("box_of_chocolate",))),
        ("o9 o14 5%&(Größe)", True, Bring("bring(o9,o14)", ("5%&(Größe)",))),
        ("o9 o14 box urgent", True, Bring("bring(o9,o14,urgent)", ("box",))),
        ("o9 o14 box by 60", True, Bring("bring(o9,o14,by(60))", ("box",))),
        ("o9 o14 urgent", True, Bring("bring(o9,o14)", ("urgent",))),
        ("7", False, 7),
        ("0012", True, 12),
    ],
)
def test_lines(line: str, with_object: bool, meant: object) -> None:
    assert parse_line(line, with_object) == meant


@pytest.mark.parametrize("with_object", [False, True])
@pytest.mark.parametrize(
    "line",
    [
        *("x", "-1", "1 2 3 4", "1 X y", "1) (2 y", "1 2) y", "²", "1" * 10, "o9,o14", "", "1.5"),
        *("1 2 y by", "1 2 y by x", "1 2 y by -1", "1 2 y by ²", "1 2 y by " + "1" * 10),
        *("1 2 y by 1 z", "1 2 y urgent z"),
    ],
)
def test_wrong_lines(line: str, with_object: bool) -> None:
    with pytest.raises(LineError):
        parse_line(line, with_object)


def test_a_wrong_line_says_what_is_expected() -> None:
    with pytest.raises(LineError, match=r"FROM TO, such as 1 3, or the ID .* not 'fetch it now'"):
        parse_line("fetch it now", with_object=False)
    with pytest.raises(LineError, match="FROM TO OBJECT, such as o9 o14 box_of_chocolate"):
        parse_line("o9 o14", with_object=True)
    with pytest.raises(LineError, match="chocolate, then urgent or by SECONDS if it is, or the ID"):
        parse_line("o9 o14 box by noon", with_object=True)
    with pytest.raises(LineError, match="'O9' is not a ground term"):
        parse_line("O9 o14", with_object=False)


@pytest.mark.costly
@given(st.text(), st.booleans())
def test_any_line(line: str, with_object: bool) -> None:
    """Whatever is typed, it is a request, a cancel, or refused."""
    with contextlib.suppress(LineError):
        meant = parse_line(line, with_object)
        assert isinstance(meant, int) or meant.request.startswith("bring(")


def orders(*ends: str) -> Orders:
    made = Orders()
    for end in ends:
        order = made.add(Bring("bring(1,3)"))
        if end:
            made.ended(order, end, "")
    return made


@pytest.mark.parametrize(
    ("ends", "summary"),
    [
        ([], "0 deliveries"),
        (["succeeded"], "1 delivery"),
        (["succeeded", "canceled", "succeeded"], "2 deliveries, 1 canceled"),
        (["rejected", "", "aborted", ""], "0 deliveries, 1 rejected, 1 aborted, 2 open"),
    ],
)
def test_summary(ends: List[str], summary: str) -> None:
    assert orders(*ends).summary() == summary


def test_numbers_and_lines() -> None:
    made = orders("succeeded", "")
    assert made.lines() == ["[1] bring(1,3): succeeded", "[2] bring(1,3): sent"]
    assert [order.number for order in made.open] == [2]


def test_wrong_numbers() -> None:
    with pytest.raises(LineError, match="no request 1; there are: none yet"):
        Orders().cancel(1)
    with pytest.raises(LineError, match="no request 3; there are: 1, 2"):
        orders("", "").cancel(3)
    with pytest.raises(LineError, match="request 1 has ended already: succeeded"):
        orders("succeeded").cancel(1)


def test_what_was_asked() -> None:
    made = Orders()
    first, second = made.add(Bring("bring(1,2)")), made.add(Bring("bring(1,3)", ("box",)))
    made.cancel(2)
    assert made.ended(first, "succeeded", "in step 3")
    assert made.ended(second, "canceled", "in step 3")
    assert made.all_as_asked
    assert str(second) == "[2] bring(1,3) box: canceled"


def test_an_end_that_nobody_asked_for() -> None:
    made = Orders()
    order = made.add(Bring("bring(1,2)"))
    assert made.ended(order, "canceled", "why not")
    assert not made.all_as_asked
    assert str(order) == "[1] bring(1,2): canceled: why not"


def test_what_comes_after_the_end() -> None:
    made = Orders()
    order: Order = made.add(Bring("bring(1,2)"))
    assert made.heard(order, "accepted")
    assert not made.heard(order, "accepted")
    assert made.ended(order, "succeeded", "")
    assert not made.heard(order, "step 1 of 3")
    assert not made.ended(order, "lost", "")
    assert str(order) == "[1] bring(1,2): succeeded"


def in_another_process(file: Path, made: Orders) -> Orders:
    """Returns the requests with which another process begins when the one with these is dead."""
    with pytest.raises(LedgerError, match=r"is used by another node that runs"):
        Orders(file)
    os.close(made._guard)
    return Orders(file)


def test_what_another_process_goes_on_with(tmp_path: Path) -> None:
    file = tmp_path / "my requests.json"
    made = Orders(file)
    first, second = made.add(Bring("bring(1,2)", ("Größe", "2"))), made.add(Bring("bring(1,3)"))
    third = made.add(Bring("bring(1,4)"))
    made.cancel(2)
    made.ended(third, "rejected", "")
    other = in_another_process(file, made)
    assert [(order.id, order.bring) for order in other.open] == [
        (first.id, first.bring), (second.id, second.bring),
    ]  # fmt: skip
    assert [order.cancel_requested for order in other.open] == [False, True]
    assert other.lines()[0] == "[1] bring(1,2) Größe 2: sent again"
    assert len({first.id, second.id, third.id, other.add(Bring("bring(1,4)")).id}) == 4
    for order in other.open:
        other.ended(order, "canceled", "")
    assert in_another_process(file, other).lines() == []


@pytest.mark.parametrize(
    "text", ["", "[]", '{"format": 2, "open": []}', '{"format": 1, "open": [{"id": "a"}]}']
)
def test_a_file_that_holds_no_requests(tmp_path: Path, text: str) -> None:
    file = tmp_path / "a.json"
    file.write_text(text)
    with pytest.raises(LedgerError, match=r"a\.json \(~store\) holds no requests: .* remove it"):
        Orders(file)
    assert file.read_text() == text


def test_what_cannot_be_kept_is_not_asked_for(tmp_path: Path) -> None:
    folder = tmp_path / "folder"
    folder.mkdir()
    made = Orders(folder / "a.json")
    order = made.add(Bring("bring(1,2)"))
    folder.rename(tmp_path / "elsewhere")
    with pytest.raises(LedgerError, match=r"cannot be written: .*; make room"):
        made.add(Bring("bring(1,3)"))
    with pytest.raises(LedgerError):
        Orders(folder / "a.json")
    assert made.open == [order]
