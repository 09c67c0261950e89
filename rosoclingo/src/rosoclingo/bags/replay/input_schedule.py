"""Schedules the inputs of a replayed loop as they were recorded. Needs no ROS."""

from __future__ import annotations

from typing import Dict, List, Optional, Sequence, Set, Tuple

from rosclingo.wire.commands import Result
from rosoclingo.bags.read.run import Run
from rosoclingo.bags.replay.inputs import begins_a_wait, is_refused
from rosoclingo.loop import journal
from rosoclingo.loop.inputs.replay_inbox import Phase, ScheduledInput, ScheduledKind
from rosoclingo.loop.journal import Entry
from rosoclingo.loop.values.recorded import reading

_BETWEEN = (journal.MessageDropped, journal.ActionTook, journal.ClockRead)  # a goal and its accept


def input_schedule(
    run: Run, *, kills: bool = False, same_encodings: bool = True
) -> List[ScheduledInput]:
    """Returns the schedule of the inputs that the loop has taken, in its order; then the rest.

    That are the outcomes of searches, and what clocks measured.

    Args:
        run: The run.
        kills: Whether nodes that have died are among them.
        same_encodings: Whether they are for the encodings that were recorded.
    """
    found: List[ScheduledInput] = []
    moment, decision, step = (0, Phase.BEFORE), 0, 0
    let_go = _let_go(run.recorded)
    phase: Optional[Phase] = None  # if the loop waits, or has ended
    acts = False  # the command that is carried out
    ended: Set[str] = set()  # goals whose cancel requests actionlib does not pass on any more
    undecided: Dict[str, int] = {}  # the goals since the last output: how many dues come before
    for entry, result in zip(run.recorded, _results(run.recorded)):
        event = entry.event
        phase = _phase(event, phase)
        if isinstance(event, journal.CommandDone):
            decision, step = decision + 1, entry.step
            acts = False
        elif isinstance(event, journal.NodeResumed):
            if event.node == journal.LOOP:
                # A new process decides again; what the old one took in its wait, it has.
                found = [_before(due, decision) for due in found]
                moment = min(moment, (decision, Phase.BEFORE))
                acts = False
            if kills:
                kill = ScheduledInput(decision, Phase.BEFORE, ScheduledKind.KILL, event.node)
                found.insert(sum(due.moment <= kill.moment for due in found), kill)
        elif isinstance(event, journal.StatusSet) and entry.number in run.recalls:
            if event.goal in undecided:  # the loop has taken the goal, and nothing had come of it
                place = undecided[event.goal]
                found.insert(
                    place, ScheduledInput(*found[place].moment, ScheduledKind.RECALL, event.goal)
                )
                undecided = {goal: n + (n >= place) for goal, n in undecided.items()}
                continue
            if phase is not None:
                moment = max(moment, (decision, phase))
            else:  # not before what the command has done already, as to move to the next step
                has_begun = acts or entry.step != step
                moment = max(moment, (decision + has_begun, Phase.BEFORE))
            found.append(ScheduledInput(*moment, ScheduledKind.RECALL, event.goal))
        elif isinstance(event, journal.StatusSet):
            acts |= bool(event.slot)
            if event.status is not journal.Status.ACCEPTED:
                ended.add(event.goal)
        elif isinstance(event, journal.ActionPublished):
            acts |= entry.number not in let_go
        if isinstance(event, journal.StatusSet) and not event.slot:
            undecided.pop(event.goal, None)  # not those that came with it
        elif not isinstance(event, (*journal.ARRIVALS, *_BETWEEN)):
            undecided.clear()
        if isinstance(event, journal.ARRIVALS) and not (
            (isinstance(event, journal.CancelArrived) and event.goal in ended) or is_refused(event)
        ):
            moment = max(moment, _moment(event, decision, phase, result))
            if isinstance(event, journal.GoalArrived):
                undecided[event.goal] = len(found)
            kind, identifier, text = journal.key_of(event)
            found.append(ScheduledInput(*moment, ScheduledKind(kind), identifier, text))
    found = found if phase is not Phase.END else [_at_the_end(due, decision) for due in found]
    return found + _outcomes(run.recorded, kills, same_encodings)


def _let_go(entries: Sequence[Entry]) -> Set[int]:
    """Returns the numbers of actions that an operator released, which belong to no command."""
    found: Set[int] = set()
    is_let_go = False
    for entry in entries:
        event = entry.event
        is_action = isinstance(event, journal.ActionPublished)
        is_recall = isinstance(event, journal.StatusSet) and not event.slot  # by another thread
        is_request = isinstance(event, journal.ControlArrived) or (
            isinstance(event, journal.NodeResumed) and event.node == journal.LOOP
        )
        is_let_go = is_request or (is_let_go and (is_action or is_recall))
        if is_let_go and is_action:
            found.add(entry.number)
    return found


def rest(dues: Sequence[ScheduledInput], decision: int) -> List[ScheduledInput]:
    """Returns the rest of a schedule for a node that restarts before a decision."""
    return [
        due._replace(decision=due.decision - decision) for due in dues if due.decision >= decision
    ]


def take(dues: List[ScheduledInput], event: journal.Event) -> None:
    """Removes from a schedule the input or search of which an event says that it is over.

    What a loop has taken is in its store, and does not come again when the node is started again.

    Args:
        dues: The schedule; is changed.
        event: The event, of the replayed journal.
    """
    if isinstance(event, journal.ARRIVALS):
        key = journal.key_of(event)
    elif isinstance(event, journal.StatusSet) and event.reason is journal.Reason.RECALLED:
        key = ScheduledKind.RECALL, event.goal, ""
    elif isinstance(event, journal.SearchEnded):
        key = ScheduledKind.SEARCH, "", journal.to_text(event)
    else:
        return
    number = next((n for n, due in enumerate(dues) if (due.kind, due.id, due.text) == key), None)
    if number is not None:
        del dues[number]


def _outcomes(entries: Sequence[Entry], kills: bool, same_encodings: bool) -> List[ScheduledInput]:
    """Returns the outcomes of time-dependent searches, if the journal has them, and durations.

    Searches that were finished are left out if the program is not the same: it may have other
    plans. Those for better plans in a wait in which the loop was killed come before the decision to
    wait, as its inputs do.
    """
    found: List[ScheduledInput] = []
    knows_searches = False  # older journals do not tell
    decision = 0
    for event in (entry.event for entry in entries):
        if isinstance(event, journal.CommandDone):
            decision += 1
        elif isinstance(event, journal.SearchEnded):
            knows_searches = True
            if same_encodings or event.how not in journal.PROGRAMS_OWN:
                found.append(
                    ScheduledInput(
                        decision, Phase.DURING, ScheduledKind.SEARCH, "", journal.to_text(event)
                    )
                )
        elif kills and isinstance(event, journal.NodeResumed) and event.node == journal.LOOP:
            found = [_early(due, decision) for due in found]
        elif isinstance(event, journal.PlanFound):
            knows_searches |= event.quality is not None
        elif isinstance(event, journal.ActionTook):
            number, seconds = str(event.number), repr(event.seconds)
            found.append(ScheduledInput(decision, Phase.WAIT, ScheduledKind.TIME, number, seconds))
        elif isinstance(event, journal.ClockRead):
            name, seconds = reading(event.number), repr(event.seconds)
            found.append(ScheduledInput(decision, Phase.WAIT, ScheduledKind.TIME, name, seconds))
    if knows_searches:
        found.append(ScheduledInput(decision + 1, Phase.WAIT, ScheduledKind.SEARCH, ""))
    return found


def _moment(
    event: journal.Arrival, decision: int, phase: Optional[Phase], result: Optional[Result]
) -> Tuple[int, Phase]:
    """Returns when an input was taken.

    Args:
        event: The input.
        decision: How many commands were carried out before.
        phase: Whether the loop has waited or ended since the last one; None for neither.
        result: That of the command which is carried out next, or just then.
    """
    if phase is not None:
        return decision, phase
    if not event.seconds:
        return decision, Phase.BEFORE
    if result in (Result.SAT, Result.UNSAT):
        # It has not ended the search, and the loop knew of it at the next decision.
        return decision + 1, Phase.BEFORE
    return decision, Phase.DURING


def _before(due: ScheduledInput, decision: int) -> ScheduledInput:
    """Reschedules an input that was taken in a wait to the moment before the decision to wait."""
    return due._replace(phase=Phase.BEFORE) if due.decision == decision else due


def _early(due: ScheduledInput, decision: int) -> ScheduledInput:
    """Moves a search for a better plan before the decision to wait in which the loop was killed."""
    if due.decision != decision or due.kind is not ScheduledKind.SEARCH:
        return due
    ended = journal.from_text(due.text)
    is_better = isinstance(ended, journal.SearchEnded) and ended.how in journal.IMPROVING
    return due._replace(phase=Phase.BEFORE) if is_better else due


def _phase(event: journal.Event, before: Optional[Phase]) -> Optional[Phase]:
    """Returns the phase after an event: wait or end; None while the loop is at work."""
    if isinstance(event, journal.LoopEnded):
        return Phase.END
    if begins_a_wait(event):
        return Phase.WAIT
    is_loop = isinstance(event, journal.NodeResumed) and event.node == journal.LOOP
    return None if is_loop or isinstance(event, journal.CommandDone) else before


def _at_the_end(due: ScheduledInput, decision: int) -> ScheduledInput:
    """Reschedules an input that was taken after the last decision to the loop's end."""
    is_late = due.decision > decision
    return due._replace(decision=decision, phase=Phase.END) if is_late else due


def _results(entries: Sequence[Entry]) -> List[Optional[Result]]:
    """Returns for each entry the result of the command that is carried out, if it is a search."""
    results: List[Optional[Result]] = []
    result = None
    for entry in reversed(entries):
        if isinstance(entry.event, journal.CommandDone):
            result = entry.event.result
        results.append(result)
    return results[::-1]
