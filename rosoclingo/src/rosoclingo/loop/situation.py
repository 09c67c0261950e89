"""The situation that a question is about: the planner's events and the loop's state."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Dict, Iterable, List, Optional, Tuple

from rosclingo.wire.commands import (
    AssignExternal,
    Command,
    Ground,
    Part,
    ReleaseExternal,
    Restart,
    Truth,
)
from rosclingo.wire.term_text import last_number, number, split_term
from rosoclingo.loop.beginning import known_to_hold
from rosoclingo.loop.state import State
from rosoclingo.loop.values.added import SLOT_PART
from rosoclingo.loop.values.atoms import SAVE, event, query

# Steps that a copy plans for if there is no limit, and if there is one that is far away.
_FEWEST, _MOST = 30, 100
_HISTORY = 20  # steps that a copy is told one by one


@dataclass(frozen=True)
class Situation:
    """The events and state from which a planner copy is made. Immutable and picklable.

    Attributes:
        told: The events that are true, as ``event(S,C,T)``, ordered by step.
        step: The current step.
        horizon: The step at which all is to be done, by the last search.
        last: The last step that a copy plans for.
        goals: Slot and request of each goal that is open.
        queued: The requests of goals without a slot, in order; the planner knows nothing of them.
        silent: The actuators that have not answered, and since how many seconds.
        ages: How many seconds ago goals have come, by slots.
        others: Other externals that the mode has made true.
        tells: Whether the encoding is told its events by grounding.
        is_limit: Whether the mode plans for no step after the last one.
        used: The slots of goals that have ended in the current step: others get them with the next.
        offset: How many of the loop's steps were left out: all steps here are counted from there.
    """

    told: Tuple[str, ...] = ()
    step: int = 0
    horizon: int = 0
    last: int = 0
    goals: Tuple[Tuple[str, str], ...] = ()
    queued: Tuple[str, ...] = ()
    silent: Tuple[Tuple[str, float], ...] = ()
    others: Tuple[str, ...] = ()
    tells: bool = False
    is_limit: bool = True
    used: Tuple[str, ...] = ()
    offset: int = 0
    ages: Tuple[Tuple[str, float], ...] = ()

    @classmethod
    def of(cls, state: State, last: Optional[int] = None) -> Situation:
        """Returns the situation of a loop; called by the loop's thread.

        A copy would take long to be told a long history. What it needs to know of that is what held
        in the end, as after a reset.

        Args:
            state: The loop's state.
            last: The last step that may be planned for; by default, the last one that is grounded.
        """
        externals, goals, now = state.externals, state.goals, state.environment.now()
        unplaced = [*goals.queued, *(g for g in state.mail.goals_spoken_of if g.slot is None)]
        situation = cls(
            told=tuple(externals.true),
            step=state.step,
            horizon=state.horizon,
            last=max([last or 0, state.step, state.horizon, *externals.grounded]),
            goals=tuple((goal.slot or "", goal.request) for goal in goals.open),
            queued=tuple(goal.request for goal in unplaced if not goal.ended),
            silent=tuple((one.actuator, now - one.began) for one in state.executions.silent),
            others=tuple(atom for atom in externals.kept if atom != query(state.horizon)),
            tells=state.planner.demand.tells,
            used=tuple(goals.used),
            ages=tuple(goals.ages(state.environment.world_now()).items()),
        )
        known = known_to_hold(state) if state.step > _HISTORY else None
        return situation if known is None else situation.since(*known)

    def since(self, step: int, fluents: Iterable[str]) -> Situation:
        """Returns the situation after a reset at a step.

        Args:
            step: The step, which is before the current one.
            fluents: What holds in it.
        """
        rest = (atom for atom in self.told if _is_since(atom, step))
        return replace(
            self,
            told=(
                *(event("save", fluent, 0) for fluent in fluents),
                *(moved(atom, -step) for atom in rest),
            ),
            step=self.step - step,
            horizon=max(0, self.horizon - step),
            last=max(0, self.last - step),
            offset=self.offset + step,
        )

    def up_to(self, limit: Optional[int]) -> Situation:
        """Returns the same situation with a last step for the copy's plans.

        Args:
            limit: The last step that the mode plans for; None if there is none, or if that is not
                known. A copy that would have to ground very many steps until then grounds fewer.
        """
        if limit is not None:
            limit -= self.offset
        if limit is None:
            last = max(2 * self.last, _FEWEST)
        elif self.tells:
            last = max(self.last, limit)
        else:
            last = max(self.last, min(limit, max(2 * self.last, _MOST)))
        return replace(self, last=last, is_limit=limit is not None and last >= limit)

    @classmethod
    def after(cls, commands: Iterable[Command], last: Optional[int] = None) -> Situation:
        """Returns the situation of a planner after the commands in its control log.

        Which goals are open is not known then: in each slot, it is the last one.

        Args:
            commands: Those that did not fail, in order.
            last: The last step that may be planned for; by default, the last one that is grounded.
        """
        log = _Log()
        for command in commands:
            log.take(command)
        told = sorted(log.told, key=lambda atom: (last_number(atom) or 0, atom))
        goals: Dict[str, str] = {}
        for atom in told:
            source, content, _ = split_term(atom)[1]
            if source in log.slots and content != "cancel":
                goals[source] = content
        return cls(
            told=tuple(told),
            step=log.step(),
            horizon=log.horizon,
            last=max(last or 0, log.horizon, log.last),
            goals=tuple(goals.items()),
            others=tuple(log.others),
        )


def moved(atom: str, steps: int) -> str:
    """Returns an event or action shifted by some steps; saved events stay."""
    name, arguments = split_term(atom)
    step = number(arguments[-1]) if arguments else None
    if step is None or atom.startswith(SAVE):
        return atom
    return f"{name}({','.join([*arguments[:-1], str(step + steps)])})"


def _is_since(atom: str, step: int) -> bool:
    """Returns whether an event is of a later step, or ends this step."""
    if atom.startswith(SAVE):
        return False
    return (last_number(atom) or 0) > step or atom == event("info", "passed", step)


class _Log:
    """Derives a planner's events, externals and steps from its commands, in any dialect."""

    def __init__(self) -> None:
        self._begin()

    def _begin(self) -> None:
        self.told: Dict[str, None] = {}
        self.others: Dict[str, None] = {}
        self.slots: List[str] = []
        self.horizon = self.last = 0

    def take(self, command: Command) -> None:
        if isinstance(command, Restart):
            self._begin()
        elif isinstance(command, Ground):
            for part in command.parts:
                self._ground(part)
        elif isinstance(command, AssignExternal):
            self._assign(command.name, command.value is Truth.TRUE)
        elif isinstance(command, ReleaseExternal):
            name, arguments = split_term(command.name)
            if name == SLOT_PART:
                self.slots += arguments
            self._assign(command.name, False)

    def _ground(self, part: Part) -> None:
        values = part.parameters
        if part.name in ("state", "transition") and len(values) == 1:
            self.last = max(self.last, number(values[0]) or 0)
        elif part.name in ("event", "set_event") and len(values) == 3:
            self.told[f"event({','.join(values)})"] = None
        elif part.name in ("commit", "rosoclingo_commit") and len(values) == 3:
            action = f"do({values[0]},{values[1]})"
            self.told[f"event(commit,{action},{values[2]})"] = None
        elif part.name in ("finalize", "rosoclingo_pass") and len(values) == 1:
            self.told[event("info", "passed", number(values[0]) or 0)] = None

    def _assign(self, atom: str, true: bool) -> None:
        name, arguments = split_term(atom)
        if name in ("query", "horizon") and len(arguments) == 1:
            self.horizon = (number(arguments[0]) or 0) if true else self.horizon
            return
        if name == "event" and len(arguments) == 3 and arguments[0] == "request":  # the paper's
            own, request = split_term(arguments[1])
            if not own and len(request) == 2:
                atom = f"event({request[0]},{request[1]},{arguments[2]})"
        known = self.told if name == "event" else self.others
        if true:
            known[atom] = None
        else:
            known.pop(atom, None)

    def step(self) -> int:
        """Returns the current step: that of the last action, or the one after the passed steps."""
        steps = [0]
        for atom in self.told:
            source, content, text = split_term(atom)[1]
            step = number(text) or 0
            if source == "info" and content == "passed":
                steps.append(step + 1)
            elif source != "save":
                steps.append(step)
        return max(steps)
