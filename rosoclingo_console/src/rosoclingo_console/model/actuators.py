"""The actuators of a system as rows: what each does, and what it waits for.

>>> run = RunModel()
>>> table = ActuatorTable(run)
>>> for entry in (
...     journal.Entry(journal.ActionPublished("robot", "go(2)"), seconds=10.0),
...     journal.Entry(journal.MessageArrived("robot", "success"), seconds=12.5),
... ):
...     table.hear(entry.event, run.apply(entry))
>>> bar = table.bars()["1"]
>>> bar["action"], bar["ended"] - bar["began"], bar["answer"]
('go(2)', 2.5, 'success')
"""

from __future__ import annotations

from itertools import chain, islice, repeat
from typing import Any, Dict, FrozenSet, List, Mapping, Optional, Sequence, Tuple

from rosclingo.wire.term_text import split_term
from rosoclingo.bags.holds import OperatorDecisions
from rosoclingo.bags.run_model import RunModel, TrackedAction
from rosoclingo.encodings.known import KnownEncoding
from rosoclingo.loop import journal
from rosoclingo.loop.journal import Event
from rosoclingo.loop.words import INFO, LOST, SOLVER, SUCCESS, TIMEOUT, UNKNOWN
from rosoclingo_console.model.board import Row
from rosoclingo_console.model.metrics import OTHER
from rosoclingo_console.model.values import PlanAhead, TokenRow

_MOST_BARS = 200  # actions that a chart shows
_MOST_VALUES = 50  # different answers that are counted one by one
_DOUBTFUL = (UNKNOWN, TIMEOUT, LOST)  # answers after which it is not known what was done
_WEIGHT = 0.3  # of the last duration in a mean


class ActuatorTable:
    """Table of the actuators: each one's action, or its reason to wait. Not thread-safe."""

    def __init__(self, run: RunModel) -> None:
        """Begins before the first event of a run."""
        self.plan = PlanAhead()
        self.decisions = OperatorDecisions()
        self._run = run
        self._tokens: Tuple[TokenRow, ...] = ()
        self._progress: Dict[int, float] = {}  # by numbers of actions
        self._run_id = ""  # of the tokens
        self._leaves_out: Mapping[str, FrozenSet[str]] = {}
        self._means: Dict[str, float] = {}
        self._doubts: Dict[str, str] = {}  # by actuators, the actions that they did or did not
        self._answered: Dict[str, Tuple[TrackedAction, str, Dict[str, float]]] = {}  # means before
        self._begun = 0  # actions before the last reset
        self.answers: Dict[str, int] = {}

    def hear(self, event: Event, action: Optional[TrackedAction]) -> None:
        """Takes an event of the journal, which the run has taken.

        Args:
            event: The event.
            action: The action that begins or ends by it, or has not ended after all; if any.
        """
        if action is None:
            if isinstance(event, journal.CommandDone) and event.resets and self._run.actions:
                # Steps are counted anew: no action that was done is one of the plan's.
                self._begun = self._run.actions[-1].number
            return
        if action.actuator == SOLVER:
            return
        if isinstance(event, journal.ActionPublished):
            self._doubts.pop(action.actuator, None)
        elif isinstance(event, journal.MessageDropped):
            self._take_back(action)
        else:
            self._take_answer(action)

    def _take_answer(self, action: TrackedAction) -> None:
        actuator, answer = action.actuator, action.answer
        means = {k: n for k, n in self._means.items() if k in (actuator, "")}
        self._answered[actuator] = action, answer, means
        if answer in _DOUBTFUL:
            self._doubts[actuator] = action.name
        # A stranger may say anything in the place of an actuator.
        counted = answer if answer in self.answers or len(self.answers) < _MOST_VALUES else OTHER
        self.answers[counted] = self.answers.get(counted, 0) + 1
        if answer == SUCCESS and action.ended is not None:
            seconds = action.ended - action.began
            for key in (actuator, ""):
                self._means[key] = (1 - _WEIGHT) * self._means.get(key, seconds) + _WEIGHT * seconds

    def _take_back(self, action: TrackedAction) -> None:
        """An answer was none; nothing if another one has come since."""
        actuator = action.actuator
        last, answer, means = self._answered.get(actuator, (None, "", {}))
        if last is not action:
            return
        del self._answered[actuator]
        self.answers[answer if answer in self.answers else OTHER] -= 1
        for key in (actuator, ""):
            self._means.pop(key, None)
        self._means.update(means)
        self._doubts.pop(actuator, None)

    def place(self, robot: str) -> str:
        """A message says where a robot is; returns the action that is no longer in doubt."""
        return self._doubts.pop(robot, "")

    def doubt(self, robot: str, action: str) -> None:
        """That message was dropped: again it is not known whether the robot has done an action."""
        self._doubts[robot] = action

    def set_encoding(self, encoding: KnownEncoding) -> None:
        """Learns which actuators the encoding leaves out after which answers.

        Those are the ones that messages ``info:at(ACTUATOR,PLACE)`` are about.
        """
        placed = {
            split_term(message.partition(":")[2])[1][0]
            for message in encoding.messages
            if message.startswith(f"{INFO}:at(")
        }
        self._leaves_out = {
            actuator: _left_out_after(encoding.answers.get(actuator, ())) for actuator in placed
        }

    def set_tokens(self, tokens: Sequence[TokenRow], run: str = "") -> None:
        """Learns what ``~dispatch`` says of a run."""
        self._tokens = tuple(tokens)
        numbers = {one.number for one in self._doing().values() if run == self._run_id}
        self._progress = {n: done for n, done in self._progress.items() if n in numbers}
        self._run_id = run

    def set_progress(self, run: str, number: int, progress: float) -> None:
        """Learns what ``~heartbeat`` says.

        Args:
            run: That of the action; of another run than that of ``~dispatch``, nothing is kept.
            number: The action's, as ``~dispatch`` says it; of an unknown one, nothing is kept.
            progress: The part that is done, from 0 to 1; less, more or no number if that is
                unknown.
        """
        is_under_way = run == self._run_id and any(
            one.number == number for one in self._doing().values()
        )
        if is_under_way and 0 <= progress <= 1:
            self._progress[number] = round(progress, 2)

    def tokens(self) -> List[TokenRow]:
        """Returns what ``~dispatch`` would say, as far as it follows from the journal."""
        return [
            TokenRow(one.number, one.step, one.actuator, one.name, True, False)
            for one in self._run.last.values()
            if one.ended is None and one.actuator != SOLVER
        ]

    def count_open(self) -> int:
        """Returns how many actions are not answered."""
        return len(self._doing())

    def bars(self) -> Dict[str, Row]:
        """Returns the last actions as rows of a chart."""
        shown = [*islice(reversed(self._run.actions), _MOST_BARS)]
        return {
            str(one.number): {
                "number": one.number, "actuator": one.actuator, "action": one.name,
                "step": one.step, "began": one.began, "ended": one.ended, "answer": one.answer,
            }
            for one in reversed(shown)
            if one.actuator != SOLVER
        }  # fmt: skip

    def means(self) -> Dict[str, Row]:
        """Returns how long actions have taken lately, in seconds; of all by the empty name."""
        return {name: {"seconds": round(seconds, 3)} for name, seconds in self._means.items()}

    def planned(self, most: int) -> Row:
        """Returns the plan ahead, with how far each action is.

        Args:
            most: How many actions are named.
        """
        acting = {(one.actuator, one.action) for one in self._doing().values()}
        held = {(actuator, action): why for actuator, action, why in self.decisions.held}
        rows = []
        for step, actuator, action in self.plan.actions[:most]:
            state = "planned"
            if step <= self.plan.step:
                if (actuator, action) in held:
                    state = "held"
                elif (actuator, action) in acting:
                    state = "acts"
                elif self._is_done(step, actuator, action):
                    state = "done"
            rows.append([step, actuator, action, state])
        more = max(0, len(self.plan.actions) - most)
        times = [[one.actuator, one.name, one.begins, one.ends] for one in self.plan.times.actions]
        return {
            "step": self.plan.step, "horizon": self.plan.horizon, "actions": rows, "more": more,
            "times": times[:most],
        }  # fmt: skip

    def rows(self, searching: bool) -> Dict[str, Row]:
        """Returns a row for each actuator that is known.

        Args:
            searching: Whether the loop is at work, and does not wait.
        """
        names = {one.actuator for one in self._tokens}
        names |= {one.actuator for one in self._run.last.values()}
        names |= {one.actuator for one in self.plan.actions}
        names |= {actuator for actuator, _, _ in self.decisions.held} | set(self.decisions.on_hold)
        names -= {SOLVER}
        doing = self._doing()
        return {name: self._row(name, doing, searching) for name in sorted(names)}

    def _doing(self) -> Dict[str, TokenRow]:
        return {one.actuator: one for one in self._tokens if one.is_open}

    def _is_done(self, step: int, actuator: str, action: str) -> bool:
        last = self._run.last_of(actuator)
        if last is None or last.ended is None or last.number <= self._begun:
            return False
        return (last.step, last.name) == (step, action)

    def _row(self, name: str, doing: Mapping[str, TokenRow], searching: bool) -> Row:
        last = self._run.last_of(name)
        act = doing.get(name)
        row: Dict[str, Any] = {
            "action": "", "since": None, "step": None, "on_hold": name in self.decisions.on_hold,
            "held": "", "token": 0, "rejected": self._rejected(name), "next": self._next(name, act),
            "doubt": self._doubts.get(name, ""),
            "last": last.name if last and last.ended else "",
            "answer": last.answer if last and last.ended else "",
        }  # fmt: skip
        if act is not None:
            begun = last is not None and last.ended is None and last.name == act.action
            since = last.began if last is not None and begun else None
            row.update(action=act.action, step=act.step, since=since)
            row["progress"] = self._progress.get(act.number)
            row["state"] = "stops" if act.is_aborted else "acts"
            row["waits"] = "is to stop, and then to answer" if act.is_aborted else ""
            return row
        tokens = chain(self.decisions.tokens, repeat(0))
        for (actuator, action, reason), token in zip(self.decisions.held, tokens):
            if actuator == name:
                row.update(held=action, token=token, state=reason)
                row["waits"] = _WAITS_FOR.get(reason, reason)
                return row
        if row["on_hold"] and row["next"]:
            row.update(state="hold", waits=_WAITS_FOR["hold"])
        elif self.decisions.paused and row["next"]:
            row.update(state="pause", waits=_WAITS_FOR["pause"])
        elif row["next"] and doing:
            who = ", ".join(f"{one.actuator} has done {one.action}" for one in doing.values())
            row.update(state="others", waits=f"until {who}")
        elif row["next"]:
            row.update(state="begins", waits="for its step to begin")
        elif row["on_hold"]:
            more = "for a plan" if searching else "nothing is planned for it"
            row.update(state="hold", waits=f"{_WAITS_FOR['hold']}; {more}")
        elif row["doubt"] and row["answer"] in self._leaves_out.get(name, ()):
            row.update(state="lost", waits=f"until it is told where it is: {INFO}:at({name},PLACE)")
        elif searching:
            row.update(state="plan", waits="for a plan")
        else:
            row.update(state="idle", waits="nothing is planned for it")
        return row

    def _rejected(self, name: str) -> str:
        """Returns the rejected action of an actuator, and the planned one instead, in words."""
        rows = [(what, instead) for who, what, instead in self.decisions.rejected if who == name]
        planned = [(what, "".join(split_term(instead)[1][1:2])) for what, instead in rows]
        return ", ".join(f"{what} was rejected, planned: {then or '-'}" for what, then in planned)

    def _next(self, name: str, act: Optional[TokenRow]) -> List[Any]:
        """Returns step and action of what an actuator is to do after what it does now."""
        for step, actuator, action in self.plan.actions:
            if actuator != name or step < self.plan.step:
                continue
            is_begun = step == self.plan.step and self._has_begun(name, action, act)
            goes_on = act is not None and action == act.action
            if not is_begun and not goes_on:
                return [step, action]
        return []

    def _has_begun(self, name: str, action: str, act: Optional[TokenRow]) -> bool:
        return (act is not None and act.action == action) or self._is_done(
            self.plan.step, name, action
        )


def _left_out_after(answers: Sequence[str]) -> FrozenSet[str]:
    """Returns the answers that make planning leave an actuator out, of those that are declared."""
    found = {one for one in (UNKNOWN, TIMEOUT) if one in answers}
    if UNKNOWN in answers and LOST not in answers:  # as which it is told
        found.add(LOST)
    return frozenset(found)


_WAITS_FOR = {
    "approval": "until somebody approves it",
    "hold": "until it is released",
    "pause": "until the run is resumed",
    "retry": "until it is tried again",
    "rejected": "until something changes, or for a time: it was rejected",
    "cancel": "for the plan without the goal that is cancelled",
}
