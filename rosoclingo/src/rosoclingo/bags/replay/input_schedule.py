"""When the loop of a replay is to take the inputs: as recorded. Needs no ROS."""

from __future__ import annotations

from typing import Dict, List, Sequence, Set, Tuple

from rosclingo.errors import TermError
from rosclingo.wire.commands import Result
from rosoclingo.bags.compare.outputs import INPUTS, recalls, slot, without_shutdown
from rosoclingo.bags.model import Entry
from rosoclingo.bags.replay.inputs import begins_a_wait, input_key
from rosoclingo.loop.atoms import canonical
from rosoclingo.loop.journal import Event
from rosoclingo.loop.replay_inbox import Due, Phase


def input_schedule(entries: Sequence[Entry]) -> List[Due]:
    """Returns the inputs that the loop has taken, and when, in its order.

    Args:
        entries: A journal as it was recorded.
    """
    entries = without_shutdown(entries)
    recalled = recalls(entries)
    found: List[Due] = []
    moment = (0, Phase.BEFORE)
    decision = step = 0
    waits = acts = False  # the command that is carried out
    ended: Set[str] = set()  # goals whose cancel requests actionlib does not pass on any more
    undecided: Dict[str, int] = {}  # the goals since the last output: how many dues come before
    for entry, result in zip(entries, _results(entries)):
        event = entry.event
        if event.kind == "command":
            decision, step = decision + 1, event.step
            waits = acts = False
        elif begins_a_wait(event):
            waits = True
        elif entry.number in recalled:
            if event.id in undecided:  # the loop has taken the goal, and nothing had come of it
                place = undecided[event.id]
                found.insert(place, Due(*found[place].moment, "recall", event.id))
                undecided = {goal: n + (n >= place) for goal, n in undecided.items()}
                continue
            if waits:
                moment = max(moment, (decision, Phase.WAIT))
            else:  # not before what the command has done already, as to move to the next step
                has_begun = acts or event.step != step
                moment = max(moment, (decision + has_begun, Phase.BEFORE))
            found.append(Due(*moment, "recall", event.id))
        elif event.kind == "action" or (event.kind == "status" and slot(event)):
            acts = True
        if event.kind == "status" and event.text != "accepted" and entry.number not in recalled:
            ended.add(event.id)
        is_late = event.kind == "cancel" and event.id in ended
        if event.kind in INPUTS and not is_late and not _is_refused(event):
            moment = max(moment, _moment(event, decision, waits, result))
            if event.kind == "goal":
                undecided[event.id] = len(found)
            found.append(Due(*moment, *input_key(event)))
        elif event.kind not in INPUTS:
            undecided.clear()
    return found


def _moment(event: Event, decision: int, waits: bool, result: str) -> Tuple[int, Phase]:
    """Returns when an input was taken.

    Args:
        event: The input.
        decision: How many commands were carried out before.
        waits: Whether the loop has waited since the last one.
        result: That of the command which is carried out next, or just then.
    """
    if waits:
        return decision, Phase.WAIT
    if not event.seconds:
        return decision, Phase.BEFORE
    if result in (Result.SAT.value, Result.UNSAT.value):
        # It has not ended the search, and the loop knew of it at the next decision.
        return decision + 1, Phase.BEFORE
    return decision, Phase.DURING


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
