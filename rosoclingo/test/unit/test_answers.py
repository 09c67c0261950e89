"""How fulfill.py answers."""

from __future__ import annotations

import re
from typing import List, Optional

from rosoclingo.in_process.answers import Answers


def ask(answers: Answers, *actions: str) -> List[Optional[str]]:
    return [answers.next("robot", action) for action in actions]


def test_success_without_anything_else() -> None:
    assert ask(Answers(), "go(c1)", "pickup(1)") == ["success", "success"]


def test_the_first_that_applies() -> None:
    answers = Answers(
        ["failure", "none", "success"],
        re.compile("pickup"),
        re.compile(r"^go\(c\(2\)\)$|pickup"),
        1.0,
    )
    assert ask(answers, "go(1)", "go(2)", "pickup(1)") == ["failure", None, "success"]
    assert ask(answers, "pickup(1)", "go(c(2))", "go(c(3))") == [None, "failure", "failure"]
    # Another actuator begins the sequence anew.
    assert answers.next("other", "pickup(1)") == "failure"


def test_patterns_are_found_anywhere() -> None:
    answers = Answers(fail=re.compile("c3"))
    assert ask(answers, "go(c3)", "go(c4)") == ["failure", "success"]


def test_probability() -> None:
    actions = ["go(c1)"] * 1000
    first = ask(Answers(fail_probability=0.2, seed=3), *actions)
    assert 150 < first.count("failure") < 250
    assert ask(Answers(fail_probability=0.2, seed=3), *actions) == first
    assert ask(Answers(fail_probability=0.2, seed=4), *actions) != first
    assert set(ask(Answers(fail_probability=1.0), *actions)) == {"failure"}
    assert set(ask(Answers(fail_probability=0.0), *actions)) == {"success"}


def test_one_actuators_answers_do_not_depend_on_anothers() -> None:
    alone = ask(Answers(fail_probability=0.5), *["go(c1)"] * 50)
    answers = Answers(fail_probability=0.5)
    among_others = []
    for _ in range(50):
        answers.next("other", "go(c1)")
        among_others.append(answers.next("robot", "go(c1)"))
    assert among_others == alone
