"""Describes the transactions and goals that a store has lost.

>>> loss = Loss(5, 7, "its log is gone", summarize({"g1": "visit(3)", "g2": "visit(4)"}))
>>> for part in describe(loss, {"g2": "visit(4)"}).split("; "):
...     print(part)
its log is gone: of 7 transactions, the last 2 are missing
open goals that are lost: visit(3) (g1)
"""

from __future__ import annotations

import dataclasses
from itertools import islice
from typing import Any, Dict, Mapping

from rosclingo.errors import shorten

_MOST_NAMED = 10  # goals of which it is known that they were open
_MOST_CHARACTERS = 100  # of each, in its id and in its request


@dataclasses.dataclass(frozen=True)
class Loss:
    """Acknowledged transactions that are in neither the file nor its log.

    Attributes:
        number: The number of the last transaction that is there.
        acknowledged: That of the last one that was acknowledged.
        log: What is wrong with the log, as a main clause.
        details: What :func:`summarize` has returned for the last one; None if that is lost, too.
    """

    number: int
    acknowledged: int
    log: str
    details: Any


def summarize(is_open: Dict[str, str]) -> Any:
    """Returns a summary of open goals that survives their loss, as JSON knows it.

    Args:
        is_open: Their requests by their ids, the newest last.
    """
    named = {
        key: shorten(is_open[key], _MOST_CHARACTERS)
        for key in islice(reversed(is_open), _MOST_NAMED)
        if len(key) <= _MOST_CHARACTERS
    }
    return [named, len(is_open) - len(named)]


def describe(loss: Loss, is_open: Mapping[str, str]) -> str:
    """Returns the message about lost transactions and goals, as far as these are known.

    Args:
        loss: The loss.
        is_open: The goals that are there and have not ended: their requests by their ids.
    """
    missing = loss.acknowledged - loss.number
    parts = [f"{loss.log}: of {loss.acknowledged} transactions, the last {missing} are missing"]
    if loss.details is None:
        return f"{parts[0]}; which goals are lost is not known"
    was_open, others = loss.details
    lost = [f"{text} ({key})" for key, text in was_open.items() if key not in is_open]
    again = [f"{text} ({key})" for key, text in is_open.items() if key not in was_open]
    if lost:
        parts.append(f"open goals that are lost: {', '.join(lost)}")
    if others:
        parts.append(f"{others} more goals were open, some of which may be lost, too")
    elif again:
        parts.append(f"goals that had ended, and are open again: {', '.join(again)}")
    return "; ".join(parts)
