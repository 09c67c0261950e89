"""What was meant by a request that is unknown."""

from __future__ import annotations

from typing import List, Union

import pytest

from rosclingo.wire.term_text import split_term
from rosoclingo.loop.planner.demand import Demand
from rosoclingo.loop.planner.vocabulary import ToldVocabulary, Vocabulary, explain

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
    requests = [("1", example) for example in [*examples, *OTHERS[:-1]]]
    return ToldVocabulary(Demand(tells=True, requests=requests), ["1"])


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
    requests = [("1", example) for example in examples]
    vocabulary = ToldVocabulary(Demand(tells=True, requests=requests), ["1"])

    def is_asked(request: str) -> bool:
        """Whether the examples do not exclude it."""
        return not vocabulary.is_sure([("1", request)], 0)

    assert is_asked("bring(o1,o2,by(30))")
    assert is_asked("bring(o1,o2,urgent)")
    assert not is_asked("bring(o1,o2,soon)")
    assert not is_asked("bring(o1,o2,by(30,40))")
    assert not is_asked("bring(o3,o2,by(30))")
    assert "o3 is unknown as the first argument" in vocabulary.explain("1", "bring(o3,o2,by(30))")


@pytest.mark.parametrize("vocabulary", [full(), told()], ids=["full", "told"])
@pytest.mark.parametrize("typed", ["bring(o14,o99)", "bring(o9,o99)", "bring(o99,o9)"])
def test_nothing_senseless_is_suggested(vocabulary: Vocabulary, typed: str) -> None:
    """A request that repeats an argument, which no known one does."""
    meant = vocabulary.explain("1", typed).partition("; did you mean ")[2][:-1]
    assert meant in REQUESTS


def grid(repeats: bool) -> List[str]:
    places = range(1, 5)
    return [f"bring({o},{p})" for o in places for p in places if repeats or o != p]


@pytest.mark.parametrize("repeats", [False, True])
@pytest.mark.parametrize("are_examples", [False, True])
def test_the_closest_number(repeats: bool, are_examples: bool) -> None:
    said = explain("bring(4,99)", grid(repeats), are_examples=are_examples)
    assert said.endswith(f"did you mean bring(4,{4 if repeats else 3})?")
    said = explain("bring(98,99)", grid(repeats), are_examples=are_examples)
    assert said.endswith(f"did you mean bring(4,{4 if repeats else 3})?")


def test_any_in_an_example_may_be_equal_to_others() -> None:
    known = ["move(any,any,a)", "move(any,any,b)"]
    assert explain("move(3,3,aa)", known, are_examples=True).endswith("did you mean move(3,3,a)?")
    assert explain("move(3,4,aa)", known, are_examples=True).endswith("did you mean move(3,4,a)?")


MESSAGES = [
    "event(info,blocked(c3,c4),3)", "event(info,blocked(c4,c3),3)", "event(info,passed,3)",
    "event(robot,success,3)", "event(robot,failure,3)", "event(robot,busy,3)",
    "event(arm(1,left),grasped,3)", "event(commit,do(robot,go(1)),3)", "event(1,visit(3),3)",
]  # fmt: skip


@pytest.mark.parametrize(
    ("message", "meant"),
    [
        ("info blokced(c3,c4)", "blocked(c3,c4)"),
        ("info blocked(c3,c44)", "blocked(c3,c4)"),
        ("inof blocked(c3,c4)", "id info, value blocked(c3,c4)"),
        ("inof blokced(c3,c4)", "id info, value blocked(c3,c4)"),
        ("robot blocked(c3,c4)", "id info, value blocked(c3,c4)"),
        ("robot sucess", "success"),
        ("robt success", "id robot, value success"),
        ("base success", "id robot, value success"),
        ("arm(1,lft) grasped", "id arm(1,left), value grasped"),
        ("info burning(1)", ""),
        ("info blocked(c3,c4)", ""),
        ("info passd", ""),
        ("robot bussy", ""),
        ("commit do(robot,go(2))", ""),
        ("2 visit(3)", ""),
        ("comit do(robot,go(1))", ""),
    ],
)
@pytest.mark.parametrize("kind", ["full", "asked", "examples"])
def test_a_message_that_was_meant(kind: str, message: str, meant: str) -> None:
    vocabulary: Union[Vocabulary, ToldVocabulary] = Vocabulary()
    if kind != "full":
        pairs = [(source, content) for source, content, _ in (split_term(m)[1] for m in MESSAGES)]
        demand = Demand(tells=True)
        if kind == "asked":
            demand.declared = {**dict.fromkeys(pairs, True), ("info", "burning(2)"): False}
        else:
            atoms = [f"event({','.join(pair)})" for pair in pairs]
            demand.learn_examples([*atoms, "query(1)"], ["1"])
        vocabulary = ToldVocabulary(demand, ["1"])
    vocabulary.learn(MESSAGES, 3)
    said = vocabulary.suggest(*message.split(" "), others=("1", "2", "commit"))
    assert said == (f"; did you mean {meant}?" if meant else "")
