"""The order of a run of which there is no journal."""

from __future__ import annotations

from types import SimpleNamespace
from typing import List, Tuple

import pytest

from rosoclingo.bags.read.without_journal import Historian, TopicMessage, in_order

ACTION, ANSWER, STATUS, GOAL = ("out", "robot"), ("in", "robot"), ("status", ""), ("goal", "")


def order(*recorded: Tuple[Tuple[str, str], float]) -> List[Tuple[str, str]]:
    said = [TopicMessage(topic, at, SimpleNamespace(id=name)) for (topic, name), at in recorded]
    return [(one.topic, one.message.id) for one in in_order(said)]


@pytest.mark.parametrize("what", ["status", "feedback", "result"])
def test_an_answer_that_was_recorded_after_what_followed_from_it(what: str) -> None:
    followed = (what, "")
    ordered = order((ACTION, 1.0), (followed, 1.5), (followed, 1.51), (ANSWER, 1.52), (ACTION, 1.6))
    assert ordered == [ACTION, ANSWER, followed, followed, ACTION]


def test_an_answer_that_was_recorded_after_the_action_that_followed_from_it() -> None:
    other = ("out", "arm")
    ordered = order(
        (ACTION, 1.0), (STATUS, 1.5), (other, 1.51), (ACTION, 1.52), (ANSWER, 1.53), (ANSWER, 2.0)
    )
    assert ordered == [ACTION, ANSWER, STATUS, other, ACTION, ANSWER]


@pytest.mark.parametrize(
    "recorded",
    [
        [(ACTION, 1.0), (ACTION, 1.1), (ANSWER, 2.0)],  # another plan in the same step
        [(ACTION, 1.0), (GOAL, 1.1), (ACTION, 1.11), (ANSWER, 1.12), (ANSWER, 1.2)],
        [(ACTION, 1.0), (("in", "info"), 1.1), (ACTION, 1.11), (ANSWER, 1.12), (ANSWER, 1.2)],
        [(ACTION, 1.0), (STATUS, 1.1), (ANSWER, 2.0)],  # long before
        [(ACTION, 1.0), (STATUS, 1.1), (GOAL, 1.2), (ANSWER, 1.21)],
        [(ACTION, 1.0), (GOAL, 1.1), (STATUS, 1.2), (ANSWER, 1.21)],  # the goal may have caused it
        [(ACTION, 1.0), (("cancel", ""), 1.1), (STATUS, 1.2), (ANSWER, 1.21)],
        [(ACTION, 1.0), (ANSWER, 1.1), (STATUS, 1.2), (ANSWER, 1.21)],  # which answers nothing
        [(ACTION, 1.0), (STATUS, 1.1), (("in", "info"), 1.11)],  # no answer
        [(("out", "arm"), 0.9), (ACTION, 1.0), (ANSWER, 1.1)],
    ],
)
def test_what_stays(recorded: List[Tuple[Tuple[str, str], float]]) -> None:
    assert order(*recorded) == [what for what, _ in recorded]


def test_a_plan_of_too_many_steps() -> None:
    """Python refuses to read more than 4,300 digits."""
    plans = [SimpleNamespace(feedback=SimpleNamespace(status=f"plan {n} steps"))
             for n in (7, "9" * 5000)]  # fmt: skip
    goal = SimpleNamespace(
        goal_id=SimpleNamespace(id="g", stamp=SimpleNamespace(sec=0, nanosec=0)),
        goal=SimpleNamespace(request="visit(3)"),
    )
    said = [TopicMessage("feedback", float(n), one) for n, one in enumerate(plans)]
    (entry,) = Historian().entries([*said, TopicMessage("goal", 2.0, goal)])
    assert entry.horizon == 7
