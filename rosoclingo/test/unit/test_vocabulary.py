"""What was meant by a request that is unknown."""

from __future__ import annotations

import pytest

from rosoclingo.loop.demand import Demand
from rosoclingo.loop.vocabulary import ToldVocabulary, Vocabulary

OFFICES = [f"o{number}" for number in range(1, 15)]
REQUESTS = [f"bring({o},{p})" for o in OFFICES for p in OFFICES if o != p]
OTHERS = ["go(1)", "go(5)", "rest", "cancel"]


def full() -> Vocabulary:
    vocabulary = Vocabulary()
    vocabulary.learn([f"event(1,{request},3)" for request in REQUESTS + OTHERS], 3)
    return vocabulary


def told() -> ToldVocabulary:
    """Knows one request from each office, and one to each, as examples."""
    first, *others = OFFICES
    examples = [f"bring({o},{p})" for one in others for o, p in ((first, one), (one, first))]
    return ToldVocabulary(Demand(tells=True, examples=[*examples, *OTHERS[:-1]]), ["1"])


@pytest.mark.parametrize(
    ("request_text", "meant"),
    [
        ("bring(o99,o14)", "bring(o9,o14)"),
        ("bring(o_9,o14x)", "bring(o9,o14)"),
        ("brng(o9,o14)", "bring(o9,o14)"),
        ("go(17)", "go(5)"),
        ("go(-3)", "go(1)"),
        ("rests", "rest"),
        ("rest(1)", "rest"),
    ],
)
@pytest.mark.parametrize("vocabulary", [full(), told()], ids=["full", "told"])
def test_what_was_meant(vocabulary: Vocabulary, request_text: str, meant: str) -> None:
    assert vocabulary.explain("1", request_text).endswith(f"; did you mean {meant}?")


@pytest.mark.parametrize("request_text", ["bring(o9)", "bring(o9,o9)"])
@pytest.mark.parametrize("vocabulary", [full(), told()], ids=["full", "told"])
def test_one_that_is_alike(vocabulary: Vocabulary, request_text: str) -> None:
    meant = vocabulary.explain("1", request_text).partition("; did you mean ")[2][:-1]
    assert meant in REQUESTS


@pytest.mark.parametrize(
    "request_text",
    ["fly(2)", "cancell", "(1,2)", "7", "go(x)", "bring(7,o14)", f"bring{300 * 'x'}"],
)
@pytest.mark.parametrize("vocabulary", [full(), told()], ids=["full", "told"])
def test_nobody_knows(vocabulary: Vocabulary, request_text: str) -> None:
    assert "did you mean" not in vocabulary.explain("1", request_text)


def test_any_in_an_example_stands_for_every_term() -> None:
    examples = ["bring(o1,o2,by(any))", "bring(o1,o2,urgent)"]
    vocabulary = ToldVocabulary(Demand(tells=True, examples=examples), ["1"])

    def is_asked(request: str) -> bool:
        """Whether the examples do not exclude it."""
        return not vocabulary.is_sure([("1", request)], 0)

    assert is_asked("bring(o1,o2,by(30))")
    assert is_asked("bring(o1,o2,urgent)")
    assert not is_asked("bring(o1,o2,soon)")
    assert not is_asked("bring(o1,o2,by(30,40))")
    assert not is_asked("bring(o3,o2,by(30))")
    assert "o3 is unknown as the first argument" in vocabulary.explain("1", "bring(o3,o2,by(30))")
