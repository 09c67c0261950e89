"""Events of the journal in words, for the tail of the journal.

>>> tell(journal.ActionPublished("robot", "go(2)"), {})
('action', 'robot: go(2)')
>>> goals = {"g1": TrackedGoal("g1", 1, 0.0, "visit(2)")}
>>> tell(journal.StatusSet("g1", journal.Status.SUCCEEDED, "1"), goals)
('goal', 'visit(2) has succeeded')
"""

from __future__ import annotations

from typing import Any, Callable, Mapping, Tuple

from rosclingo.errors import shorten
from rosoclingo.bags.run_model import TrackedGoal
from rosoclingo.loop import journal
from rosoclingo.loop.journal import Status
from rosoclingo.loop.values.beliefs import Beliefs, causes_in_words
from rosoclingo.loop.values.phrases import NO_PHRASES, TermPhrases

_LONGEST = 300  # characters of a line
_ENDS = {
    Status.ACCEPTED: "is accepted",
    Status.REJECTED: "is rejected",
    Status.SUCCEEDED: "has succeeded",
    Status.CANCELED: "is cancelled",
    Status.ABORTED: "is aborted",
}

BELIEF = "belief"
"""The kind of the lines about beliefs."""

KnownGoals = Mapping[str, TrackedGoal]
"""The goals that are known, by their ids."""


def tell(
    event: journal.Event, goals: KnownGoals, phrases: TermPhrases = NO_PHRASES
) -> Tuple[str, str]:
    """Returns the kind of a line, by which lines are filtered, and the line."""
    if isinstance(event, journal.BeliefsChanged):
        return BELIEF, shorten(_believed(event, phrases), _LONGEST)
    kind, words = _TELLERS.get(type(event), ("other", _unknown))
    return kind, shorten(words(event, goals), _LONGEST)


def _named(goal: str, goals: KnownGoals) -> str:
    known = goals.get(goal)
    return known.request if known and known.request else f"goal {goal}"


def _goal(event: journal.GoalArrived, _: KnownGoals) -> str:
    more = f" ({', '.join(event.information)})" if event.information else ""
    return f"{event.request}{more} is asked for"


def _status(event: journal.StatusSet, goals: KnownGoals) -> str:
    where = f", in slot {event.slot}" if event.status is Status.ACCEPTED and event.slot else ""
    is_asked = event.status in (Status.SUCCEEDED, Status.CANCELED) and event.slot
    why = f": {event.reason}" if event.reason and not is_asked else ""
    return f"{_named(event.goal, goals)} {_ENDS[event.status]}{where}{why}"


def _command(event: journal.CommandDone, _: KnownGoals) -> str:
    result = f": {event.result.value}" if event.result else ""
    return f"{event.command}{result}, {event.seconds:.3g} s"


def _plan(event: journal.PlanFound, _: KnownGoals) -> str:
    count = f"{len(event.actions)} action{'' if len(event.actions) == 1 else 's'}"
    best = "" if event.is_best else ", the best so far"
    cost = f", costs {' '.join(map(str, event.quality.cost))}" if event.quality else ""
    return f"a plan with {count} from now on{best}{cost}"


def _believed(event: journal.BeliefsChanged, phrases: TermPhrases) -> str:
    causes = causes_in_words(Beliefs.read(event.terms).believed, phrases)
    return f"believed: {', '.join(causes)}" if causes else "nothing is believed any more"


def _retried(event: journal.ActionRetried, _: KnownGoals) -> str:
    return f"{event.actuator}: {event.action} has ended by {event.answer}, retry {event.retry}"


def _control(event: journal.ControlArrived, _: KnownGoals) -> str:
    who = "the loop" if event.control in journal.OWN_CONTROLS else "the operator"
    return f"{who} says: {event.words}"


def _took(event: journal.ActionTook, _: KnownGoals) -> str:
    return f"{event.actuator}: {event.kind} took {event.seconds:.3g} s"


def _resumed(event: journal.NodeResumed, _: KnownGoals) -> str:
    why = f", lost with: {event.reason}" if event.reason else ""
    return f"{event.node} goes on after {event.seconds:.3g} s{why}"


def _unknown(event: journal.Event, _: KnownGoals) -> str:
    if isinstance(event, journal.Unknown):
        fields = event.fields
        return " ".join((fields.kind, fields.id, fields.text))
    return type(event).__name__


_TELLERS: Mapping[type, Tuple[str, Callable[[Any, KnownGoals], str]]] = {
    journal.GoalArrived: ("goal", _goal),
    journal.CancelArrived: ("goal", lambda e, r: f"{_named(e.goal, r)} is to be cancelled"),
    journal.StatusSet: ("goal", _status),
    journal.MessageArrived: ("message", lambda e, _: f"{e.source} says {e.value}"),
    journal.MessageDropped: ("message", lambda e, _: f"dropped: {e.reason}"),
    journal.ControlArrived: ("operator", _control),
    journal.CommandDone: ("command", _command),
    journal.PlanFound: ("plan", _plan),
    journal.SearchEnded: ("command", lambda e, _: f"a search has ended: {e.how.value}"),
    journal.ActionPublished: ("action", lambda e, _: f"{e.actuator}: {e.action}"),
    journal.ActionWithdrawn: ("action", lambda e, _: f"withdrawn: {e.actuator} {e.action}"),
    journal.ActionRetried: ("action", _retried),
    journal.ActionTook: ("command", _took),
    journal.ClockRead: ("command", lambda e, _: f"the planner is told the time: {e.seconds:.0f} s"),
    journal.LoopWaits: ("command", lambda *_: "the loop waits"),
    journal.Explained: ("why", lambda e, _: f"why {e.question}: {e.text}"),
    journal.NodeResumed: ("node", _resumed),
    journal.LoopEnded: ("node", lambda e, _: f"the loop has ended: {e.reason}"),
}
