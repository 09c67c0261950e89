"""When the loop of a replay is to take the inputs: as recorded. Needs no ROS."""

from __future__ import annotations

from typing import List, Sequence, Set

from rosclingo.engine import Result
from rosclingo.errors import TermError
from rosoclingo.atoms import canonical
from rosoclingo.bags.inputs import input_key
from rosoclingo.bags.model import Entry
from rosoclingo.bags.outputs import INPUTS, recalls, without_shutdown
from rosoclingo.gate import Due, Phase
from rosoclingo.journal import Event


def dues(entries: Sequence[Entry]) -> List[Due]:
    """Returns the inputs that the loop has taken, and when, in its order.

    Args:
        entries: A journal as it was recorded.
    """
    entries = without_shutdown(entries)
    recalled = recalls(entries)
    found: List[Due] = []
    moment = (0, Phase.BEFORE)
    decision = 0
    waits = False
    ended: Set[str] = set()  # goals whose cancel requests actionlib does not pass on any more
    for entry, result in zip(entries, _results(entries)):
        event = entry.event
        if event.kind == "command":
            decision, waits = decision + 1, False
        elif event.kind == "waiting":
            waits = True
        elif entry.number in recalled:
            moment = max(moment, (decision, Phase.WAIT if waits else Phase.BEFORE))
            found.append(Due(*moment, "recall", event.id))
        elif event.kind == "status" and event.text != "accepted":
            ended.add(event.id)
        elif event.kind in INPUTS and event.id not in ended and not _is_refused(event):
            if event.seconds and not waits and result in (Result.SAT.value, Result.UNSAT.value):
                # The search has ended nevertheless: the loop knew of it at the next decision.
                moment = max(moment, (decision + 1, Phase.BEFORE))
            elif event.seconds or waits:
                is_search = not waits and result == Result.UNKNOWN.value
                phase = Phase.SEARCH if is_search else Phase.WAIT
                moment = max(moment, (decision, phase))
            else:
                moment = max(moment, (decision, Phase.BEFORE))
            found.append(Due(*moment, *input_key(event)))
    return found


def _results(entries: Sequence[Entry]) -> List[str]:
    """Returns for each entry the result of the command that is carried out, if it is a search."""
    results: List[str] = []
    result = ""
    for entry in reversed(entries):
        if entry.event.kind == "command":
            result = entry.event.id
        results.append(result)
    return results[::-1]


def _is_refused(event: Event) -> bool:
    """Whether a goal was rejected before it came to the loop."""
    if event.kind != "goal":
        return False
    try:
        canonical(event.text)
    except TermError:
        return True
    return False
