"""A run told line by line, from the entries of its journal.

>>> story = RunStory(print)
>>> story.hear(Entry(journal.ActionPublished("robot", "go(2)"), step=1, horizon=2))
step 1 of 2, at 0 s
    robot: go(2)
>>> story.hear(Entry(journal.MessageArrived("robot", "failure"), 1, 2, seconds=1.0))
    robot answers failure, at 1 s
"""

from __future__ import annotations

from typing import Any, Callable, List, Mapping

from rosclingo.wire.commands import Result
from rosoclingo.bags.report.changes import change
from rosoclingo.bags.run_model import RunModel, TrackedGoal
from rosoclingo.loop import journal
from rosoclingo.loop.journal import Entry, Status
from rosoclingo.loop.values.beliefs import Beliefs, causes_in_words
from rosoclingo.loop.values.phrases import TermPhrases


class RunStory:
    """Narrates a run line by line, from its journal in order."""

    def __init__(
        self,
        say: Callable[[str], None],
        *,
        commands: bool = False,
        phrases: Callable[[], TermPhrases] = TermPhrases,
    ) -> None:
        """Prepares a narration.

        Args:
            say: Called with each line.
            commands: Whether each command of the controller is told, too.
            phrases: Returns what causes are called; asked when something is believed.
        """
        self._say = say
        self._commands = commands
        self._phrases = phrases
        self._run = RunModel()
        self._count = 0  # commands
        self._step = 0
        self._elapsed = 0  # steps, which a reset does not number anew
        self._headed = 0  # the last step that was told
        self._searches = 0  # since the last plan
        self._is_better = False  # the plan that is found next
        self._believed = ""
        self._tellers: Mapping[type, Callable[[Entry, Any], List[str]]] = {
            journal.GoalArrived: self._on_goal,
            journal.CancelArrived: lambda _, e: [f"{self._goal(e.goal)} is to be cancelled"],
            journal.MessageArrived: self._on_message,
            journal.ControlArrived: lambda _, e: (
                [] if e.control in journal.OWN_CONTROLS else [f"the operator says: {e.words}"]
            ),
            journal.ActionWithdrawn: lambda _, e: [f"withdrawn: {e.actuator} {e.action}"],
            journal.ActionRetried: lambda _, e: [f"{e.actuator} will retry {e.action}: {e.answer}"],
            journal.MessageDropped: lambda _, e: [f"dropped a message: {e.reason}"],
            journal.CommandDone: self._on_command,
            journal.SearchEnded: self._on_search,
            journal.PlanFound: self._on_plan,
            journal.BeliefsChanged: self._on_beliefs,
            journal.ActionPublished: lambda _, e: [f"{e.actuator}: {e.action}"],
            journal.StatusSet: self._on_status,
            journal.LoopWaits: lambda *_: [] if self._run.is_acting else ["waits"],
            journal.LoopEnded: lambda _, e: [f"the loop ends: {e.reason}"],
        }

    def hear(self, entry: Entry) -> None:
        """Tells the next entry."""
        self._elapsed += max(0, entry.step - self._step)
        self._step = entry.step
        self._run.apply(entry)
        teller = self._tellers.get(type(entry.event))
        said = teller(entry, entry.event) if teller else []
        if said and self._elapsed > self._headed:
            self._head(entry)
        for line in said:
            self._say(f"    {line}")

    def _head(self, entry: Entry) -> None:
        """Prints the step's heading; a line sums up steps before in which nothing has happened."""
        first, last = self._headed + 1, self._elapsed - 1
        if first <= last:
            steps = f"step {first}" if first == last else f"steps {first} to {last}"
            self._say(f"{steps}: nothing to do")
        self._headed = self._elapsed
        before = self._elapsed - entry.step
        self._say(f"step {self._elapsed} of {before + entry.horizon}, at {entry.seconds:g} s")

    def _goal(self, identifier: str) -> str:
        goal = self._run.goals[identifier]
        return f"goal {goal.id}, {goal.request}," if goal.has_arrived else f"goal {goal.id}"

    def _on_goal(self, _: Entry, event: journal.GoalArrived) -> List[str]:
        goal = self._run.goals[event.goal]
        ended = [] if goal.ended is None else [self._end(goal)]
        return [f"goal {goal.id} comes: {goal.request}", *ended]

    def _on_message(self, entry: Entry, event: journal.MessageArrived) -> List[str]:
        if self._run.messages[-1].action is None:
            return [f"message {event.source}: {event.value}"]
        return [f"{event.source} answers {event.value}, at {entry.seconds:g} s"]

    def _on_beliefs(self, _: Entry, event: journal.BeliefsChanged) -> List[str]:
        words = ", ".join(causes_in_words(Beliefs.read(event.terms).believed, self._phrases()))
        if words == self._believed:
            return []
        self._believed = words
        return [f"believed: {words}" if words else "nothing is believed any more"]

    def _on_command(self, _: Entry, event: journal.CommandDone) -> List[str]:
        self._count += 1
        lines = []
        if self._commands:
            result = f": {event.result.value}" if event.result else ""
            lines = [f"command {self._count}, {event.command}{result}"]
        if event.is_search:
            self._searches += event.result is not Result.SAT
        if event.resets_to is not None:
            lines.append(f"reset: step {event.resets_to} is step 0 for the planner now")
        return lines

    def _on_search(self, _: Entry, event: journal.SearchEnded) -> List[str]:
        if event.how in journal.IMPROVING:
            self._is_better = event.how is journal.Ended.BETTER
        if event.how is journal.Ended.AS_BEFORE and event.quality and event.quality.is_best:
            return ["there is no better plan"]
        return []

    def _on_plan(self, entry: Entry, event: journal.PlanFound) -> List[str]:
        searches, self._searches = self._searches + 1, 0
        what, self._is_better = "a better plan" if self._is_better else "another plan", False
        changed = change(entry, self._run)
        if changed is None:
            return []
        best = "" if event.is_best else ", the best so far"
        found = f"{_number(changed.new, 'action')} ahead{best}, after {_number(searches, 'search')}"
        if not self._run.plan_before.steps():
            return [f"plan: {found}"]
        later = self._elapsed - entry.step
        new, old = (", ".join(actions) or "nothing" for actions in (changed.after, changed.before))
        return [f"{what}: {found}; in step {later + changed.first} {new} instead of {old}"]

    def _on_status(self, _: Entry, event: journal.StatusSet) -> List[str]:
        goal = self._run.goals[event.goal]
        if goal.is_recalled and not goal.has_arrived:
            return []  # that is told when the loop takes it
        if event.status is Status.ACCEPTED:
            return [f"{self._goal(goal.id)} is accepted, in slot {event.slot}"]
        return [self._end(goal)]

    def _end(self, goal: TrackedGoal) -> str:
        is_asked = goal.status in (Status.SUCCEEDED, Status.CANCELED)
        why = "" if is_asked and goal.slot else f": {goal.reason}"
        return f"{self._goal(goal.id)} {_ENDS[goal.status]}{why}"


_ENDS = {
    Status.REJECTED: "is rejected",
    Status.SUCCEEDED: "has succeeded",
    Status.CANCELED: "is canceled",
    Status.ABORTED: "is aborted",
}


def _number(count: int, word: str) -> str:
    plural = f"{word}es" if word.endswith("ch") else f"{word}s"
    return f"{count} {word if count == 1 else plural}"
