"""The inputs that an encoding declares: requests, answers, messages.

>>> from rosclingo.solver.options import Options
>>> from rosoclingo.in_process.parts import EXAMPLES
>>> alphabet = read_alphabet(Options((f"{EXAMPLES}/line_demand.lp",)))
>>> alphabet.requests[:2], alphabet.answers, alphabet.messages[:1]
(('visit(1)', 'visit(2)'), {'robot': ('failure', 'success')}, (('info', 'close(1)'),))
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Dict, FrozenSet, List, Mapping, Sequence, Set, Tuple

import clingo
from clingo import ast

from rosclingo.solver.controls import ClingoMessages, new_control
from rosclingo.solver.options import Options
from rosclingo.solver.programs import Program, parse_files
from rosclingo.solver.theories import make_theory
from rosclingo.wire.term_text import last_number, number, split_term
from rosoclingo.in_process.parts import SINGLE, make_parts
from rosoclingo.loop.planner.demand import Pair
from rosoclingo.loop.planner.planner import Planner
from rosoclingo.loop.planner.vocabulary import ANY_EVENT
from rosoclingo.loop.values.ids import is_own
from rosoclingo.loop.words import BUSY, INFO, SUCCESS

_STEPS = (1, 2, 3)  # those that are grounded, and compared
_HAPPENS = "rosoclingo_check_event"


@dataclass(frozen=True)
class Alphabet:
    """The inputs that an encoding declares.

    Attributes:
        slots: The ids for goals.
        actuators: The ids of actuators: those that may answer ``success``, or have actions that are
            committed.
        requests: The requests that each slot takes, which may be none.
        cancels: The slots whose goals can be cancelled.
        answers: For each actuator, what it may answer.
        messages: Source and value of each message that answers no action.
        can_be_saved: Whether it can be told what held at a reset.
        by_step: For each step from 0 on, the events that it declares, if it does so for each step.
    """

    slots: Tuple[str, ...] = ()
    actuators: FrozenSet[str] = frozenset()
    requests: Tuple[str, ...] = ()
    cancels: FrozenSet[str] = frozenset()
    answers: Mapping[str, Tuple[str, ...]] = field(default_factory=dict)
    messages: Tuple[Pair, ...] = ()
    can_be_saved: bool = False
    by_step: Mapping[int, FrozenSet[Pair]] = field(default_factory=dict)

    @property
    def failures(self) -> List[Pair]:
        """Each actuator with each of its answers but ``success``."""
        return [
            (actuator, answer)
            for actuator, answers in sorted(self.answers.items())
            for answer in answers
            if answer != SUCCESS
        ]


def read_alphabet(options: Options) -> Alphabet:
    """Reads the inputs that the encodings of a command line declare.

    Raises:
        RosclingoError: They do not parse, or cannot be grounded.
    """
    planner = Planner(make_parts(SINGLE, options).planner)
    slots = planner.begin()
    told = planner.demand.tells
    by_step: Dict[int, Set[Pair]] = {}
    if told:
        declared = _told_events(parse_files(options.files), options)
    else:
        planner.ground_steps(_STEPS)
        for atom in planner.externals():
            name, arguments = split_term(atom)
            step = last_number(atom)
            if name == "event" and len(arguments) == 3 and step is not None:
                by_step.setdefault(step, set()).add((arguments[0], arguments[1]))
        by_step = {step: pairs for step, pairs in by_step.items() if step in (0, *_STEPS)}
        declared = set().union(*by_step.values()) if by_step else set()
    declared = {pair for pair in declared if ",".join(pair) != ANY_EVENT}
    return _sorted(declared, slots, told, by_step)


def _sorted(
    declared: Set[Pair], slots: Sequence[str], told: bool, by_step: Mapping[int, Set[Pair]]
) -> Alphabet:
    requests, cancels = set(), set()
    answers: Dict[str, List[str]] = {}
    messages = []
    actuators = {source for source, content in declared if content == SUCCESS} - {INFO}
    actuators |= {actor for source, content in declared for actor in _committed(source, content)}
    for source, content in sorted(declared, key=_in_order):
        if source in slots and content == "cancel":
            cancels.add(source)
        elif source in slots:
            requests.add(content)
        elif source in actuators:
            if content != BUSY:  # which rosoclingo says itself
                answers.setdefault(source, []).append(content)
        elif not is_own(source, content):
            messages.append((source, content))
    return Alphabet(
        slots=tuple(slots),
        actuators=frozenset(actuators),
        requests=tuple(sorted(requests, key=_in_order)),
        cancels=frozenset(cancels),
        answers={actuator: tuple(values) for actuator, values in answers.items()},
        messages=tuple(messages),
        can_be_saved=told or any(source == "save" for source, _ in declared),
        by_step={step: frozenset(pairs) for step, pairs in sorted(by_step.items())},
    )


def _committed(source: str, content: str) -> Sequence[str]:
    """Returns the actuator in a ``commit`` event, which says that an action was published."""
    name, arguments = split_term(content)
    is_commit = source == "commit" and (name, len(arguments)) == ("do", 2)
    return arguments[:1] if is_commit else ()


def _in_order(term: Any) -> Any:
    """Sorts terms, with numbers by size."""
    if not isinstance(term, str):
        return [_in_order(one) for one in term]
    name, arguments = split_term(term)
    value = number(term)
    if value is not None:
        return (0, value, "", [])
    return (1, 0, name or term, [_in_order(one) for one in arguments] if name != term else [])


def _told_events(program: Program, options: Options) -> Set[Pair]:
    """Returns the events that an encoding with the part ``event(s,c)`` declares.

    The parameters of that part become variables, and its externals rules.
    """
    statements: List[ast.AST] = []
    part, parameters = "base", []
    for statement in program.statements:
        if statement.ast_type is ast.ASTType.Program:
            part, parameters = statement.name, [p.name for p in statement.parameters]
        own = part == "event" and len(parameters) == 2
        if own and statement.ast_type is ast.ASTType.External:
            statements.append(_rule(statement, parameters))
    return _happening(program, statements, options)


def _happening(program: Program, rules: Sequence[ast.AST], options: Options) -> Set[Pair]:
    control = new_control(options.clingo, ClingoMessages())
    theory = make_theory(options.theory)
    theory.register(control)
    program.add_to(control, theory)
    try:
        with ast.ProgramBuilder(control) as builder:
            builder.add(ast.Program(program.statements[0].location, "base", []))
            for rule in rules:
                builder.add(rule)
        control.ground([("base", [])])
    except RuntimeError:  # one is unsafe without the parameters' values: only that is left out
        if len(rules) == 1:
            return set()
        return set().union(*(_happening(program, [one], options) for one in rules))
    atoms = control.symbolic_atoms.by_signature(_HAPPENS, 2)
    pairs = (atom.symbol.arguments for atom in atoms)
    return {(str(source), str(content)) for source, content in pairs}


def _rule(external: ast.AST, parameters: Sequence[str]) -> ast.AST:
    variables = _Variables(dict(zip(parameters, ("RosoclingoS", "RosoclingoC"))))
    place = external.location
    head = ast.Function(
        place, _HAPPENS, [variables.visit(one) for one in external.atom.symbol.arguments], 0
    )
    atom = ast.Literal(place, ast.Sign.NoSign, ast.SymbolicAtom(head))
    return ast.Rule(place, atom, [variables.visit(literal) for literal in external.body])


class _Variables(ast.Transformer):
    """Replaces a part's parameters by variables."""

    def __init__(self, names: Mapping[str, str]) -> None:
        self._names = names

    def visit_SymbolicTerm(self, term: ast.AST) -> ast.AST:  # noqa: N802 (clingo's name)
        symbol = term.symbol
        if symbol.type is clingo.SymbolType.Function and not symbol.arguments:
            name = self._names.get(symbol.name)
            if name is not None:
                return ast.Variable(term.location, name)
        return term

    def visit_Function(self, term: ast.AST) -> ast.AST:  # noqa: N802 (clingo's name)
        name = None if term.arguments else self._names.get(term.name)
        return (
            term.update(**self.visit_children(term))
            if name is None
            else ast.Variable(term.location, name)
        )
