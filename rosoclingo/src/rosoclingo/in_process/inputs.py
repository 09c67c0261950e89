"""Parses the inputs of a simulation and the moments at which they come, as a user types them.

>>> read_input("goal:bring(o2,o3)", "4")
Input(kind='goal', value='bring(o2,o3)', moment=Moment(kind='step', number=4), source='')
>>> read_input("info: blocked(c3,c4)", "in:17").moment
Moment(kind='in', number=17)
"""

from __future__ import annotations

from dataclasses import dataclass

from rosclingo.errors import OptionsError, TermError, shorten
from rosclingo.wire.term_text import number
from rosoclingo.loop.values.atoms import canonical
from rosoclingo.loop.values.ids import CANCEL, GOAL, split_event, type_event

MESSAGE = "message"
STEP, IN, AFTER = "step", "in", "after"


@dataclass(frozen=True)
class Moment:
    """The moment at which an input comes.

    Attributes:
        kind: ``step``, as soon as the loop waits in a step; ``in``, while it carries out a command;
            or ``after``, between a command and the next decision.
        number: Which step or command, both counted from the beginning; a reset counts on.
    """

    kind: str = STEP
    number: int = 0

    def __str__(self) -> str:
        return str(self.number) if self.kind == STEP else f"{self.kind}:{self.number}"


@dataclass(frozen=True)
class Input:
    """An input of a simulation: a goal, a cancel request or a message.

    Attributes:
        kind: ``goal``, ``cancel`` or ``message``.
        value: The request, the number of a goal, from 1, or the message's value.
        moment: When it comes; in the beginning, by default.
        source: That of a message.
    """

    kind: str
    value: str
    moment: Moment = Moment()
    source: str = ""

    def __str__(self) -> str:
        if self.kind == MESSAGE:
            return type_event(self.source, self.value)
        return f"{self.kind}:{self.value}"


def read_input(text: str, when: str = "0") -> Input:
    """Reads ``goal:REQUEST``, ``cancel:NUMBER`` or ``SOURCE:VALUE``; see :func:`.split_event`.

    Args:
        text: What comes.
        when: When it comes: a step, ``in:COMMAND`` or ``after:COMMAND``.

    Raises:
        OptionsError: One of the two is none of these.
    """
    parts = split_event(text)
    if parts is None:
        raise OptionsError(
            f"{shorten(text)!r}: expected goal:REQUEST, cancel:NUMBER or SOURCE:VALUE, such as "
            "'info:blocked(c3,c4)'"
        )
    source, value = parts
    moment = _moment(when)
    if source == CANCEL:
        goal = number(value)
        if goal is None or goal < 1:
            raise OptionsError(
                f"{shorten(text)!r}: expected the number of a goal, from 1 on; a message of a "
                f"source with this name is {shorten(type_event(CANCEL, value))!r}"
            )
        return Input(source, str(goal), moment)
    try:
        if source == GOAL:
            return Input(GOAL, canonical(value), moment)
        return Input(MESSAGE, canonical(value), moment, canonical(source))
    except TermError as err:
        raise OptionsError(f"{shorten(text)!r}: {err}") from err


def _moment(when: str) -> Moment:
    kind, colon, count = when.rpartition(":")
    value = number(count)
    if (kind in (IN, AFTER) or not colon) and value is not None and value >= 0:
        return Moment(kind or STEP, value)
    raise OptionsError(
        f"{shorten(when)!r}: expected when it comes: a step, in:COMMAND or after:COMMAND, such as "
        "4, in:17 or after:17"
    )
