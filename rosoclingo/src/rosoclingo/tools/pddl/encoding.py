"""Facts and rules for the library ``actions.lp``, of a planning task."""

from __future__ import annotations

from typing import Dict, Iterator, List, Optional, Sequence, Tuple

from rosoclingo.tools.pddl.actuators import Actuators
from rosoclingo.tools.pddl.amounts import Name
from rosoclingo.tools.pddl.derived_encoding import TermBounds, derived_facts, derived_rules
from rosoclingo.tools.pddl.domain import ActionSchema, Domain
from rosoclingo.tools.pddl.expressions import ListForm
from rosoclingo.tools.pddl.names import Identifiers
from rosoclingo.tools.pddl.numbers import Numbers, NumericUse, ground_atom
from rosoclingo.tools.pddl.sas import SasOperator, TranslatedTask
from rosoclingo.tools.pddl.variables import Variable, read_atom, variables

GOAL = "goal"
"""The request for all that the problem's goal says."""

_FACTS = """
#program base.
#defined denial/4.

% fact(F,V,X): the fact F, or -F for its contrary, means that V has the value X. A message
% may say it; it may be requested if it holds initially, or if an action brings it about.
says(F,V,X) :- fact(F,V,X), not derived(V).
wants(F,V,X) :- fact(F,V,X).
request(F) :- fact(F,V,X), possible(V,X).
possible(V,X) :- initially(V,X).
possible(V,(yes;no)) :- derived(V).
possible(V,X) :- sets(R,A,V,X).
possible(V,X) :- sets_if(R,A,I,V,X).
#external event(1,F) : request(F).

% value(L,N): the number L is N. A message may say that, unless L can be very large.
% told_up_to(L,M): L is such a number, up to M. With the range in the same rule, clingo would try
% all pairs of numbers up to 10000.
says(value(L,N),L,N) :- told_up_to(L,M), N = 0..M.
told_up_to(L,M) :- number(L,M), M <= 10000.

% denial(C,V,X,Y): if V has the value X, the message C says that it has the value Y.
#program event(s,c).
#external event(s,c) : denial(c,V,X,Y), s = info.

#program present(k,t).
said(V,Y,k) :- told(info,C,t), denial(C,V,X,Y), was(V,X,k).
"""


class Encoder:
    """Writes a task as facts."""

    def __init__(
        self,
        task: TranslatedTask,
        domain: Domain,
        numbers: Numbers,
        names: Identifiers,
        actuators: Actuators,
    ) -> None:
        """Takes a task.

        Args:
            task: What the translator has found.
            domain: The domain.
            numbers: Has what the translator leaves out.
            names: Has terms for all names.
            actuators: Knows who does an action.

        Raises:
            PddlError: The library has no such numbers.
        """
        self._task = task
        self._schemas = {schema.name: schema for schema in domain.actions}
        self._numbers = numbers
        self._names = names
        self._actuators = actuators
        self._variables = variables(task.variables, names)
        self._locks = {lock.head for schema in domain.actions for lock in schema.locks}
        words = [operator.name.split() for operator in task.operators]
        tests = {test: _test(test) for rule in task.rules for test in rule.tests}
        self._uses = numbers.read([(name, objects) for name, *objects in words], tests.values())
        self._tests = {test: numbers.tested(name) for test, name in tests.items()}
        self._goal = numbers.goal()

    def rules(self) -> List[str]:
        """Returns the rules for requests, messages and derived variables."""
        return [*_FACTS.strip().splitlines(), *derived_rules(self._task)]

    def facts(self) -> List[str]:
        """Returns the facts for requests and messages, the numbers, and the rules."""
        lines: List[str] = []
        for variable in self._variables:
            for value, atom in zip(variable.values, variable.atoms):
                if atom is not None:
                    fact = self._names.term(atom.predicate, atom.objects)
                    lines += self._fact(fact, variable, value)
        for name, largest in self._numbers.largest.items():
            lines.append(f"number({self._term(name)},{largest}).")
        return [*lines, *derived_facts(self._task, self._variables, self._bounds_of)]

    def _bounds_of(self, test: str) -> Optional[TermBounds]:
        """Returns the bounds of numbers in a test; None if the test never holds."""
        bounds = self._tests[test]
        return None if bounds is None else {self._term(name): b for name, b in bounds.items()}

    def _holds_at_first(self, test: str) -> bool:
        bounds = self._tests[test]
        return bounds is not None and self._numbers.are_within(bounds)

    def _fact(self, fact: str, variable: Variable, value: str) -> Iterator[str]:
        yield f"fact({fact},{variable.name},{value})."
        if variable.other is None:
            return
        if len(variable.values) == 2:
            yield f"fact(-{fact},{variable.name},{variable.other})."
        else:
            yield f"denial(-{fact},{variable.name},{value},{variable.other})."

    def instance(self) -> List[str]:
        """Returns the first values, and the goal."""
        task = self._task
        first = [
            f"initially({self._pair(v, x)})."
            for v, x in enumerate(task.init)
            if v not in task.strata
        ]
        first += [
            f"initially({self._term(name)},{self._numbers.first(name)})."
            for name in self._numbers.largest
        ]
        wanted = [f"wants({GOAL},{self._pair(v, x)})." for v, x in task.goal]
        for name, (least, most) in self._goal.items():
            if least > 0:
                wanted.append(f"wants_least({GOAL},{self._term(name)},{least}).")
            if most is not None:
                wanted.append(f"wants_most({GOAL},{self._term(name)},{most}).")
        return [*first, "", f"request({GOAL}).", *wanted]

    @property
    def begins_at_goal(self) -> bool:
        """True if the initial state meets the goal."""
        state = self._task.derived_state(self._holds_at_first)
        return all(
            state[variable] == value for variable, value in self._task.goal
        ) and self._numbers.are_within(self._goal)

    def actions(self) -> List[str]:
        """Returns the conditions and effects of actions, action by action."""
        by_name: Dict[str, List[Tuple[SasOperator, NumericUse]]] = {}
        for operator, use in zip(self._task.operators, self._uses):
            if use is not None and (operator.effects or use.changes_something):
                by_name.setdefault(operator.name.split()[0], []).append((operator, use))
        lines: List[str] = []
        for name, alike in by_name.items():
            lines += ["", f"% {' '.join([name, *self._schemas[name].parameters])}"]
            locks = self._lock_forms(self._schemas[name])
            lines += (
                line for operator, use in alike for line in self._action(operator, use, locks)
            )
        return lines

    def _action(
        self, operator: SasOperator, use: NumericUse, locks: Sequence[ListForm]
    ) -> Iterator[str]:
        name, *objects = operator.name.split()
        who = f"{self._actuators.of(objects)},{self._names.term(name, objects)}"
        yield f"action({who})."
        if use.cost != 1:
            yield f"costs({who},{use.cost})."
        for assignment in operator.preconditions:
            yield f"needs({who},{self._pair(*assignment)})."
        for assignment in operator.exclusions:
            yield f"needs_other({who},{self._pair(*assignment)})."
        for number, effect in enumerate(operator.effects, 1):
            target = self._pair(effect.variable, effect.value)
            if not effect.conditions:
                yield f"sets({who},{target})."
                continue
            yield f"sets_if({who},{number},{target})."
            for assignment in effect.conditions:
                yield f"condition({who},{number},{self._pair(*assignment)})."
        for verb, changes in (
            ("needs_least", use.needs), ("needs_most", use.most), ("uses", use.uses),
            ("gives", use.gives), ("sets", use.sets),
        ):  # fmt: skip
            for number_name, amount in changes.items():
                yield f"{verb}({who},{self._term(number_name)},{amount})."
        for number_name in use.fills:
            yield f"fills({who},{self._term(number_name)})."
        atoms = [ground_atom(form, self._schemas[name], objects) for form in locks]
        for atom in dict.fromkeys(atoms):
            yield f"occupies({who},{self._term(atom)})."

    def _lock_forms(self, schema: ActionSchema) -> List[ListForm]:
        """Returns the facts that an action locks, because it changes them while it lasts."""
        forms = [form for form in schema.precondition.forms() if form.head in self._locks]
        return [*forms, *schema.locks]

    def _term(self, name: Name) -> str:
        return self._names.term(name[0], name[1:])

    def _pair(self, variable: int, value: int) -> str:
        one = self._variables[variable]
        return f"{one.name},{one.values[value]}"

    def phrases(self) -> List[str]:
        """Returns how actions and facts are called where a plan is explained."""
        patterns: Dict[str, Optional[str]] = {GOAL: "the problem's goal is to be met"}
        for schema in self._schemas.values():
            parameters = [_variable(each) for each in schema.parameters]
            patterns.update([self._phrase(schema.name, parameters)])
        for variable in self._variables:
            for atom in variable.atoms:
                if atom is not None:
                    places = [f"X{number}" for number, _ in enumerate(atom.objects, 1)]
                    pattern, words = self._phrase(atom.predicate, places)
                    patterns.setdefault(pattern, words)
                    patterns.setdefault(f"-{pattern}", f"{words} does not hold")
        return [f'phrase("{pattern}", "{words}").' for pattern, words in patterns.items()]

    def _phrase(self, name: str, parameters: Sequence[str]) -> Tuple[str, str]:
        term = self._names.term(name)
        pattern = f"{term}({','.join(parameters)})" if parameters else term
        return pattern, " ".join([name, *parameters])


def _test(atom: str) -> Name:
    """Returns the name and the objects of a test of numbers, by its atom."""
    found = read_atom(atom)
    assert found is not None
    return (found.predicate, *found.objects)


def _variable(parameter: str) -> str:
    return "X" + "".join(each if each.isalnum() else "_" for each in parameter[1:])
