"""Model of a planning system: reads its messages, and returns tables and lines to show.

The journal says what was done; ``~plan``, ``~dispatch``, ``~held`` and the feedback say how it is.
"""

from __future__ import annotations

from collections import deque
from itertools import islice
from typing import Any, Deque, Dict, List, Optional, Sequence, Tuple

from rosclingo.wire.term_text import split_term
from rosoclingo.bags.holds import HoldHistory, OperatorDecisions
from rosoclingo.bags.run_model import RunModel
from rosoclingo.encodings.known import KnownEncoding
from rosoclingo.loop import journal
from rosoclingo.loop.journal import Entry, Status
from rosoclingo.loop.words import INFO
from rosoclingo_console.model.actuators import ActuatorTable
from rosoclingo_console.model.beliefs import BeliefTable
from rosoclingo_console.model.board import Board, Row
from rosoclingo_console.model.goals import GoalTable
from rosoclingo_console.model.map import MapTable
from rosoclingo_console.model.messages import MessageTable
from rosoclingo_console.model.metrics import Counters, Sample, counted
from rosoclingo_console.model.sentences import tell
from rosoclingo_console.model.values import PlanAhead

_MOST_LINES = 300  # of the journal
_MOST_NEW_LINES = 50  # in one message to a page
_MOST_PLANNED = 300  # actions
_MOST_HOLDS = 100  # times in which an operator held something
_MOST_REMEMBERED = 1000  # actions and messages; one is dropped soon after it has come
_MOST_KNOWN = 2000  # requests, and messages, that are offered
_DIGITS = 3  # of seconds
_BESIDE = (journal.ControlArrived, journal.Explained)  # which alone end no wait of the loop


class SystemModel:
    """Model of a planning system. Not thread-safe.

    Attributes:
        run: What its journal says of goals, actions and messages; the last ones of each.
        goals: The goals, as rows.
        actuators: The actuators, as rows.
        messages: What has become of messages.
    """

    def __init__(self) -> None:
        self._board = Board()
        self._lines: Deque[Row] = deque(maxlen=_MOST_LINES)
        self._new_lines: Deque[Row] = deque(maxlen=_MOST_NEW_LINES)
        self._believed: Dict[int, journal.BeliefsChanged] = {}  # by the numbers of their lines
        self._is_new_run = True
        self._map = MapTable()
        self._holds = HoldHistory(_MOST_HOLDS)
        self._known: Row = {"requests": [], "messages": []}
        self._encoding = KnownEncoding()
        self._recording = ""
        self._connected = False
        self._since = 0.0
        self._begin()

    def _begin(self) -> None:
        """Forgets the run before."""
        self.run = RunModel(_MOST_REMEMBERED)
        self.goals = GoalTable(self.run)
        self.actuators = ActuatorTable(self.run)
        self.actuators.set_encoding(self._encoding)
        self.messages = MessageTable(self.run)
        self._beliefs = BeliefTable()
        self._beliefs.set_phrases(self._encoding.phrases)
        self._counters = Counters()
        self._last: Optional[Entry] = None
        self._works = False
        self._placed: Dict[str, Tuple[str, str]] = {}  # by messages that are not told yet
        self._missed = 0
        self._quality = ""

    # What is heard.

    def connect(self, is_connected: bool, time: float) -> None:
        """There is a connection from the planning node, or none any more.

        Args:
            is_connected: Whether there is.
            time: Since when, in seconds of wall time.
        """
        if is_connected != self._connected:
            self._connected, self._since = is_connected, time

    def hear(self, record: Entry) -> None:
        """Takes an event of the journal; one that was heard before is ignored.

        A number that came before, with a later time, is that of a new run.
        """
        last = self._last
        if last is not None and record.number <= last.number:
            if record.seconds <= last.seconds:
                return
            if not isinstance(record.event, journal.NodeResumed):
                self._forget_run()
        elif last is not None:
            self._missed += record.number - last.number - 1
        self._last = record
        self._counters.count(record.event)
        self._follow(record)
        kind, text = tell(record.event, self.run.goals, self._encoding.phrases)
        line = {
            "number": record.number, "time": round(record.seconds, _DIGITS), "step": record.step,
            "kind": kind, "text": text,
        }  # fmt: skip
        if isinstance(record.event, journal.BeliefsChanged):
            self._believed[record.number] = record.event
        if len(self._lines) == _MOST_LINES:
            self._believed.pop(self._lines[0]["number"], None)
        self._lines.append(line)
        self._new_lines.append(line)

    def _forget_run(self) -> None:
        plan, decisions = self.actuators.plan, self.actuators.decisions
        self._begin()
        self._map.forget_run()
        # They are latched, and may have come before the journal.
        self.actuators.plan, self.actuators.decisions = plan, decisions
        self._lines.clear()
        self._believed.clear()
        self._new_lines.clear()
        self._is_new_run = True

    def _follow(self, record: Entry) -> None:
        event, time = record.event, record.seconds
        self._map.hear(event)
        action = self.run.apply(record)
        self.goals.hear(event)
        self.actuators.hear(event, action)
        self.messages.hear(event, time)
        if not isinstance(event, _BESIDE):
            self._works = not isinstance(event, (journal.LoopWaits, journal.LoopEnded))
        if isinstance(event, journal.MessageArrived):
            self._place(event)
        elif isinstance(event, journal.MessageDropped):
            for value, doubt in self._placed.items():
                if event.reason.startswith(journal.naming(INFO, value)):
                    self.actuators.doubt(*doubt)
        elif isinstance(event, journal.CommandDone) and event.name == "assign_messages":
            self._placed.clear()
        elif isinstance(event, journal.BeliefsChanged):
            self._beliefs.change(event.terms, round(time, _DIGITS), record.step)

    def _place(self, event: journal.MessageArrived) -> None:
        """Takes a message such as ``info:at(robot,c3)``, which says where a robot is."""
        name, arguments = split_term(event.value) if event.source == INFO else ("", [])
        if name == "at" and len(arguments) == 2:
            action = self.actuators.place(arguments[0])
            if action:
                self._placed[event.value] = arguments[0], action

    def set_plan(self, step: int, horizon: int, atoms: Sequence[str]) -> None:
        """Takes a message of ``~plan``."""
        self.actuators.plan = PlanAhead.read(step, horizon, atoms)
        self._map.set_plan(atoms)

    def decide(self, decisions: OperatorDecisions, time: float) -> None:
        """Takes a message of ``~held``, which came at a time in seconds of wall time."""
        self.actuators.decisions = decisions
        self._holds.add(time, decisions)

    def set_quality(self, quality: str) -> None:
        """Sets the plan's cost, in words."""
        self._quality = quality

    def set_encoding(self, encoding: KnownEncoding) -> None:
        """Takes what the planner's encoding says."""
        self._known = {
            "requests": list(encoding.requests[:_MOST_KNOWN]),
            "messages": list(encoding.messages[:_MOST_KNOWN]),
        }
        self._map.set_graph(encoding.graph)
        before, self._encoding = self._encoding, encoding
        self.actuators.set_encoding(encoding)
        if before.phrases != encoding.phrases:
            self._beliefs.set_phrases(encoding.phrases)
            self._tell_beliefs_again()

    def _tell_beliefs_again(self) -> None:
        """Tells the lines about beliefs in other words; pages get all lines again."""
        for place, line in enumerate(self._lines):
            event = self._believed.get(line["number"])
            if event is not None:
                text = tell(event, self.run.goals, self._encoding.phrases)[1]
                self._lines[place] = {**line, "text": text}
                self._is_new_run = True

    def set_recording(self, file: str) -> None:
        """It is recorded in a bag; an empty text if it is not."""
        self._recording = file

    def tell_goal(self, identifier: str, line: str) -> None:
        """Takes a line of feedback for a goal."""
        self.goals.tell(identifier, line)

    # What is shown.

    def changes(self) -> Dict[str, Any]:
        """Returns what has changed since the last call; empty if nothing has."""
        self._update()
        lines = list(self._new_lines)
        self._new_lines.clear()
        is_new_run, self._is_new_run = self._is_new_run, False
        tables = self._board.take_changes()
        if is_new_run:
            return self.snapshot()
        found: Dict[str, Any] = {}
        if tables:
            found["tables"] = tables
        if lines:
            found["lines"] = lines
        return found

    def snapshot(self) -> Dict[str, Any]:
        """Returns all that :meth:`changes` has returned so far."""
        shown = len(self._lines) - len(self._new_lines)
        lines = list(islice(self._lines, shown))
        return {"all": True, "tables": self._board.all(), "lines": lines}

    def _update(self) -> None:
        actuators, goals = self.actuators, self.goals
        self._board.replace("run", {"run": self._run()})
        self._board.replace("goals", goals.rows(actuators.plan.times))
        self._board.replace("actuators", actuators.rows(self._works))
        self._board.replace("plan", {"plan": actuators.planned(_MOST_PLANNED)})
        self._board.replace("bars", actuators.bars())
        self._board.replace("holds", {str(one.began): vars(one) for one in self._holds.spans})
        self._board.replace("means", actuators.means())
        self._board.replace("beliefs", self._beliefs.rows)
        self._board.replace("known", {"known": self._known})
        self._board.replace("map", self._map.rows())

    def _run(self) -> Row:
        last, open_goals = self._last, self.goals.open
        state = "unknown"
        if last is not None:
            state = "ended" if self.run.end else "works" if self._works else "waits"
        return {
            "connected": self._connected,
            "since": round(self._since, _DIGITS),
            "state": state,
            "reason": self.run.end or "",
            "stopped": self._stopped(),
            "step": last.step if last else 0,
            "horizon": last.horizon if last else 0,
            "paused": self.actuators.decisions.paused,
            "open": len(open_goals),
            "waiting": sum(not goal.slot for goal in open_goals),
            "missed": self._missed,
            "dropped": self.messages.last_dropped,
            "quality": self._quality,
            "recording": self._recording,
        }

    def _stopped(self) -> Optional[float]:
        """Returns since when nothing is heard, or will be; None while the run goes on."""
        times = [self.run.ended] if self.run.end else []
        if not self._connected and self._since:
            times.append(self._since)
        return round(min(times), _DIGITS) if times else None

    def samples(self) -> List[Sample]:
        """Returns the values of metrics."""
        run, actuators = self._run(), self.actuators
        ends = {status.value: self.goals.counts.get(status, 0) for status in Status}
        ends = {status: count for status, count in ends.items() if count}
        return [
            Sample("rosoclingo_up", run["connected"]),
            Sample("rosoclingo_paused", run["paused"]),
            Sample("rosoclingo_step", run["step"]),
            Sample("rosoclingo_horizon", run["horizon"]),
            Sample("rosoclingo_goals_open", run["open"]),
            Sample("rosoclingo_goals_waiting", run["waiting"]),
            Sample("rosoclingo_actions_open", actuators.count_open()),
            Sample("rosoclingo_actions_held", len(actuators.decisions.held)),
            Sample("rosoclingo_events_missed_total", run["missed"]),
            *counted("rosoclingo_goals_total", "status", ends),
            *counted("rosoclingo_answers_total", "answer", actuators.answers),
            *self._counters.samples(),
        ]
