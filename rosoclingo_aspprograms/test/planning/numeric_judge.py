"""Breadth-first search in small PDDL tasks with numbers, by PDDL's own semantics.

Conditions and effects of each ground action are compiled to Python, so tens of thousands of states
take a second. It shares no code with the importer::

    states = reachable(domain, problem, {"fuel": 5}, most=1000)
    first_in(states, "(and (on o1) (>= (fuel o2) 3))")

A number of a function with a limit never gets below 0 or above it, as in ``actions.lp``.
"""

from __future__ import annotations

import itertools
import re
from collections import deque
from dataclasses import dataclass
from typing import Callable, Deque, Dict, Iterator, List, Mapping, Optional, Sequence, Tuple, Union

Form = Union[str, List["Form"]]  # type: ignore[misc]
State = Tuple[int, ...]
"""1 or 0 for each atom, and the value of each number."""

_TOKEN = re.compile(r"[()]|[^\s()]+")
_MOMENTS = ("start", "all", "end")
_Binding = Mapping[str, str]
_Name = Tuple[str, ...]


def read(text: str) -> Form:
    """Returns an expression as nested lists."""
    stack: List[List[Form]] = [[]]
    for token in _TOKEN.findall(text):
        if token == "(":
            stack.append([])
        elif token == ")":
            last = stack.pop()
            stack[-1].append(last)
        else:
            stack[-1].append(token)
    return stack[0][0]


@dataclass
class States:
    """The states that a search has reached.

    Attributes:
        plans: By each state a shortest plan, in PDDL's words; nearer states first.
        is_all: Whether no other state can be reached.
        holds: Compiles a condition without variables.
    """

    plans: Dict[State, Tuple[str, ...]]
    is_all: bool
    holds: Callable[[str], Callable[[State], bool]]


def first_in(states: States, goal: str) -> Optional[Tuple[str, ...]]:
    """Returns the plan of the nearest state in which a condition holds."""
    holds = states.holds(goal)
    return next((plan for state, plan in states.plans.items() if holds(state)), None)


def reachable(domain: str, problem: str, limits: Mapping[str, int], most: int) -> States:
    """Returns the states of a task that are reached first.

    Args:
        domain: Its domain, of which all objects have the only type.
        problem: Its problem; the goal does not matter.
        limits: For functions, how large their numbers can get. Changes of others do not matter.
        most: After how many states the search gives up.
    """
    task = _Task(domain, problem, limits)
    steps = task.steps()
    plans: Dict[State, Tuple[str, ...]] = {task.first: ()}
    waiting: Deque[State] = deque(plans)
    while waiting:
        state = waiting.popleft()
        for name, successor in steps:
            then = successor(state)
            if then is None or then in plans:
                continue
            if len(plans) >= most:
                return States(plans, False, task.compiled)
            plans[then] = (*plans[state], name)
            waiting.append(then)
    return States(plans, True, task.compiled)


class _Task:
    def __init__(self, domain: str, problem: str, limits: Mapping[str, int]) -> None:
        self._limits = limits
        self._actions = [f for f in _lists(read(domain)) if str(f[0]).endswith("action")]
        sections = {str(form[0]): form[1:] for form in _lists(read(problem))}
        self._objects = [str(each) for each in sections[":objects"][:-2]]
        values: Dict[_Name, int] = {}
        declared = {str(form[0]): form[1:] for form in _lists(read(domain))}
        for form in _lists(declared[":predicates"]):
            variables = [word for word in form[1:] if str(word).startswith("?")]
            for chosen in itertools.product(self._objects, repeat=len(variables)):
                values[(str(form[0]), *chosen)] = 0
        for form in _lists(sections[":init"]):
            if form[0] == "=":
                values[_ground(form[1], {})] = int(str(form[2]))
            else:
                values[_ground(form, {})] = 1
        self._places = {name: place for place, name in enumerate(values)}
        self.first: State = tuple(values.values())

    def compiled(self, condition: str) -> Callable[[State], bool]:
        code = self._condition(read(condition), {})
        found: Callable[[State], bool] = eval(f"lambda s: {code}")
        return found

    def steps(self) -> List[Tuple[str, Callable[[State], Optional[State]]]]:
        """Returns the ground actions: each gives the next state, or None if it is not possible."""
        found = []
        for action in self._actions:
            keys = {str(key): value for key, value in zip(action[2::2], action[3::2])}
            variables = [str(word) for word in keys[":parameters"] if str(word).startswith("?")]
            for chosen in itertools.product(self._objects, repeat=len(variables)):
                name = " ".join([str(action[1]), *chosen])
                found.append((name, self._successor(keys, dict(zip(variables, chosen)))))
        return found

    def _successor(
        self, keys: Mapping[str, Form], objects: _Binding
    ) -> Callable[[State], Optional[State]]:
        """Compiles an action: its start, what holds while it lasts, and its end."""
        if ":duration" not in keys:
            lines = [*self._need(keys[":precondition"], objects)]
            lines += self._change(keys[":effect"], objects)
        else:
            needed, effects = _by_moment(keys[":condition"]), _by_moment(keys[":effect"])
            lines = [*self._need(needed["start"], objects)]
            lines += self._change(effects["start"], objects)
            lines += self._need(["and", needed["all"], needed["end"]], objects)
            lines += self._change(effects["end"], objects)
        space: Dict[str, Callable[[State], Optional[State]]] = {}
        code = "\n ".join(["def successor(s):", *lines, "return s"])
        exec(code, {}, space)
        return space["successor"]

    def _need(self, condition: Form, objects: _Binding) -> Iterator[str]:
        yield f"if not {self._condition(condition, objects)}: return None"

    def _change(self, effect: Form, objects: _Binding) -> Iterator[str]:
        """Yields lines by which ``s`` becomes the next state."""
        added: Dict[int, List[str]] = {}
        deleted: Dict[int, List[str]] = {}
        numbers: Dict[int, str] = {}
        for form, when, bound in self._effects(effect, "True", objects):
            if form[0] in ("increase", "decrease", "assign"):
                name = _ground(form[1], bound)
                if name[0] not in self._limits:
                    continue
                place, amount = self._places[name], self._amount(form[2], bound)
                old = numbers.get(place, f"s[{place}]")
                sign = "+" if form[0] == "increase" else "-"
                numbers[place] = amount if form[0] == "assign" else f"{old} {sign} {amount}"
            elif form[0] == "not":
                deleted.setdefault(self._places[_ground(form[1], bound)], []).append(when)
            else:
                added.setdefault(self._places[_ground(form, bound)], []).append(when)
        changed = dict(numbers)
        for place in {*added, *deleted}:
            gone = " or ".join(deleted.get(place, ["False"]))
            made = " or ".join(added.get(place, ["False"]))
            changed[place] = f"1 if {made} else 0 if {gone} else s[{place}]"
        if changed:
            parts = [changed.get(place, f"s[{place}]") for place in range(len(self.first))]
            yield f"s = ({', '.join(parts)},)"
        limits = {place: self._limits[name[0]] for name, place in self._places.items()
                  if place in numbers}  # fmt: skip
        for place, limit in limits.items():
            yield f"if not 0 <= s[{place}] <= {limit}: return None"

    def _effects(
        self, form: Form, when: str, objects: _Binding
    ) -> Iterator[Tuple[List[Form], str, _Binding]]:
        """Yields simple effects, with the code of their conditions and the objects of variables."""
        assert isinstance(form, list)
        if form[:1] == ["and"]:
            for part in form[1:]:
                yield from self._effects(part, when, objects)
        elif form[:1] == ["forall"]:
            for each in self._bindings(form[1], objects):
                yield from self._effects(form[2], when, each)
        elif form[:1] == ["when"]:
            yield from self._effects(form[2], self._condition(form[1], objects), objects)
        elif form:
            yield form, when, objects

    def _condition(self, form: Form, objects: _Binding) -> str:
        """Returns the code of a condition of ``s``."""
        head, *rest = form or ["and"]
        if head in ("and", "or"):
            inner = [self._condition(part, objects) for part in rest]
            return f"({f' {head} '.join(inner) or head == 'and'})"
        if head == "not":
            return f"(not {self._condition(rest[0], objects)})"
        if head == "imply":
            return self._condition(["or", ["not", rest[0]], rest[1]], objects)
        if head in ("forall", "exists"):
            inner = [self._condition(rest[1], each) for each in self._bindings(rest[0], objects)]
            return f"({(' and ' if head == 'forall' else ' or ').join(inner)})"
        if head in ("<", "<=", ">=", ">", "="):
            left, right = (self._amount(part, objects) for part in rest)
            return f"({left} {'==' if head == '=' else head} {right})"
        return f"s[{self._places[_ground(form, objects)]}]"

    def _amount(self, form: Form, objects: _Binding) -> str:
        return form if isinstance(form, str) else f"s[{self._places[_ground(form, objects)]}]"

    def _bindings(self, variables: Form, objects: _Binding) -> List[_Binding]:
        return [{**objects, str(variables[0]): each} for each in self._objects]


def _lists(form: Form) -> List[List[Form]]:
    return [part for part in form if isinstance(part, list)]


def _ground(form: Form, objects: _Binding) -> _Name:
    return tuple(objects.get(str(part), str(part)) for part in form)


def _by_moment(form: Form) -> Dict[str, Form]:
    """Returns the parts of ``(and (at start C) (over all C) ...)`` by their moments."""
    found: Dict[str, List[Form]] = {moment: ["and"] for moment in _MOMENTS}
    for part in _lists(form):
        found[str(part[1])].append(part[2])
    return dict(found)


def functions_compared(texts: Sequence[str]) -> List[str]:
    """Returns the functions that some comparison of the texts reads."""
    found: List[str] = []
    waiting: List[Form] = [read(text) for text in texts]
    while waiting:
        form = waiting.pop()
        if isinstance(form, list):
            waiting += form
            if form[:1] and form[0] in ("<", "<=", ">=", ">", "="):
                found += [str(part[0]) for part in _lists(form)]
    return found
