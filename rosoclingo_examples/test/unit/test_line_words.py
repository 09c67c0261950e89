"""The words that a client's prompt offers."""

from __future__ import annotations

from rosoclingo_examples.line_words import LineWords

REQUESTS = ["bring(o1,o2)", "bring(o1,o3)", "bring(o2,room(1))", "visit(o9)", "bring(o8)"]
TIMED = [*REQUESTS, "bring(o2,o1,urgent)"]


def test_nothing_is_offered_before_the_encoding_is_known() -> None:
    words = LineWords(with_object=True)
    assert words.offered([]) == words.offered(["o1"]) == words.offered(["o1", "o2", "box"]) == []


def test_places_of_requests() -> None:
    words = LineWords(with_object=False)
    words.learn(TIMED)
    assert words.offered([]) == ["o1", "o2"]
    assert words.offered(["o1"]) == ["o2", "o3"]
    assert words.offered(["o2"]) == ["room(1)", "o1"]
    assert words.offered(["o3"]) == words.offered(["o("]) == words.offered(["X"]) == []
    assert words.offered(["o1", "o2"]) == words.offered(["o1", "o2", "box"]) == []
    words.learn(["bring(a,b)"])
    assert words.offered([]) == ["a"]


def test_when_follows_the_object() -> None:
    words = LineWords(with_object=True)
    words.learn(REQUESTS)
    assert words.offered(["o1", "o2", "box"]) == []
    words.learn(TIMED)
    assert words.offered(["o1", "o2", "box"]) == ["urgent", "by"]
    assert words.offered(["o1", "o2"]) == words.offered(["o1", "o2", "box", "by"]) == []


def test_numbers_of_requests_are_a_first_word() -> None:
    words = LineWords(with_object=False)
    words.learn(["bring(1,3)"])
    assert words.offered([], [1, 2]) == ["1", "2"]
    assert words.offered(["1"], [1, 2]) == ["3"]


def test_hostile_places() -> None:
    """No place is offered that is no word of a line, or that a terminal would show as another."""
    words = LineWords(with_object=False)
    words.learn(['bring("a b",c)', 'bring("\x1b[2J",c)', 'bring("$(x)",c)', "bring("])
    assert words.offered([]) == ['"$(x)"']
    assert words.offered(['"$(x)"']) == ["c"]
