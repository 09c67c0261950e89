"""Replays inputs at the very points of the loop at which they were taken in the recording.

What a run does depends on when the loop takes what comes: before which decision, or in which
command. That is up to chance while the loop is busy, so a replay would go another way now and then.
"""

from __future__ import annotations

import enum
import itertools
import json
from collections import Counter, deque
from typing import Callable, Deque, Dict, List, NamedTuple, Optional, Sequence, Tuple

from rosclingo.errors import ParameterError
from rosoclingo.loop.inputs.inbox import Cancel, Inbox, Item, Taken, arrival_of
from rosoclingo.loop.journal import AnswerArrived, SearchEnded, from_text, key_of
from rosoclingo.loop.values.recorded import Recorded


class Phase(enum.IntEnum):
    """When an input is taken, relative to a decision of the controller."""

    BEFORE = 0  # the decision
    DURING = 1  # the command that was decided, which does not begin before it has come
    WAIT = 2  # while the loop waited, which was decided
    END = 3  # when the loop had ended instead of another decision


class ScheduledKind(str, enum.Enum):
    """Kinds of scheduled inputs, and of other events that a replay has to repeat."""

    GOAL = "goal"
    CANCEL = "cancel"
    MESSAGE = "message"
    CONTROL = "control"  # an operator's request
    RECALL = "recall"  # of a goal without a slot, by a cancel request that is taken later
    KILL = "kill"  # no input: a node is to be killed, and the loop waits for that
    SEARCH = "search"  # no input: how a search ends that depends on time
    TIME = "time"  # no input: how long an action took


InputKey = Tuple[str, str, str]
"""What identifies an input, see :func:`.key_of`."""


class ScheduledInput(NamedTuple):
    """A scheduled input: what a replay's loop takes, and when.

    Attributes:
        decision: How many decisions were carried out before.
        phase: When, seen from the next decision.
        kind: What it was.
        id: That of the goal, message or actuator; what is to be killed, as :class:`.NodeResumed`
            has it; of a search, nothing; of an action's time, the number of its token.
        text: What a message or an operator says; how a search ends, see :func:`.from_text`, or
            nothing, which says that all of them are known; how long an action took, in seconds;
            else empty.
    """

    decision: int
    phase: Phase
    kind: ScheduledKind
    id: str
    text: str = ""

    @property
    def moment(self) -> Tuple[int, Phase]:
        """The point at which it is taken: the number of decisions before it, and the phase."""
        return self.decision, self.phase

    @property
    def key(self) -> InputKey:
        """The key of the input that has to have arrived."""
        return (
            ScheduledKind.CANCEL if self.kind is ScheduledKind.RECALL else self.kind,
            self.id,
            self.text,
        )


def _read_search(text: str) -> SearchEnded:
    """Decodes how a search ends.

    Raises:
        TypeError, ValueError: The text is something else.
    """
    event = from_text(text)
    if not isinstance(event, SearchEnded):
        raise ValueError(f"{text} is no search")
    return event


def encode(dues: Sequence[ScheduledInput]) -> str:
    """Encodes a schedule as text, for :func:`decode`."""
    return json.dumps(dues, separators=(",", ":"))


def decode(text: object) -> List[ScheduledInput]:
    """Reads the value of the parameter ``~replay``.

    Raises:
        ParameterError: It is something else than what :func:`encode` writes.
    """
    try:
        if not isinstance(text, str):
            raise TypeError("no text")
        dues = [
            ScheduledInput(int(decision), Phase(phase), ScheduledKind(kind), str(name), str(value))
            for decision, phase, kind, name, value in json.loads(text)
        ]
        for due in dues:
            if due.kind is ScheduledKind.SEARCH and due.text:
                _read_search(due.text)
            if due.kind is ScheduledKind.TIME:
                float(due.text)
        return dues
    except (TypeError, ValueError, OverflowError, RecursionError) as err:
        raise ParameterError(
            f"parameter ~replay: not what replay.py writes ({err}); only replay.py sets it"
        ) from err


class ReplayInbox(Inbox):
    """An inbox that holds each input until it is due, and has the loop wait for missing ones.

    Thread-safe. What it does not know of is let through.
    """

    def __init__(self, dues: Sequence[ScheduledInput]) -> None:
        """Begins before the first decision.

        Args:
            dues: What will come, in the order in which the loop is to take it.
        """
        super().__init__()
        searches = [due for due in dues if due.kind is ScheduledKind.SEARCH]
        self.recorded = Recorded(
            [(due.decision, _read_search(due.text)) for due in searches if due.text],
            {due.id: float(due.text) for due in dues if due.kind is ScheduledKind.TIME},
            knows_searches=bool(searches),
            early=[due.decision for due in searches if due.phase is Phase.BEFORE],
        )
        others = (ScheduledKind.SEARCH, ScheduledKind.TIME)
        self._dues: Deque[ScheduledInput] = deque(due for due in dues if due.kind not in others)
        self._expected = Counter(due.key for due in dues if due.kind in _INPUTS)
        self._kills = sum(due.kind is ScheduledKind.KILL for due in dues)
        self._held: Dict[InputKey, Deque[Taken]] = {}  # has come, and is not taken yet
        self._moment = -1, Phase.WAIT
        self._missing: Counter[InputKey] = Counter()  # is due, and has not come
        self._is_open = False

    def add(self, item: Item) -> None:
        """Adds an item; returns at once. A replay's answers are those of the recording."""
        if isinstance(item, AnswerArrived):
            return
        key = key_of(arrival_of(item))
        with self._changed:
            if not self._is_open and self._expected[key] > 0:
                self._expected[key] -= 1
                self._held.setdefault(key, deque()).append(item)
                self._missing[key] -= 1
                if self._missing[key] <= 0:
                    del self._missing[key]
                self._changed.notify_all()
                return
        super().add(item)

    def recalls_at_once(self, item: Cancel) -> bool:
        """Returns whether a cancel request recalls a goal now; else that is due later."""
        with self._changed:
            return self._is_open or self._expected[key_of(arrival_of(item))] <= 0

    @property
    def may_hold(self) -> bool:
        """True if the loop may leave inputs in the inbox, as after :meth:`open`."""
        return self._is_open

    def go_on(self) -> None:
        """Ends the wait for a node that is to be killed: it is."""
        with self._changed:
            kill = self._next_kill()
            if kill is not None:
                self._dues.remove(kill)
                self._kills -= 1
                self._changed.notify_all()

    def open(self) -> None:
        """Lets everything through from now on: the replay goes another way."""
        with self._changed:
            self._is_open = True
            dues = (due for due in self._dues if due.kind in _INPUTS)
            rest = [self._held[due.key].popleft() for due in dues if self._has(due)]
            self._dues.clear()
            self.recorded.forget()
            self._kills = 0
            self._missing.clear()
        for item in rest:
            if isinstance(item, Cancel):
                item.goal.recall()
            super().add(item)
        with self._changed:
            self._changed.notify_all()

    def end(self, reason: str) -> None:
        """Says that the loop has ended."""
        self.open()
        super().end(reason)

    def begin_decision(
        self, waits: Callable[[], None], take: Callable[[], None] = lambda: None
    ) -> None:
        """Waits until all has come that was taken before the next decision."""
        self._wait_until((self._moment[0] + 1, Phase.BEFORE), waits, take)

    def begin_command(
        self, waits: Callable[[], None], take: Callable[[], None] = lambda: None
    ) -> None:
        """Waits until all has come that the next command took, if it did not wait for that."""
        decision, _ = self._moment
        self._wait_until((decision, Phase.DURING), waits, take)
        self._moment = decision, Phase.WAIT

    def begin_end(self, waits: Callable[[], None]) -> None:
        """Waits until all inputs have come that the loop took after its end."""
        decision, _ = self._moment
        self._wait_until((max(decision, 0), Phase.END), waits)

    def _wait_until(
        self,
        moment: Tuple[int, Phase],
        waits: Callable[[], None],
        take: Optional[Callable[[], None]] = None,
    ) -> None:
        self._moment = moment
        self.recorded.decision = moment[0]

        def may_take() -> bool:
            has_due = self.recorded.is_early_due or self._has_due_control()
            return take is not None and has_due

        while True:
            with self._changed:
                self._missing = self._find_missing()
                is_kill_due, kills = self._next_kill() is not None, self._kills
                has_control = may_take()
            if take is not None and has_control:
                take()
                continue
            if self._missing:
                if not is_kill_due:
                    waits()
                with self._changed:
                    self._changed.wait_for(lambda: self._closed or not self._missing or may_take())
                    if not self._closed and may_take():
                        continue
            if not is_kill_due:
                return
            waits()  # all has come that is to come before
            with self._changed:
                self._changed.wait_for(
                    lambda before=kills: self._closed or self._kills < before  # type: ignore[misc]
                )
                if self._closed:
                    return

    def _next_kill(self) -> Optional[ScheduledInput]:
        due = itertools.takewhile(lambda due: due.moment <= self._moment, self._dues)
        return next((one for one in due if one.kind is ScheduledKind.KILL), None)

    def take(self, *, controls: bool = True) -> List[Item]:
        """Returns the due inputs; does not wait."""
        items = super().take(controls=controls)
        while True:
            with self._changed:
                due = self._next()
                if due is None or not (controls or due.kind is not ScheduledKind.CONTROL):
                    return items
                self._dues.popleft()
                held = self._held[due.key]
                item = held[0] if due.kind is ScheduledKind.RECALL else held.popleft()
                if not held:
                    del self._held[due.key]
            if due.kind is ScheduledKind.RECALL:
                assert isinstance(item, Cancel)
                item.goal.recall()  # not under the lock, which actionlib may wait for
            else:
                items.append(item)

    def _has_due_control(self) -> bool:
        """Tells if an operator's request is due, and has come with all that is due before it."""
        held = {key: len(items) for key, items in self._held.items()}
        for due in itertools.takewhile(lambda due: due.moment <= self._moment, self._dues):
            if held.get(due.key, 0) <= 0:
                return False
            if due.kind is ScheduledKind.CONTROL:
                return True
            held[due.key] -= due.kind is not ScheduledKind.RECALL
        return False

    def wait(self, timeout: float) -> bool:
        """Waits until something is due or the inbox is closed, as that of an inbox does."""
        with self._changed:
            return self._changed.wait_for(
                lambda: self._has_something() or self._next() is not None, timeout
            )

    def _next(self) -> Optional[ScheduledInput]:
        """Returns the next scheduled input if it is due and has arrived."""
        if self._dues and self._dues[0].moment <= self._moment and self._has(self._dues[0]):
            return self._dues[0]
        return None

    def _has(self, due: ScheduledInput) -> bool:
        return bool(self._held.get(due.key))

    def _find_missing(self) -> Counter[InputKey]:
        """Returns the inputs that are due before the next kill and have not arrived."""
        due = list(
            itertools.takewhile(
                lambda due: due.moment <= self._moment and due.kind is not ScheduledKind.KILL,
                self._dues,
            )
        )
        needed = Counter(one.key for one in due if one.kind is not ScheduledKind.RECALL)
        # The cancel request that recalls a goal comes once, and is taken later.
        needed |= Counter({one.key: 1 for one in due if one.kind is ScheduledKind.RECALL})
        return needed - Counter({key: len(self._held.get(key, ())) for key in needed})


_INPUTS = (
    ScheduledKind.GOAL, ScheduledKind.CANCEL, ScheduledKind.MESSAGE, ScheduledKind.CONTROL,
)  # fmt: skip
