"""Judge of executions in domains of ``actions.lp``: a physical world that keeps to their rules.

It shares no code with the planner: clingo grounds the facts of the encoding, and their meaning is
written here anew, as the comment at the head of ``actions.lp`` has it.
"""

from __future__ import annotations

from collections import defaultdict
from typing import DefaultDict, Dict, FrozenSet, Iterator, List, Optional, Sequence, Set, Tuple

import clingo

from rosclingo.wire.term_text import split_term

Row = Tuple[str, ...]
Rows = Dict[str, Set[Row]]
Held = Tuple[str, str]
"""An actuator and its action."""

# Predicates with their arities in base; with the number of a search, there is one more argument.
_BASE = {
    "initially": 2, "number": 2, "moves": 1, "way": 2, "lasts": 3, "drains": 3, "action": 2,
    "needs": 4, "needs_other": 4, "needs_least": 4, "needs_most": 4, "sets": 4, "sets_if": 5,
    "condition": 5, "uses": 4, "gives": 4, "fills": 3, "occupies": 3, "fails": 4, "wants": 3,
    "wants_least": 3, "wants_most": 3, "restores": 3, "says": 3, "request": 1, "ready": 3,
}  # fmt: skip
_OF_SLOTS = {"own": 4, "wants": 4, "wants_least": 4, "wants_most": 4, "restores": 4}
_SEARCH = "1"


class Rules:
    """The ground facts of an encoding: of base, and of each open goal."""

    def __init__(self, files: Sequence[str], options: Sequence[str] = ()) -> None:
        self._files = files
        self._options = options
        self._known: Dict[Tuple[str, str, bool], Rows] = {}
        self.base = self._ground()

    def of_goal(self, slot: str, request: str, *, is_canceled: bool) -> Rows:
        """Returns the facts that depend on the request in a slot."""
        key = slot, request, is_canceled
        if key not in self._known:
            told = [(slot, request)] + ([(slot, "cancel")] if is_canceled else [])
            self._known[key] = self._ground(told)
        return self._known[key]

    def _ground(self, told: Sequence[Tuple[str, str]] = ()) -> Rows:
        control = clingo.Control([*self._options, "-Wnone"])
        for file in self._files:
            control.load(file)
        step, search = clingo.Number(0), clingo.parse_term(_SEARCH)
        events = [("event", [clingo.parse_term(s), clingo.parse_term(c), step]) for s, c in told]
        for part in [
            ("base", []),
            *events,
            ("search", [search, step]),
            ("present", [search, step]),
        ]:
            control.ground([part])
        rows: DefaultDict[str, Set[Row]] = defaultdict(set)
        for atom in control.symbolic_atoms:
            name, texts = atom.symbol.name, tuple(map(str, atom.symbol.arguments))
            if not atom.is_fact:
                continue
            if _OF_SLOTS.get(name) == len(texts) and texts[-1] == _SEARCH:
                rows[f"{name} of a slot"].add(texts[:-1])
            elif _BASE.get(name) == len(texts):
                rows[name].add(texts)
            elif _BASE.get(name) == len(texts) - 1 and texts[-1] == _SEARCH:
                rows[name].add(texts[:-1])
        return rows


class Act:
    """The conditions and effects of an action."""

    def __init__(self, rows: Rows, actuator: str, action: str, limits: Dict[str, int]) -> None:
        def about(name: str) -> List[Row]:
            return sorted(row[2:] for row in rows[name] if row[:2] == (actuator, action))

        self.needs = [row for row in about("needs") if row[0] not in limits]
        self.others = about("needs_other")
        self.least = [(name, int(n)) for name, n in about("needs_least") if name in limits]
        self.most = [(name, int(n)) for name, n in about("needs_most") if name in limits]
        for name, value in about("needs"):
            if name in limits:
                self.least.append((name, int(value)))
                self.most.append((name, int(value)))
        self.sets = [(variable, value) for variable, value in about("sets")]
        self.becomes = {name: int(n) for name, n in self.sets if name in limits}
        self.becomes.update({row[0]: limits[row[0]] for row in about("fills") if row[0] in limits})
        self.sets = [row for row in self.sets if row[0] not in limits]
        self.conditional = [
            (variable, value, [row[1:] for row in about("condition") if row[0] == index])
            for index, variable, value in about("sets_if")
        ]
        self.takes = _sums(about("uses"), limits)
        self.adds = _sums(about("gives"), limits)
        self.occupies = {row[0] for row in about("occupies")}
        self.fails = about("fails")

    @property
    def reads(self) -> Set[str]:
        """The variables of which it matters which value they have."""
        found = {row[0] for row in (*self.needs, *self.others)}
        return found | {row[0] for _, _, conditions in self.conditional for row in conditions}

    @property
    def writes(self) -> Set[str]:
        """The variables that it may change."""
        return {row[0] for row in (*self.sets, *self.conditional)}


def _sums(rows: Sequence[Row], limits: Dict[str, int]) -> Dict[str, int]:
    sums: DefaultDict[str, int] = defaultdict(int)
    for name, amount in rows:
        if name in limits:
            sums[name] += int(amount)
    return dict(sums)


class Physics:
    """The true state of the world, and a judge of the actions in it.

    Attributes:
        values: The values of variables.
        levels: The levels of numbers.
        limits: Their limits.
        blocked: Pairs of places between which there is no way.
        lost: The variables whose value the robots do not know.
        running: What actuators do.
        ripening: What variables become by themselves.
        slots: By the slots, the open goals with their requests.
        violations: What was impossible.
    """

    def __init__(self, rules: Rules) -> None:
        self._rules = rules
        base = rules.base
        self.limits: Dict[str, int] = {}
        for name, limit in base["number"]:
            self.limits[name] = min(int(limit), self.limits.get(name, int(limit)))
        self.levels = dict(self.limits)
        self.values: Dict[str, str] = {}
        for variable, value in base["initially"]:
            if variable in self.limits:
                self.levels[variable] = int(value)
            else:
                self.values[variable] = value
        self.blocked: Set[FrozenSet[str]] = set()
        self.lost: Set[str] = set()
        self.running: Dict[str, Tuple[str, Act]] = {}
        self.ripening: Dict[str, str] = {}
        self.slots: Dict[str, Tuple[str, str]] = {}
        self.canceled: Set[str] = set()
        self.violations: List[str] = []

    # Goals.

    def enter(self, slot: str, goal: str, request: str) -> None:
        """A goal has got a slot."""
        if self.slots.get(slot) == (goal, request):
            return
        self.slots[slot] = goal, request
        for of, variable, value in self._rows_of(slot)["own of a slot"]:
            if of == slot:
                self.values[variable] = value

    def leave(self, slot: str) -> Set[str]:
        """A goal has left its slot; returns its variables."""
        mine = {row[1] for row in self._rows_of(slot)["own of a slot"] if row[0] == slot}
        goal, _ = self.slots.pop(slot)
        self.canceled.discard(goal)
        for variable in mine:
            self.values.pop(variable, None)
            self.ripening.pop(variable, None)
            self.lost.discard(variable)
        return mine

    def own(self, slot: str) -> Set[str]:
        """Returns the variables of a goal."""
        return {row[1] for row in self._rows_of(slot)["own of a slot"] if row[0] == slot}

    def _rows_of(self, slot: str) -> Rows:
        goal, request = self.slots[slot]
        return self._rules.of_goal(slot, request, is_canceled=goal in self.canceled)

    def unmet(self, slot: str) -> List[str]:
        """Returns the unmet wishes of a goal, as text."""
        _, request = self.slots[slot]
        rows, found = self._rows_of(slot), []
        for head, name in ((request, "{}"), (slot, "{} of a slot")):
            for of, variable, value in rows[name.format("wants")]:
                if of == head and not self._has(variable, value):
                    found.append(f"{variable} is {self.now(variable)}, and not {value}")
            for word, sign in (("wants_least", 1), ("wants_most", -1)):
                for of, number, bound in rows[name.format(word)]:
                    if of == head and (self.levels[number] - int(bound)) * sign < 0:
                        found.append(f"{number} is {self.levels[number]}, {word} {bound}")
        return found

    def unrestored(self, slot: str) -> List[str]:
        """Returns what a canceled goal has left unrestored, as text."""
        _, request = self.slots[slot]
        rows = self._rows_of(slot)
        wanted = [row[1:] for row in rows["restores"] if row[0] == request]
        wanted += [row[1:] for row in rows["restores of a slot"] if row[0] == slot]
        return [
            f"{variable} is {self.now(variable)}, and not {value}"
            for variable, value in wanted
            if not self._has(variable, value)
        ]

    def now(self, variable: str) -> str:
        """Returns the value of a variable or the level of a number, as text."""
        if variable in self.lost:
            return "lost"
        return str(self.levels.get(variable, self.values.get(variable, "unknown")))

    def _has(self, variable: str, value: str) -> bool:
        return self.now(variable) == value

    # Actions.

    def act(self, actuator: str, action: str) -> Optional[Act]:
        """Returns what an action needs and changes; None if there is no such action."""
        name, arguments = split_term(action)
        if name == "go" and (actuator,) in self._rules.base["moves"] and len(arguments) == 1:
            return self._way(actuator, arguments[0])
        sources = [self._rows_of(slot) for slot in self.slots] or [self._rules.base]
        rows: DefaultDict[str, Set[Row]] = defaultdict(set)
        for each in sources:
            for key, some in each.items():
                if not key.endswith("of a slot"):
                    rows[key] |= some
        if (actuator, action) not in rows["action"]:
            return None
        return Act(rows, actuator, action, self.limits)

    def _way(self, robot: str, place: str) -> Optional[Act]:
        base, variable = self._rules.base, f"at({robot})"
        here = self.values[variable]
        if (here, place) not in base["way"] or frozenset((here, place)) in self.blocked:
            return None
        (length,) = (int(n) for v, w, n in base["lasts"] if (v, w) == (here, place))
        act = Act(defaultdict(set), robot, f"go({place})", self.limits)
        act.needs, act.sets = [(variable, here)], [(variable, place)]
        for who, number, each in base["drains"]:
            if who == robot and number in self.limits:
                act.takes[number] = act.takes.get(number, 0) + int(each) * length
        return act

    def try_again(self, robot: str, move: str) -> None:
        """A way is free again on which a move has failed, as that is tried again."""
        self.blocked.discard(frozenset((self.values[f"at({robot})"], move[len("go(") : -1])))

    def begin(self, actuator: str, action: str) -> None:
        """An actuator begins an action; notes if that is not possible."""
        act = self.act(actuator, action)
        if act is None:
            self._note(f"{actuator} cannot {action} at all: {self.describe()}")
            act = Act(defaultdict(set), actuator, action, self.limits)
        if actuator in self.running:
            self._note(f"{actuator} begins {action} while it does {self.running[actuator][0]}")
        for obstacle in self._obstacles(act):
            self._note(f"{actuator} begins {action}, but {obstacle}")
        self.running[actuator] = action, act

    def _obstacles(self, act: Act) -> Iterator[str]:
        for variable, value in act.needs:
            if not self._has(variable, value):
                yield f"{variable} is {self.now(variable)}, and not {value}"
        for variable, value in act.others:
            if self._has(variable, value):  # that it is unknown is another value
                yield f"{variable} is {self.now(variable)}"
        others = [other for _, other in self.running.values()]
        for number in {*act.takes, *act.adds, *dict(act.least), *dict(act.most)}:
            least = self.levels[number] - sum(each.takes.get(number, 0) for each in others)
            most = self.levels[number] + sum(each.adds.get(number, 0) for each in others)
            needed = [act.takes.get(number, 0), *(n for name, n in act.least if name == number)]
            if least < max(needed):
                yield f"{number} is {least}, and less than {max(needed)}"
            if any(most > n for name, n in act.most if name == number):
                yield f"{number} is {most}, and that is too much"
            if most + act.adds.get(number, 0) > self.limits[number] and number in act.adds:
                yield f"{number} is {most}, and has no room for {act.adds[number]}"
        for actuator, (action, other) in self.running.items():
            shared = act.writes & (other.reads | other.writes) | other.writes & act.reads
            numbers = {*act.takes, *act.adds, *act.becomes}
            shared |= {*other.becomes} & numbers | {*act.becomes} & {*other.takes, *other.adds}
            shared |= act.occupies & other.occupies
            for variable in sorted(shared):
                yield f"{actuator} does {action}, and both are about {variable}"

    def end(self, actuator: str, outcome: str, is_done: bool = True) -> List[str]:
        """An action ends.

        Args:
            actuator: Whose it is.
            outcome: Success, failure or unknown.
            is_done: Whether it was done, if that is unknown.

        Returns:
            The variables that are lost by that.
        """
        action, act = self.running.pop(actuator)
        is_way = action.startswith("go(") and f"at({actuator})" in dict(act.sets)
        changes = [
            (variable, value)
            for variable, value, conditions in act.conditional
            if all(self._has(*condition) for condition in conditions)
        ]
        changes += act.sets
        if outcome == "failure":
            changes = act.fails
            if is_way:
                place = dict(act.needs)[f"at({actuator})"]
                self.blocked.add(frozenset((place, dict(act.sets)[f"at({actuator})"])))
        lost = sorted(act.writes) if outcome == "unknown" else []
        if outcome != "unknown" or is_done:
            for variable, value in changes:
                self.lost.discard(variable)
                if variable in self.limits:
                    self.levels[variable] = int(value)
                elif variable in self.values:  # and not one of a goal that has ended
                    takes_time = outcome == "success" and self._takes_time(variable, value)
                    (self.ripening if takes_time else self.values)[variable] = value
        for number in self.limits:
            takes, adds = act.takes.get(number, 0), act.adds.get(number, 0)
            if outcome != "failure" or is_way:
                level = self.levels[number] - takes + (adds if outcome == "success" else 0)
                self.levels[number] = min(max(level, 0), self.limits[number])
            if number in act.becomes and outcome == "success":
                self.levels[number] = act.becomes[number]
            elif number in act.becomes and outcome == "unknown":
                self.levels[number] = min(self.levels[number], act.becomes[number])
        lost = [variable for variable in lost if variable in self.values]
        self.lost |= set(lost)
        return lost

    def _takes_time(self, variable: str, value: str) -> bool:
        sources = [self._rules.base, *(self._rows_of(slot) for slot in self.slots)]
        return any(row[:2] == (variable, value) for rows in sources for row in rows["ready"])

    def ripen(self, variable: str, value: str) -> None:
        """The time has come after which a variable has a value by itself."""
        if self.ripening.get(variable) == value:
            self.values[variable] = self.ripening.pop(variable)

    def is_touched(self, variable: str) -> bool:
        """Whether an action under way reads or changes a variable or a number."""
        return any(
            variable in act.reads | act.writes | {*act.takes, *act.adds, *act.becomes}
            or variable in {*dict(act.least), *dict(act.most)}
            for _, act in self.running.values()
        )

    def set(self, variable: str, value: str) -> None:
        """Changes a variable or a number from outside, or makes it known."""
        self.lost.discard(variable)
        self.ripening.pop(variable, None)
        if variable in self.limits:
            self.levels[variable] = int(value)
        else:
            self.values[variable] = value

    def _note(self, text: str) -> None:
        self.violations.append(text)

    def describe(self) -> str:
        """Returns the state of the world as readable text."""
        values = {**self.values, **self.levels, **dict.fromkeys(self.lost, "lost")}
        running = {actuator: action for actuator, (action, _) in self.running.items()}
        return f"{values}, blocked {[sorted(way) for way in self.blocked]}, {running}, {self.slots}"
