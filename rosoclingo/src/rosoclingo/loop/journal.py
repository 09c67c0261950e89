"""The journal: the events of the planning loop, and their encoding as messages. Needs no ROS.

A class for each kind of event; on the wire all are a ``ROSoClingoEvent``, whose fields mean
something else for each kind. Only :func:`encode` and :func:`decode` know how.

>>> encode(ActionPublished("robot", "go(3)"))[:3]
('action', 'robot', 'go(3)')
>>> decode(encode(ActionPublished("robot", "go(3)")))
ActionPublished(actuator='robot', action='go(3)')
"""

from __future__ import annotations

import enum
import json
from dataclasses import dataclass
from typing import Any, Callable, Mapping, NamedTuple, Optional, Tuple, Union

from rosclingo.errors import shorten
from rosclingo.wire.commands import Result
from rosclingo.wire.term_text import last_number
from rosoclingo.loop.quality import Quality


class Status(str, enum.Enum):
    """A goal's status; its value is the word in plans and on the wire."""

    PENDING = "pending"  # which is in no plan, and not on the wire
    ACCEPTED = "accepted"
    REJECTED = "rejected"
    SUCCEEDED = "succeeded"
    CANCELED = "canceled"
    ABORTED = "aborted"

    __str__ = str.__str__

    @property
    def is_terminal(self) -> bool:
        """True if a goal with this status has ended."""
        return self in TERMINAL_STATUSES


TERMINAL_STATUSES = frozenset(Status) - {Status.PENDING, Status.ACCEPTED}
STATUSES = TERMINAL_STATUSES | {Status.ACCEPTED}
"""The statuses that a plan may say of a goal."""


class Reason(str, enum.Enum):
    """Machine-readable reasons in the journal; all other reasons are text for people."""

    SHUTDOWN = "the node is shutting down"  # the process was told to end
    RECALLED = "recalled before it had a slot"  # the goal was canceled without the planner

    __str__ = str.__str__

    @classmethod
    def of(cls, text: str) -> str:
        """Returns the reason with a text, or the text itself if it is another one."""
        return next((reason for reason in cls if reason.value == text), text)


class Event:
    """Something that the loop has learned or done."""


@dataclass(frozen=True)
class GoalArrived(Event):
    """The loop has taken a goal from the inbox.

    Attributes:
        goal: That of actionlib.
        request: The request.
        information: What came with it.
        seconds: If it was taken while a command was carried out, how long that had taken by then,
            in seconds of wall time; else 0.
    """

    goal: str
    request: str
    information: Tuple[str, ...] = ()
    seconds: float = 0.0


@dataclass(frozen=True)
class CancelArrived(Event):
    """The loop has taken a cancel request; ``seconds`` as in :class:`GoalArrived`."""

    goal: str
    seconds: float = 0.0


@dataclass(frozen=True)
class MessageArrived(Event):
    """The loop has taken a message, as it came; ``seconds`` as in :class:`GoalArrived`.

    Attributes:
        source: Where it comes from.
        value: What it says.
        sender: The node that has sent it; empty if that is not known, as in the journal.
    """

    source: str
    value: str
    seconds: float = 0.0
    sender: str = ""


class Control(str, enum.Enum):
    """Kinds of an operator's requests; the value is the word on the wire."""

    PAUSE = "pause"  # no further action is dispatched
    HALT = "halt"  # a pause that also aborts the executed actions
    STEP = "step"  # pauses after the next actions
    RESUME = "resume"
    HOLD = "hold"  # no further action of one actuator is dispatched
    RELEASE = "release"
    APPROVE = "approve"  # an action that needs an approval
    REJECT = "reject"  # an action that waits: it counts as failed
    RETRY = "retry"  # one that has failed, after a pause
    ASK = "ask"  # for the approval of one that was rejected, once more

    __str__ = str.__str__


OWN_CONTROLS = frozenset({Control.RETRY, Control.ASK})
"""The requests that the loop makes itself, when some time is over."""


@dataclass(frozen=True)
class ControlArrived(Event):
    """The loop has taken an operator's request; ``seconds`` as in :class:`GoalArrived`.

    Attributes:
        control: What is wanted.
        actuator: Of which actuator; empty for all.
        action: Of which of its actions; empty for any. The journal has the one that was meant.
        token: The number of that action while it is held; 0 for any. In the journal as well.
        refused: Why it has changed nothing; only in the journal, and empty if it has.
    """

    control: Control
    actuator: str = ""
    seconds: float = 0.0
    action: str = ""
    token: int = 0
    refused: str = ""

    @property
    def words(self) -> str:
        """The request in words, such as ``approve robot(2) go(3)``."""
        said = " ".join(filter(None, (self.control, self.actuator, self.action)))
        return f"{said} (refused: {self.refused})" if self.refused else said


class ControlOutcome(NamedTuple):
    """The outcome of an operator's request.

    Attributes:
        is_done: Whether it has changed, or will change, what was asked for.
        text: What follows from it; or why it was refused.
    """

    is_done: bool
    text: str


Arrival = Union[GoalArrived, CancelArrived, MessageArrived, ControlArrived]
ARRIVALS = (GoalArrived, CancelArrived, MessageArrived, ControlArrived)
"""What comes from outside, as the loop takes it."""


@dataclass(frozen=True)
class AnswerArrived(Event):
    """An answer has come with the token of its action, see :mod:`rosoclingo.loop.execution.tokens`.

    The loop takes it as a message, as which it is in the journal.

    Attributes:
        run: The id of the run.
        number: The action's number in it.
        value: What was answered.
        sender: The node that has sent it; empty if that is not known.
    """

    run: str
    number: int
    value: str
    sender: str = ""


@dataclass(frozen=True)
class MessageDropped(Event):
    """A message was dropped; most reasons begin with :func:`naming` of it."""

    reason: str


def naming(source: str, value: str) -> str:
    """Returns the words for a message with which the reason begins why it is dropped."""
    return f"id {shorten(source)}, value {shorten(value)}: "


@dataclass(frozen=True)
class CommandDone(Event):
    """A command of the controller was carried out.

    Readers of the journal find here what they need to know of commands.

    Attributes:
        command: The command, as clingo prints it.
        result: That of the search, if it was one that came to its end or was interrupted.
        seconds: How long it took, in seconds of wall time.
    """

    command: str
    result: Optional[Result] = None
    seconds: float = 0.0

    @property
    def name(self) -> str:
        """The command without its arguments."""
        return self.command.partition("(")[0]

    @property
    def is_search(self) -> bool:
        """True if it searches for a plan, be it for another horizon or not."""
        return self.name in ("solve", "plan")

    @property
    def waits(self) -> bool:
        """True if the loop may have waited in it, which is no work."""
        return self.name == "idle"

    @property
    def resets(self) -> bool:
        """Tells if it was a reset, which waits for the answers of its step if the mode has not."""
        return self.name in ("reset", "forget")

    @property
    def resets_to(self) -> Optional[int]:
        """The step that it has made number 0; None if it is no reset."""
        return last_number(self.command) if self.resets else None

    @property
    def publishes(self) -> bool:
        """True if it has published the whole plan, after which a static mode is through."""
        return self.name == "publish"


@dataclass(frozen=True)
class PlanFound(Event):
    """A plan was found.

    Attributes:
        actions: Its actions from the current step on, as ``do(Actuator,Action,Step)``.
        is_best: Whether the search was through, and did not end because of ``~patience``.
        quality: What it costs; None if its encoding minimises nothing, or if that is not known.
    """

    actions: Tuple[str, ...]
    is_best: bool = True
    quality: Optional[Quality] = None


@dataclass(frozen=True)
class BeliefsChanged(Event):
    """The causes that are believed of what was observed have changed, with the plan before this.

    Attributes:
        terms: The terms by which the planner's encoding shows beliefs, in order, for
            :meth:`.Beliefs.read`; none if nothing is believed any more.
    """

    terms: Tuple[str, ...]


class Ended(str, enum.Enum):
    """How a search has ended whose outcome depends on the machine's speed, as with ``~patience``.

    Its value is the word on the wire.
    """

    FINISHED = "finished"  # by itself; which of several answer sets it finds is the solver's choice
    CUT = "the best so far"  # by ~patience
    CALLED = "interrupted"  # by an input, when the planner had been told of the search already
    BETTER = "better"  # it has looked for a better plan, and found one
    AS_BEFORE = "as before"  # it has found none in its time, or that there is none
    CHOSEN = "chosen"  # a better plan, which the next search completes after an input
    NOTHING = "nothing"  # it could not compute the current cost of the plan
    AHEAD = "ahead"  # it has searched several horizons in turn, see LOOKING_AHEAD
    AHEAD_CALLED = "ahead, interrupted"  # the same, until an input came
    AHEAD_REFUTED = "ahead, no plan"  # the same, and no horizon has a plan
    REFUTED = "no plan"  # there is none, and it may be searched again with more choices
    FOUND = "found"  # by the search for the task's first plan, whose parts are asked for
    LAYERED = "layers"  # it has found out how many layers there are to be, and what they grant


IMPROVING = (Ended.BETTER, Ended.AS_BEFORE, Ended.CHOSEN, Ended.NOTHING)
"""How a search for a better plan ends."""

LOOKING_AHEAD = (Ended.AHEAD, Ended.AHEAD_CALLED, Ended.AHEAD_REFUTED)
"""How a search ends that has not gone on with one horizon after the other."""

PROGRAMS_OWN = (Ended.FINISHED, Ended.FOUND, Ended.LAYERED)
"""How a search ends that says something of its program alone, and nothing of another one."""


@dataclass(frozen=True)
class SearchEnded(Event):
    """The outcome of a search that depends on time or chance, recorded for replays.

    If the planner has several threads, or with ``~patience``, those are all that have found a plan:
    what is found depends also on what the solver has learned in searches that time has ended.

    Attributes:
        how: How it has ended.
        symbols: The answer set that was taken; that of the plan as it was, if none is better.
        quality: What that costs.
        round: How many answer sets have asked for something before, in the same search.
        horizon: That of the plan, if several horizons were searched in turn.
        grounded: The last step, or layer, that was grounded for that.
        granted: How many wishes the layers of the plan grant.
        missing: How many it does not grant, though nothing excludes a plan that does.
    """

    how: Ended
    symbols: Tuple[str, ...] = ()
    quality: Optional[Quality] = None
    round: int = 0
    horizon: int = 0
    grounded: int = 0
    granted: int = 0
    missing: int = 0


@dataclass(frozen=True)
class ActionPublished(Event):
    """An actuator was told to act."""

    actuator: str
    action: str


@dataclass(frozen=True)
class ActionWithdrawn(Event):
    """An action that was held is planned no more, since a goal was cancelled."""

    actuator: str
    action: str


@dataclass(frozen=True)
class ActionRetried(Event):
    """An action has failed and will be tried again, as its policy says; the planner hears nothing.

    Attributes:
        actuator: Who does it.
        action: The action.
        retry: Which retry it will be, from 1.
        answer: How it has failed.
    """

    actuator: str
    action: str
    retry: int
    answer: str


@dataclass(frozen=True)
class ActionTook(Event):
    """The measured duration of an action, recorded for replays.

    Attributes:
        actuator: Who has done it.
        kind: What its encoding calls such actions.
        number: The action's number in the run, that of its token.
        seconds: How long it took, in seconds of ROS's time.
    """

    actuator: str
    kind: str
    number: int
    seconds: float


@dataclass(frozen=True)
class ClockRead(Event):
    """The time that the planner was told, recorded for replays.

    Attributes:
        number: The reading's number in the run.
        seconds: Seconds of ROS's time since the first reading.
    """

    number: int
    seconds: float


@dataclass(frozen=True)
class StatusSet(Event):
    """A goal's status has changed: as the journal, the goal's client and the store have it.

    Attributes:
        goal: That of actionlib.
        status: The status.
        slot: The planner's id for the goal; empty if it has none.
        reason: Why, which may be a :class:`Reason`; that of an accepted goal is not on the wire.
    """

    goal: str
    status: Status
    slot: str = ""
    reason: str = ""


@dataclass(frozen=True)
class LoopWaits(Event):
    """The loop waits for something to come.

    Attributes:
        for_a_replay: Whether it would not wait, but waited for nothing when it was recorded.
    """

    for_a_replay: bool = False


@dataclass(frozen=True)
class Explained(Event):
    """A question was answered, without any change to the run.

    Attributes:
        question: The question, such as ``goal visit(3)``.
        text: The answer, in sentences.
        structure: The answer as JSON, with its atoms and plans.
        seconds: How long it took, in seconds of wall time.
    """

    question: str
    text: str
    structure: str = ""
    seconds: float = 0.0


@dataclass(frozen=True)
class NodeResumed(Event):
    """A node that had died or was ended was replaced, and the run goes on.

    All events before it hold, and none of them comes again.

    Attributes:
        node: What it is: :data:`LOOP`, ``controller`` or ``planner``.
        reason: With what error a solver was lost; empty for the loop, which knows of none.
        seconds: In seconds of wall time: how long a solver was missed, or how long the loop took
            until it was what it had been.
    """

    node: str
    reason: str = ""
    seconds: float = 0.0


LOOP = "rosoclingo"
"""What the node with the planning loop is called in :class:`NodeResumed`, whatever its name."""


@dataclass(frozen=True)
class LoopEnded(Event):
    """The loop has ended; goals that were open get their last statuses after that.

    Attributes:
        reason: Why, which may be a :class:`Reason`.
        from_outside: Whether the cause is none that the journal has, such as a solver that is gone.
    """

    reason: str
    from_outside: bool = False

    @property
    def is_forced(self) -> bool:
        """True if a replay cannot repeat this end, since its cause is outside of the run."""
        return self.from_outside or self.reason is Reason.SHUTDOWN


class Fields(NamedTuple):
    """The fields of a ``ROSoClingoEvent`` that say what happened; explained there."""

    kind: str
    id: str = ""
    text: str = ""
    details: Tuple[str, ...] = ()
    seconds: float = 0.0


@dataclass(frozen=True)
class Unknown(Event):
    """An event of a kind that this version does not know, such as that of a newer one."""

    fields: Fields


@dataclass(frozen=True)
class Record:
    """A journal record: an event, with the loop's step and horizon."""

    event: Event
    step: int = 0
    horizon: int = 0


@dataclass(frozen=True)
class Entry(Record):
    """A journal record with its sequence number and timestamp.

    Attributes:
        number: Its number in the run, from 1.
        seconds: When it happened, in seconds of wall time; in a recording since that began, and
            negative for what was published before.
    """

    number: int = 1
    seconds: float = 0.0


_BEST_SO_FAR = "the best so far"  # what a plan is whose search was cut off
_FOR_A_REPLAY = "for the replay"
_FROM_OUTSIDE = "from outside"

_ENCODERS: Mapping[type, Callable[[Any], Fields]] = {
    GoalArrived: lambda e: Fields("goal", e.goal, e.request, e.information, e.seconds),
    CancelArrived: lambda e: Fields("cancel", e.goal, seconds=e.seconds),
    MessageArrived: lambda e: Fields(
        "message", e.source, e.value, (e.sender,) if e.sender else (), e.seconds
    ),
    ControlArrived: lambda e: Fields(
        "control", e.actuator, e.control.value,
        (e.action, str(e.token), e.refused) if e.action or e.token or e.refused else (), e.seconds,
    ),
    AnswerArrived: lambda e: Fields("answer", e.run, e.value, (str(e.number), e.sender)),
    MessageDropped: lambda e: Fields("dropped", text=e.reason),
    CommandDone: lambda e: Fields(
        "command", e.result.value if e.result else "", e.command, seconds=e.seconds
    ),
    PlanFound: lambda e: Fields(
        "plan", _text(e.quality), "" if e.is_best else _BEST_SO_FAR, e.actions
    ),
    BeliefsChanged: lambda e: Fields("belief", details=e.terms),
    SearchEnded: lambda e: Fields(
        "search", _text(e.quality), e.how.value, (_numbers(e), *e.symbols)
    ),
    ActionPublished: lambda e: Fields("action", e.actuator, e.action),
    ActionWithdrawn: lambda e: Fields("withdrawn", e.actuator, e.action),
    ActionRetried: lambda e: Fields("retry", e.actuator, e.action, (str(e.retry), e.answer)),
    ActionTook: lambda e: Fields("took", e.actuator, e.kind, (str(e.number),), e.seconds),
    ClockRead: lambda e: Fields("clock", str(e.number), seconds=e.seconds),
    StatusSet: lambda e: Fields(
        "status", e.goal, e.status.value,
        (e.slot,) if e.status is Status.ACCEPTED else (e.slot, str(e.reason)),
    ),
    LoopWaits: lambda e: Fields("waiting", text=_FOR_A_REPLAY if e.for_a_replay else ""),
    Explained: lambda e: Fields("why", e.question, e.text, (e.structure,), e.seconds),
    NodeResumed: lambda e: Fields("resumed", e.node, e.reason, seconds=e.seconds),
    LoopEnded: lambda e: Fields("end", _FROM_OUTSIDE if e.from_outside else "", str(e.reason)),
    Unknown: lambda e: e.fields,
}  # fmt: skip

_DECODERS: Mapping[str, Callable[[Fields], Event]] = {
    "goal": lambda f: GoalArrived(f.id, f.text, f.details, f.seconds),
    "cancel": lambda f: CancelArrived(f.id, f.seconds),
    "message": lambda f: MessageArrived(f.id, f.text, f.seconds, "".join(f.details[:1])),
    "control": lambda f: ControlArrived(
        Control(f.text),
        f.id,
        f.seconds,
        "".join(f.details[:1]),
        int("".join(f.details[1:2]) or 0),
        "".join(f.details[2:3]),
    ),
    "answer": lambda f: AnswerArrived(
        f.id, int("".join(f.details[:1])), f.text, "".join(f.details[1:2])
    ),
    "dropped": lambda f: MessageDropped(f.text),
    "command": lambda f: CommandDone(f.text, Result(f.id) if f.id else None, f.seconds),
    "plan": lambda f: PlanFound(f.details, f.text != _BEST_SO_FAR, _quality(f.id)),
    "belief": lambda f: BeliefsChanged(f.details),
    "search": lambda f: SearchEnded(
        Ended(f.text), f.details[1:], _quality(f.id), *map(int, "".join(f.details[:1]).split())
    ),
    "action": lambda f: ActionPublished(f.id, f.text),
    "withdrawn": lambda f: ActionWithdrawn(f.id, f.text),
    "retry": lambda f: ActionRetried(
        f.id, f.text, int("".join(f.details[:1])), "".join(f.details[1:2])
    ),
    "took": lambda f: ActionTook(f.id, f.text, int("".join(f.details[:1])), f.seconds),
    "clock": lambda f: ClockRead(int(f.id), f.seconds),
    "status": lambda f: StatusSet(f.id, Status(f.text), *_slot_and_reason(*f.details)),
    "waiting": lambda f: LoopWaits(f.text == _FOR_A_REPLAY),
    "why": lambda f: Explained(f.id, f.text, "".join(f.details[:1]), f.seconds),
    "resumed": lambda f: NodeResumed(f.id, f.text, f.seconds),
    "end": lambda f: LoopEnded(Reason.of(f.text), f.id == _FROM_OUTSIDE),
}


def encode(event: Event) -> Fields:
    """Returns what a ``ROSoClingoEvent`` says of an event."""
    return _ENCODERS[type(event)](event)


def decode(message: Any) -> Event:
    """Returns the event that a ``ROSoClingoEvent`` tells, be it of rospy or of a bag.

    One of an unknown kind, with a word for a status or a result that is unknown, or with more
    numbers than there can be, is an :class:`Unknown`; what is missing is empty.
    """
    fields = Fields(
        message.kind, message.id, message.text, tuple(map(str, message.details)),
        float(message.seconds),
    )  # fmt: skip
    try:
        return _DECODERS[fields.kind](fields)
    except (KeyError, TypeError, ValueError):
        return Unknown(fields)


def key_of(event: Event) -> Tuple[str, str, str]:
    """Returns what identifies an input, whenever it is taken: kind, id, and what it says.

    A goal and its cancel request say nothing more than their ids.
    """
    fields = encode(event)
    says = isinstance(event, (MessageArrived, ControlArrived))
    return fields.kind, fields.id, fields.text if says else ""


def to_text(event: Event) -> str:
    """Encodes an event as text, for :func:`from_text`."""
    return json.dumps(encode(event))


def from_text(text: str) -> Event:
    """Decodes the text of an event.

    Raises:
        TypeError, ValueError: It is something else.
    """
    try:
        return decode(Fields(*json.loads(text)))
    except (OverflowError, RecursionError) as err:  # a huge number, or deep nesting
        raise ValueError(f"no event: {err}") from err


def _text(quality: Optional[Quality]) -> str:
    return "" if quality is None else str(quality)


def _numbers(event: SearchEnded) -> str:
    numbers = [event.round]
    if event.how in LOOKING_AHEAD or event.how is Ended.LAYERED or event.missing:
        numbers += [event.horizon, event.grounded]
    if event.how is Ended.LAYERED or event.missing:
        numbers.append(event.granted)
    if event.missing:
        numbers.append(event.missing)
    return " ".join(map(str, numbers))


def _quality(text: str) -> Optional[Quality]:
    return Quality.read(text) if text else None


def _slot_and_reason(slot: str = "", reason: str = "", *_: str) -> Tuple[str, str]:
    return slot, Reason.of(reason)
