"""Operations on systems: the port that carries them out, and requests for them in JSON."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Callable, Dict, Mapping, Optional, Tuple

from rosclingo.errors import RosclingoError, TermError
from rosoclingo.loop.journal import OWN_CONTROLS, Control
from rosoclingo.loop.values.atoms import canonical
from rosoclingo.loop.values.ids import split_event

_LONGEST = 10_000  # characters of a text
_CONTROLS = {one.value: one for one in Control if one not in OWN_CONTROLS}
_LARGEST = 1e9  # number
_MOST = 100  # texts of a list


class RequestError(RosclingoError):
    """A request of a page that is none; the message names the field."""


@dataclass(frozen=True)
class OperationReply:
    """Reply to a request for an operation.

    Attributes:
        done: Whether it was taken.
        text: What has become of it and how the system is now, or why it was not taken.
        goal: The id of a goal that was sent; empty for all else.
    """

    done: bool
    text: str
    goal: str = ""

    def as_json(self) -> Dict[str, Any]:
        """Returns the answer for the page."""
        return {"done": self.done, "text": self.text, **({"goal": self.goal} if self.goal else {})}


class Operations:
    """Port to the systems: carries out those operations whose methods a subclass overrides.

    Methods are called by several threads, may wait for seconds, and raise nothing.

    Attributes:
        refusal: The answer to a request for any other operation.
    """

    refusal = OperationReply(False, "this is no recorded run")

    def control(
        self, system: str, control: Control, actuator: str, action: str, token: int
    ) -> OperationReply:
        """Has an operator's request carried out, see docs/protocol.md, section "Control"."""
        return self.refusal

    def send_goal(self, system: str, request: str, information: Tuple[str, ...]) -> OperationReply:
        """Sends a goal, and waits for a while until it is accepted, queued or rejected."""
        return self.refusal

    def send_message(self, system: str, source: str, value: str) -> OperationReply:
        """Sends a message, both of whose parts are terms as clingo prints them."""
        return self.refusal

    def cancel(self, system: str, goal: str) -> OperationReply:
        """Sends a cancel request for an open goal, whoever has sent it."""
        return self.refusal

    def ask(self, system: str, question: str, arguments: Tuple[str, ...]) -> OperationReply:
        """Asks why, see docs/protocol.md, section "Questions"."""
        return self.refusal

    def record(self, system: str, is_on: bool) -> OperationReply:
        """Starts or ends a recording."""
        return self.refusal

    def play(self, plays: bool, position: float, speed: float) -> OperationReply:
        """Plays a recorded run from a time on, in seconds, so fast; or stops there."""
        return self.refusal

    def about(self) -> Optional[Mapping[str, Any]]:
        """Returns the data of a recording for pages; None if it is none."""
        return None


Call = Callable[[Operations], OperationReply]
"""A request that was read."""


class Body:
    """The JSON object of a request, whose fields are read one by one."""

    def __init__(self, value: Any, systems: Tuple[str, ...]) -> None:
        """Takes the object.

        Args:
            value: What was sent.
            systems: The names of the systems.

        Raises:
            RequestError: It is no object.
        """
        if not isinstance(value, dict):
            raise RequestError("expected a JSON object")
        self._value: Mapping[str, Any] = value
        self._systems = systems

    def text(self, name: str, default: str = "") -> str:
        """Returns a text.

        Raises:
            RequestError: It is something else.
        """
        return _text(name, self._value.get(name, default))

    def flag(self, name: str) -> bool:
        """Returns true or false.

        Raises:
            RequestError: It is something else.
        """
        value = self._value.get(name)
        if not isinstance(value, bool):
            raise RequestError(f"{name}: expected true or false")
        return value

    def number(self, name: str) -> float:
        """Returns a finite number.

        Raises:
            RequestError: It is something else.
        """
        value = self._value.get(name)
        is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
        if not is_number or not abs(value or 0) < _LARGEST:
            raise RequestError(f"{name}: expected a number")
        return float(value or 0)

    def token(self, name: str) -> int:
        """Returns the token of an action; 0 if it is left out, for any.

        Raises:
            RequestError: It is something else.
        """
        value = self._value.get(name, 0)
        if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value < 2**32:
            raise RequestError(f"{name}: expected the token of an action, as the page shows it")
        return value

    def texts(self, name: str) -> Tuple[str, ...]:
        """Returns a list of texts.

        Raises:
            RequestError: It is something else.
        """
        value = self._value.get(name, [])
        if not isinstance(value, list) or len(value) > _MOST:
            raise RequestError(f"{name}: expected a list of at most {_MOST} texts")
        return tuple(_text(name, one) for one in value)

    @property
    def system(self) -> str:
        """The system that is meant.

        Raises:
            RequestError: There is none of this name.
        """
        name = self.text("system")
        if name not in self._systems:
            raise RequestError(f"system: there are {', '.join(self._systems)}")
        return name


def _control(body: Body) -> Call:
    system, actuator, action = body.system, body.text("actuator"), body.text("action")
    token = body.token("token")
    control = _CONTROLS.get(body.text("control"))
    if control is None:
        raise RequestError(f"control: expected {', '.join(_CONTROLS)}")
    return lambda operations: operations.control(system, control, actuator, action, token)


def _goal(body: Body) -> Call:
    system, request, information = body.system, body.text("request"), body.texts("information")
    if not request.strip():
        raise RequestError("request: it is empty")
    return lambda operations: operations.send_goal(system, request, information)


def _message(body: Body) -> Call:
    system, parts = body.system, split_event(body.text("message"))
    if parts is None:
        raise RequestError("message: expected SOURCE:VALUE, such as info:blocked(c3,c4)")
    try:
        source, value = map(canonical, parts)
    except TermError as err:
        raise RequestError(f"message: {err}") from err
    return lambda operations: operations.send_message(system, source, value)


def _cancel(body: Body) -> Call:
    system, goal = body.system, body.text("goal")
    if not goal:  # actionlib takes it for all goals
        raise RequestError("goal: it is empty")
    return lambda operations: operations.cancel(system, goal)


def _why(body: Body) -> Call:
    system, question, arguments = body.system, body.text("question"), body.texts("arguments")
    return lambda operations: operations.ask(system, question, arguments)


def _record(body: Body) -> Call:
    system, is_on = body.system, body.flag("on")
    return lambda operations: operations.record(system, is_on)


def _play(body: Body) -> Call:
    plays, position, speed = body.flag("plays"), body.number("position"), body.number("speed")
    return lambda operations: operations.play(plays, position, speed)


READERS: Mapping[str, Callable[[Body], Call]] = {
    "control": _control,
    "goal": _goal,
    "message": _message,
    "cancel": _cancel,
    "why": _why,
    "record": _record,
    "play": _play,
}
"""Parsers of requests, by the kind in the address."""

HOLDS_BACK = "control"
"""The kind that has to get through whatever else is under way."""

ONLY_LOOKS = frozenset({"why", "play"})
"""The kinds that change nothing of a run, and so are there in the read-only mode, too."""


def _text(name: str, value: Any) -> str:
    if not isinstance(value, str) or len(value) > _LONGEST:
        raise RequestError(f"{name}: expected a text of at most {_LONGEST} characters")
    try:
        value.encode("utf-8")  # as ROS does
    except UnicodeEncodeError as err:
        raise RequestError(f"{name}: expected Unicode, without lone surrogates") from err
    return value
