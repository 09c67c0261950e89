"""Finds out whether the rest of a plan still leads to what is wanted, and what is begun of it."""

from __future__ import annotations

import contextlib
from collections import Counter
from typing import Callable, Dict, Iterator, List, Mapping, Optional, Sequence, Set, Tuple

from rosoclingo.engine.moves import Moves
from rosoclingo.engine.task import Kind, PlanningTask, TaskAction, TaskFact, TaskState
from rosoclingo.errors import TaskError

_BRIEFLY = 10  # seconds for which an actuator waits where it stands, rather than to leave
_CHANGING = (Kind.TAKES, Kind.ADDS, Kind.BECOMES)


def rest_of_plan(task: PlanningTask) -> Optional[List[int]]:
    """Returns what is left of the plan before as numbers of actions, in an order for execution.

    Robots go from where they are now, so a way may be another one than before. What cannot help any
    more is left out.

    Returns:
        None if some of it is not possible any more, or if nothing is left.
    """
    if not task.left:
        return None
    walk = _Walk(task)
    by_choice = {f"{a.actuator},{a.name}": n for n, a in enumerate(task.actions) if not a.start}
    for layer in task.left:
        for name, place in layer:
            if place:
                walk.go(name, place)
        group = [by_choice[name] for name, place in layer if not place and name in by_choice]
        if not all(walk.act(number) for number in _in_order(task, group)):
            return None
    done = task.execute(walk.plan)
    if len(done.met) == len(task.requests):
        return walk.plan
    return _needed(task, walk.plan, done.met)


def begun_of(task: PlanningTask, plan: List[int]) -> List[List[int]]:
    """Returns what is begun of the plan that stands, for each actuator in order.

    That is its next action, with the way to it, if that serves a request. Nothing is that has just
    failed, or that has to wait for others where the actuator stands already; nor is anything of a
    plan that is not executed yet, or if a request has waited too long, which may break it.

    Args:
        task: The task.
        plan: What is left of the plan.
    """
    begun: Dict[str, List[int]] = {}
    through: Set[str] = set()
    for number in _needed(task, plan, task.execute(plan).met) if _may_hold(task) else ():
        action = task.actions[number]
        actuator = action.actuator
        if actuator not in through and not _has_failed(task, actuator):
            if not action.start:
                through.add(actuator)
            if actuator in begun or not _has_to_wait(task, action):
                begun.setdefault(actuator, []).append(number)
    return [*begun.values()]


def begun_plan(task: PlanningTask) -> List[int]:
    """Returns as much of what is begun as is possible, where the rest of the plan is not.

    What puts a request out of reach is left out, such as to serve what has been cancelled.
    """
    parts = [*_begun_parts(task)] if _may_hold(task) else []
    plan, state = _append(task, parts, lambda _: True)
    if parts and not _is_in_reach(task, state):
        plan, _ = _append(task, parts, lambda state: _is_in_reach(task, state))
    return plan


def _begun_parts(task: PlanningTask) -> Iterator[Tuple[TaskAction, str]]:
    """Yields the next action of each actuator, and where it goes for that; empty for nowhere."""
    headed: Dict[str, str] = {}
    through: Set[str] = set()
    choices = {f"{a.actuator},{a.name}": a for a in task.actions if not a.start}
    for name, place in [one for layer in task.left for one in layer]:
        if place:
            headed[name] = place
        if place or name not in choices:
            continue
        actuator = choices[name].actuator
        if actuator not in through and not _has_failed(task, actuator):
            through.add(actuator)
            target = headed.get(actuator, "")
            stands = target in ("", task.state.values.get(f"at({actuator})"))
            if not (stands and _has_to_wait(task, choices[name])):
                yield choices[name], target


def _append(
    task: PlanningTask,
    parts: Sequence[Tuple[TaskAction, str]],
    is_wanted: Callable[[TaskState], bool],
) -> Tuple[List[int], TaskState]:
    """Returns a plan of the parts that are possible and after which the state is as wanted."""
    plan: List[int] = []
    state = task.state
    numbers = {(a.actuator, a.name, a.start): n for n, a in enumerate(task.actions)}
    for action, place in parts:
        actuator = action.actuator
        more = [numbers[actuator, action.name, ""]]
        here = state.values.get(f"at({actuator})", "")
        if place not in ("", here):
            more.insert(0, numbers.get((actuator, place, here), -1))
        with contextlib.suppress(TaskError):
            if -1 not in more:
                after = task.execute([*plan, *more]).state
                if is_wanted(after):
                    plan, state = [*plan, *more], after
    return plan, state


def _is_in_reach(task: PlanningTask, state: TaskState) -> bool:
    """Tells whether all requests are within reach of a state if nothing is undone or used up.

    Where variables are derived, it does not know, and says so.
    """
    wanted = {fact for request in task.requests.values() for fact in request.values}
    reached = set(state.values.items())
    left: Sequence[TaskAction] = () if task.derivation.variables else task.actions
    while left and not wanted <= reached:
        several = Counter(variable for variable, _ in reached)
        later: List[TaskAction] = []
        for action in left:
            can = reached.issuperset(action.needs) and all(
                several[variable] > 1 or (variable, value) not in reached
                for variable, value in action.others
            )
            if can:
                reached.update((change.variable, change.value) for change in action.changes)
            else:
                later.append(action)
        if len(later) == len(left):
            break
        left = later
    return bool(task.derivation.variables) or wanted <= reached


def _may_hold(task: PlanningTask) -> bool:
    return task.is_begun and task.elder not in task.requests


def _has_to_wait(task: PlanningTask, action: TaskAction) -> bool:
    """Tells whether an action where its actuator stands waits for others, and not just briefly."""
    return any(
        task.state.values.get(variable) != value or _is_late(task, action.actuator, variable)
        for variable, value in action.needs
    )


def _is_late(task: PlanningTask, actuator: str, variable: str) -> bool:
    """Tells whether a variable gets its value long after an actuator is free."""
    if task.times is None or variable not in task.times.since:
        return variable in task.ripening
    return task.times.since[variable] > task.times.free.get(actuator, 0) + _BRIEFLY


def _has_failed(task: PlanningTask, actuator: str) -> bool:
    return any(choice.startswith(f"{actuator},") for choice in task.failed)


def first_obstacle(
    state: TaskState,
    limits: Mapping[str, int],
    actions: Sequence[TaskAction],
    moves: Moves,
    layers: Sequence[Sequence[TaskFact]],
) -> str:
    """Returns why a plan is not possible; empty if it is.

    Args:
        state: What there is before it; changes.
        limits: The largest level of each number.
        actions: All actions, without ways.
        moves: The ways of robots.
        layers: The plan, as :class:`~rosoclingo.engine.task.PlanningTask` has what is left of one.
    """
    by_choice = {f"{action.actuator},{action.name}": action for action in actions}
    chosen: List[TaskAction] = []  # ways and actions, in the order of the plan
    task = PlanningTask(state, limits, chosen, {})
    for layer in layers:
        begin = len(chosen)
        for robot, place in layer:
            here = state.values.get(f"at({robot})", "unknown")
            if place and here != place:
                ways = list(moves.ways(robot, here, [place]))
                if not ways:
                    return f"{robot} cannot go from {here} to {place}"
                chosen += ways
        order = list(range(begin, len(chosen)))
        for name, place in layer:
            if not place and name not in by_choice:
                return f"{name.replace(',', ': ', 1)} can never be done"
            if not place:
                chosen += moves.reserving([by_choice[name]])
        order += _in_order(task, range(begin + len(order), len(chosen)))
        for number in order:
            reason = next(task.obstacles(chosen[number], state), "")
            if reason:
                return f"{chosen[number]} is not possible: {reason}"
            task.do(number, state)
    return ""


class _Walk:
    """Executes a plan bit by bit.

    Attributes:
        plan: The numbers of the actions until now.
    """

    def __init__(self, task: PlanningTask) -> None:
        self.plan: List[int] = []
        self._task = task
        self._state = TaskState(dict(task.state.values), dict(task.state.levels))
        self._ways = {
            (action.actuator, action.name, action.start): number
            for number, action in enumerate(task.actions)
            if action.start
        }

    def go(self, robot: str, place: str) -> None:
        """Has a robot go to a place, if it can; else what it does there is not possible."""
        way = self._ways.get((robot, place, self._state.values.get(f"at({robot})", "")))
        if way is not None:
            self.act(way)

    def act(self, number: int) -> bool:
        """Does an action; returns whether that is possible."""
        try:
            self._task.do(number, self._state)
        except TaskError:
            return False
        self.plan.append(number)
        return True


def _needed(task: PlanningTask, plan: List[int], met: Mapping[str, int]) -> List[int]:
    """Returns a plan without what serves none of the requests that it meets.

    An action is kept if something later depends on what it changes.
    """
    needed: Set[str] = set()  # variables and numbers whose values matter to what is kept
    kept: List[int] = []
    for position in range(len(plan), 0, -1):
        for slot, when in met.items():
            if when == position:
                needed.update(variable for variable, _ in task.requests[slot].values)
                needed.update(number for number, _, _ in task.requests[slot].bounds)
        needed = {base for name in needed for base in task.derivation.basis(name)}
        action = task.actions[plan[position - 1]]
        changed = {change.variable for change in action.changes}
        changed.update(name for kind, name, _ in action.numbers if kind in _CHANGING)
        if changed & needed:
            kept.append(plan[position - 1])
            needed -= {change.variable for change in action.changes if not change.conditions}
            needed |= _read(action)
            needed.update(name for _, name, _ in action.numbers)
    walk = _Walk(task)
    for number in reversed(kept):
        action = task.actions[number]
        if action.start:
            walk.go(action.actuator, action.name)
        elif not walk.act(number):
            return plan
    return walk.plan if task.execute(walk.plan).met.keys() >= met.keys() else plan


def _in_order(task: PlanningTask, group: Sequence[int]) -> List[int]:
    """Sorts the actions of a layer: a value is read before it is changed."""
    rest, ordered = list(group), []
    while rest:
        free = [one for one in rest if not any(_precedes(task, other, one) for other in rest)]
        ordered.append((free or rest)[0])
        rest.remove(ordered[-1])
    return ordered


def _precedes(task: PlanningTask, first: int, second: int) -> bool:
    """Tells whether one action reads what another one changes, and does not change it."""
    changed = {change.variable for change in task.actions[second].changes}
    own = {change.variable for change in task.actions[first].changes}
    read = {base for name in _read(task.actions[first]) for base in task.derivation.basis(name)}
    return first != second and bool((read - own) & changed)


def _read(action: TaskAction) -> Set[str]:
    read = {variable for variable, _ in (*action.needs, *action.others)}
    for change in action.changes:
        read.update(variable for variable, _ in change.conditions)
    return read
