"""Validates ids of slots, actuators and sources of messages.

The loop, ``plan.py`` and ``check.py`` ask here and nowhere else (docs/protocol.md, section "Ids").

>>> why_no_actuator("save", slots=["1", "2"])
'save is the id of an actuator, and stands for what held at a reset; give it another id'
>>> why_no_actuator("2", slots=["1", "2"])
"2 is the id of an actuator, and that of a goal's slot, rslot(2); give it another id"
>>> split_event("info:open(3)")
('info', 'open(3)')
"""

from __future__ import annotations

import re
from typing import Collection, Optional, Tuple

from rosclingo.errors import shorten
from rosclingo.wire.term_text import split_term
from rosoclingo.loop.words import CLOCK, INFO, INTERRUPTED, PASSED, QUEUE, SOLVER, TRIES

RESERVED = {
    "commit": "stands for what was published",
    "save": "stands for what held at a reset",
    INFO: "stands for what nobody has to answer for",
    QUEUE: "stands for what gets a slot first",
    SOLVER: "stands for whole plans on ~out",
}
"""The ids that no slot and no actuator may have, with what each is for."""

GOAL, CANCEL = "goal", "cancel"
"""The words before the colon of a goal and of a cancel request; a message has its source there."""

_OWN = (
    (QUEUE, "first", 1),
    (INFO, PASSED, 0),
    (INFO, INTERRUPTED, 0),
    (INFO, TRIES, 2),
    (INFO, CLOCK, 1),
)

_EVENT = re.compile(r'((?:"(?:[^"\\]|\\.)*"|[^":])*):(.*)', re.DOTALL)


def why_no_slot(term: str) -> Optional[str]:
    """Says why a term, as clingo prints it, cannot be the id of a slot; None if it can."""
    what = RESERVED.get(term)
    return None if what is None else f"{term} is the id of a slot, and {what}; give it another id"


def why_no_actuator(term: str, slots: Collection[str]) -> Optional[str]:
    """Says why a term cannot be the id of an actuator; None if it can.

    Args:
        term: The term, as clingo prints it.
        slots: The ids of slots: a goal's request could not be told from an answer.
    """
    what = RESERVED.get(term)
    if term in slots:
        what = f"that of a goal's slot, {shorten(f'rslot({term})')}"
    if what is None:
        return None
    return f"{shorten(term)} is the id of an actuator, and {what}; give it another id"


def why_no_message(source: str, content: str, slots: Collection[str]) -> Optional[str]:
    """Says why an event may not come as a message; None if it may.

    Args:
        source: The source, as clingo prints it.
        content: Its content, as clingo prints it.
        slots: The ids of slots.
    """
    if source in slots:
        return "the id is a goal's slot, and goals are changed by the action only"
    return "these are rosoclingo's own" if is_own(source, content) else None


def is_own(source: str, content: str) -> bool:
    """Tells if an event is reserved for rosoclingo itself."""
    name, arguments = split_term(content)
    return source in ("commit", "save") or (source, name, len(arguments)) in _OWN


def split_event(text: str) -> Optional[Tuple[str, str]]:
    """Splits ``SOURCE:VALUE``, as a user types it, at the first colon that is in no string.

    The words ``goal`` and ``cancel`` before it stand for requests. Who means the source of a
    message that is called so puts it into brackets: ``(goal):VALUE``.

    Returns:
        The two, as they were typed; None if there is no such colon.
    """
    match = _EVENT.fullmatch(text)
    return None if match is None else (match[1].strip(), match[2].strip())


def type_event(source: str, content: str) -> str:
    """Formats a message as a user types it; the inverse of :func:`split_event`."""
    return f"({source}):{content}" if source in (GOAL, CANCEL) else f"{source}:{content}"
