"""Static analysis of an encoding."""

from __future__ import annotations

import difflib
import os
from dataclasses import dataclass, field
from typing import Callable, Dict, FrozenSet, Iterator, List, Mapping, Set, Tuple, Type

from clingo import ast

from rosclingo.solver import ways
from rosclingo.solver.options import Options
from rosclingo.solver.programs import Program, parse_files
from rosclingo.wire.term_text import split_term
from rosoclingo.encodings.alphabet import Alphabet
from rosoclingo.loop.planner.demand import Pair
from rosoclingo.loop.planner.task_search import LIBRARY_PARTS, TASK
from rosoclingo.loop.single.dialects import Dialect1, Dialect2, PaperDialect
from rosoclingo.loop.values.ids import RESERVED, is_own, why_no_actuator, why_no_slot
from rosoclingo.tools.check.findings import Finding
from rosoclingo.tools.check.functors import UnmatchedFunction, unmatched_functions
from rosoclingo.why.doubts import DOUBTS, OBSTACLES
from rosoclingo.why.rules import idle_names

Signature = Tuple[str, int]

_PARTS: Mapping[Type[Dialect2], FrozenSet[Signature]] = {
    Dialect2: frozenset(
        {("state", 1), ("transition", 1), ("query", 1), ("event", 2), ("event", 3), ("search", 2),
         ("improve", 2), ("prefer", 2), ("relax", 2), ("at_once", 2)}
    ),
    Dialect1: frozenset(
        {("state", 1), ("transition", 1), ("query", 1), ("set_event", 3), ("commit", 3),
         ("finalize", 1)}
    ),
    PaperDialect: frozenset({("transition", 1), ("query", 1)}),
}  # fmt: skip
_LAYERS = frozenset({("layer", 2), ("goal", 2)})  # grounded if an encoding has both
_TASK = frozenset(
    {("facts", 0), ("task", 1), ("gather", 1), ("planned", 2)}
)  # then, if it shows its task
_FOR_WHY = frozenset(  # docs/why.md
    {("phrases", 0), ("possible", 1), (DOUBTS, 1), (OBSTACLES, 1)}
)
_FOR_ROSOCLINGO = frozenset(  # what it reads, shown or not, and what is reported as not shown
    {("rslot", 1), ("id", 1), ("do", 3), ("occurs", 3), ("status", 3), ("holds", 2), ("phrase", 2),
     ("possible", 2), ("abort", 2), ("doubt", 2)}
)  # fmt: skip
_OWN = "rosoclingo_"
_LIBRARY = "lib"  # a folder with this name has libraries
_SHARED = frozenset(  # an encoding may add to these of a library
    {("rslot", 1), ("place", 1), ("actuator", 1), ("event", 2), ("event", 3), ("phrase", 2),
     ("began", 2), ("finishes", 4), ("ground", 1), ("surprise", 1)}
)  # fmt: skip


@dataclass
class Written:
    """The content of an encoding's statements.

    Attributes:
        parts: Where each program part begins, but for base.
        asked: The parts that the encoding requests by ``ground(P)``, or in other terms.
        choices: The names of atoms that are choices, by ``choices(F,I)``.
        used: Where each predicate is used first in a body.
        defined: Where each predicate is defined first, be it by a rule or as an external.
        own: Where each predicate is defined first, in each file.
        derived: Where each predicate is derived first, by a rule that is no fact.
        declared: The predicates that are said to be defined elsewhere.
        shown: What is shown, of each predicate; None if all is.
        has_script: Whether there is a script, which may use anything.
        externals: Where externals are declared, with their part and what the step has to be.
    """

    parts: Dict[Signature, str] = field(default_factory=dict)
    asked: Set[Signature] = field(default_factory=set)
    choices: Set[str] = field(default_factory=set)
    used: Dict[Signature, str] = field(default_factory=dict)
    defined: Dict[Signature, str] = field(default_factory=dict)
    own: Dict[Tuple[str, Signature], str] = field(default_factory=dict)
    derived: Dict[Signature, str] = field(default_factory=dict)
    declared: Set[Signature] = field(default_factory=set)
    shown: Set[Signature] = field(default_factory=set)
    shows_some: bool = False
    has_script: bool = False
    externals: List[Tuple[ast.AST, str]] = field(default_factory=list)


def look(options: Options, dialect: Type[Dialect2], alphabet: Alphabet) -> List[Finding]:
    """Returns the static findings in the encodings of a command line.

    Args:
        options: The command line.
        dialect: The encodings' dialect.
        alphabet: What they declare.
    """
    program = parse_files(options.files)
    seen = _Reader().read(program)
    findings = [*map(_never_true, unmatched_functions(program)), *_idle_names(program)]
    for check in (_parts, _undefined, _unused, _shown, _own_names, _library_names):
        findings += check(seen, dialect, alphabet)
    findings += _constraints(program)
    for other in (_slots, _steps):
        findings += other(seen, alphabet)
    return findings


def _parts(seen: Written, dialect: Type[Dialect2], _: Alphabet) -> Iterator[Finding]:
    known = _PARTS[dialect] | _FOR_WHY | seen.asked
    if dialect is Dialect2 and seen.parts.keys() >= _LAYERS:
        known |= _LAYERS | _TASK
    for (name, arity), place in seen.parts.items():
        if (name, arity) in known:
            continue
        others = [other for other in known if other[0] == name]
        why = (
            f"it has {arity} parameters, and rosoclingo grounds it with {others[0][1]}"
            if others
            else ("neither rosoclingo nor the encoding grounds it")
        )
        yield Finding("parts", f"the part {name}/{arity} is of no use: {why}", place)


def _constraints(program: Program) -> Iterator[Finding]:
    """Yields a hint where additions to the library for actions leave planning to clingo."""
    if TASK not in program.parts:
        return
    for name, arity in sorted(LIBRARY_PARTS):
        files = program.parts.get((name, arity), set())
        if len(files) > 1:
            yield Finding(
                "layers",
                f"the encoding adds to the part {name}/{arity} of the library for actions: its "
                "plans come from clingo alone then, which may take much longer",
                is_hint=True,
            )


def _undefined(seen: Written, *_: object) -> Iterator[Finding]:
    for (name, arity), place in seen.used.items():
        if (name, arity) not in seen.defined and (name, arity) not in seen.declared:
            yield Finding(
                "predicates",
                f"{name}/{arity} is used, and no rule, fact or external defines it; if that is "
                f"meant, say #defined {name}/{arity}.",
                place,
            )


def _never_true(unmatched: UnmatchedFunction) -> Finding:
    (name, arity), meant = unmatched.functor, unmatched.meant
    what = f"{name}/{arity}" if arity else name
    like = "" if meant is None else f"; is {meant[0]}{f'/{arity}' if arity else ''} meant?"
    predicate = f"{unmatched.atom.name}/{len(unmatched.atom.arguments)}"
    text = f"no rule, fact or external makes {predicate} true with {what} in it"
    if not unmatched.is_used:
        text = f"{predicate} is made true with {what} in it, and nothing uses that"
    return Finding(
        "predicates" if unmatched.is_used else "unused",
        f"{unmatched.atom}: {text}{like}",
        place(unmatched.atom),
        is_hint=not unmatched.is_used,
    )


def _idle_names(program: Program) -> Iterator[Finding]:
    for path, line in idle_names(program):
        yield Finding(
            "unused",
            "the comment %! names no constraint: it has to be directly above one",
            f"{os.path.relpath(path)}:{line}",
            is_hint=True,
        )


def _unused(seen: Written, *_: object) -> Iterator[Finding]:
    """Yields derived predicates without a use; facts may be for pictures, or for other files."""
    if seen.has_script or not seen.shows_some:
        return
    known = seen.used.keys() | seen.shown | seen.declared | _FOR_ROSOCLINGO
    for (name, arity), place in seen.derived.items():
        if (name, arity) in known:
            continue
        others = [other for other, number in seen.used if number == arity]
        like = difflib.get_close_matches(name, others, 1)
        meant = f"; is {like[0]}/{arity} meant?" if like else ""
        yield Finding(
            "unused",
            f"{name}/{arity} is defined by rules, and nothing uses it{meant}",
            place,
            is_hint=True,
        )


def _shown(seen: Written, dialect: Type[Dialect2], alphabet: Alphabet) -> Iterator[Finding]:
    if not seen.shows_some:
        return
    action = "occurs" if dialect is PaperDialect else "do"
    wanted = {(action, 3): "actions", ("status", 3): "statuses"}
    if alphabet.can_be_saved and dialect is Dialect2:
        wanted["holds", 2] = "what holds, which a reset keeps"
    for (name, arity), what in wanted.items():
        if (name, arity) in seen.shown:
            continue
        if (name, arity) in seen.defined or name == "holds":
            yield Finding(
                "shown",
                f"{name}/{arity} is not shown, so that rosoclingo does not see {what}; add "
                f"#show {name}/{arity}.",
                seen.defined.get((name, arity), ""),
            )


def _own_names(seen: Written, _: object, alphabet: Alphabet) -> Iterator[Finding]:
    for (name, arity), place in {**seen.used, **seen.defined}.items():
        if name.startswith(_OWN):
            yield Finding("names", f"{name}/{arity}: names with {_OWN} are rosoclingo's own", place)
    for (name, _), place in seen.parts.items():
        if name.startswith(_OWN):
            yield Finding("names", f"part {name}: names with {_OWN} are rosoclingo's own", place)
    reasons = [
        *map(why_no_slot, alphabet.slots),
        *(why_no_actuator(name, alphabet.slots) for name in sorted(alphabet.actuators)),
    ]
    for reason in filter(None, reasons):
        yield Finding("names", reason)
    later: Set[Pair] = set().union(*(pairs for step, pairs in alphabet.by_step.items() if step))
    for source, content in sorted(later):
        is_commit = source == "commit" and split_term(content)[0] == "do"
        if source in ("commit", "save") and not is_commit:
            yield Finding(
                "names",
                f"event({source},{content},t) never happens after step 0: {source} "
                f"{RESERVED[source]}, and messages of this source are dropped",
                _place_of(seen, source),
                is_hint=True,
            )
            break


def _library_names(seen: Written, *_: object) -> Iterator[Finding]:
    """Yields predicates of a library that another file derives, too."""
    names: Dict[Signature, str] = {}
    for (file, signature), place in seen.own.items():
        if _is_library(file) and signature not in seen.declared | _SHARED:
            names[signature] = place
    for (file, signature), place in seen.own.items():
        if signature in names and not _is_library(file):
            name, arity = signature
            yield Finding(
                "names",
                f"{name}/{arity} is a name of the library's own ({names[signature]}): use another",
                place,
                is_hint=True,
            )


def _is_library(file: str) -> bool:
    return os.path.basename(os.path.dirname(os.path.abspath(file))) == _LIBRARY


def _slots(seen: Written, alphabet: Alphabet) -> Iterator[Finding]:
    has_slot = ("rslot", 1) in seen.defined or ("id", 1) in seen.defined
    if has_slot and not alphabet.slots:
        yield Finding("slots", "there is no slot: rslot/1 is defined, and holds for nothing")
    for slot in alphabet.slots:
        if slot not in alphabet.cancels and alphabet.requests:
            yield Finding(
                "slots", f"the goal in slot {slot} cannot be cancelled: no #external "
                f"event({slot},cancel,t) is declared",
            )  # fmt: skip
    if alphabet.slots and not alphabet.requests:
        yield Finding("slots", "there are slots, and no request is declared for them")
    if not alphabet.slots and any(source.isdigit() for source, _ in alphabet.messages):
        yield Finding("slots", "requests are declared, and no slot for them: rslot(ID)")
    for pairs in [alphabet.by_step[step] for step in list(alphabet.by_step)[-1:]]:
        yield from _uneven_slots(pairs, alphabet)


def _uneven_slots(pairs: FrozenSet[Pair], alphabet: Alphabet) -> Iterator[Finding]:
    for slot in alphabet.slots:
        for request in alphabet.requests:
            if (slot, request) not in pairs:
                yield Finding(
                    "slots", f"the request {request} is declared for other slots, and not for "
                    f"slot {slot}: a goal gets the first one that is free; the id of a slot "
                    "cannot be that of an actuator or of another source, too",
                )  # fmt: skip
                break


def _steps(seen: Written, alphabet: Alphabet) -> Iterator[Finding]:
    """Yields events that some steps lack; step 0 may lack answers to actions."""
    steps = [step for step in alphabet.by_step if step > 0]
    all_pairs: Set[Pair] = set().union(*(alphabet.by_step[step] for step in steps))
    first = alphabet.by_step.get(0)
    told: Set[str] = set()
    for source, content in sorted(pair for pair in all_pairs if not is_own(*pair)):
        lacks = [step for step in steps if (source, content) not in alphabet.by_step[step]]
        request = source in alphabet.slots
        if first is not None and request and (source, content) not in first:
            lacks = [0, *lacks]
        if lacks and source not in told:
            told.add(source)  # one of each source is enough
            number = ", ".join(map(str, lacks))
            yield Finding(
                "steps",
                f"event({source},{content},t) is declared in some steps only, and not in step "
                f"{number}: what comes then is dropped",
                _place_of(seen, source),
            )


def _place_of(seen: Written, source: str) -> str:
    """Returns where events of a source are declared, preferably with a condition on the step."""
    places = []
    for external, part in seen.externals:
        text = str(external)
        if not text.startswith("#external event("):
            continue
        depends = any(" t " in f" {literal} " for literal in external.body)
        places.append(
            (f"event({source}," not in text, not depends, part != "state", place(external))
        )
    return min(places)[-1] if places else ""


def place(statement: ast.AST) -> str:
    """Returns where a statement begins, as ``FILE:LINE``, seen from the working directory."""
    begin = statement.location.begin
    return f"{os.path.relpath(begin.filename)}:{begin.line}"


class _Reader(ast.Transformer):
    """Visits statements, and sorts predicates into heads and bodies."""

    def __init__(self) -> None:
        self._seen = Written()
        self._add: Callable[[Signature, ast.AST], None] = self._use
        self._part = "base"
        self._is_derived = False

    def read(self, program: Program) -> Written:
        """Returns the content of the statements."""
        for statement in program.statements:
            kind = statement.ast_type.name
            getattr(self, f"_on_{kind.lower()}", self._in_body)(statement)
        seen = self._seen
        seen.asked.update(each for each in seen.shown if each[0] in seen.choices)
        return seen

    def _use(self, signature: Signature, atom: ast.AST) -> None:
        self._seen.used.setdefault(signature, place(atom))

    def _define(self, signature: Signature, atom: ast.AST) -> None:
        self._seen.defined.setdefault(signature, place(atom))
        self._seen.own.setdefault((atom.location.begin.filename, signature), place(atom))
        if self._is_derived:
            self._seen.derived.setdefault(signature, place(atom))

    def _on_program(self, statement: ast.AST) -> None:
        self._part = statement.name
        if statement.name != "base":
            signature = (statement.name, len(statement.parameters))
            self._seen.parts.setdefault(signature, place(statement))

    def _on_rule(self, rule: ast.AST) -> None:
        self._is_derived = bool(rule.body) or rule.head.ast_type is not ast.ASTType.Literal
        self._in_head(rule.head)
        self._is_derived = False
        self._in_body_of(rule)

    def _on_script(self, _: ast.AST) -> None:
        self._seen.has_script = True

    def _on_external(self, external: ast.AST) -> None:
        self._seen.externals.append((external, self._part))
        self._in_head(external.atom)
        self._asks(external.atom.symbol)
        self._in_body_of(external)

    def _on_showterm(self, statement: ast.AST) -> None:
        self._seen.shows_some = True
        self._asks(statement.term)
        if ("layers_with", 2) in signatures(statement.term):
            self._seen.asked.add((str(statement.term.arguments[1]), 2))
        if ("choices", 2) in signatures(statement.term):
            self._seen.choices.add(str(statement.term.arguments[0]))
        for name, arity in signatures(statement.term):
            self._seen.shown.add((name, arity))
        self._in_body_of(statement)

    def _on_showsignature(self, statement: ast.AST) -> None:
        self._seen.shows_some = True
        self._seen.shown.add((statement.name, statement.arity))

    def _on_defined(self, statement: ast.AST) -> None:
        self._seen.declared.add((statement.name, statement.arity))

    def _asks(self, term: ast.AST) -> None:
        """Records the part that a term ``ground(P)`` or ``ground_last(P)`` requests."""
        if {("ground", 1), ("ground_last", 1)} & set(signatures(term)):
            self._seen.asked.update(signatures(term.arguments[0]))

    def _in_head(self, head: ast.AST) -> None:
        if head.ast_type is ast.ASTType.Literal or head.ast_type is ast.ASTType.SymbolicAtom:
            self._with(self._define, head)
            return
        elements = getattr(head, "elements", ())
        for element in elements:
            literal = getattr(element, "literal", None)
            conditions = getattr(element, "condition", ())
            if literal is not None and literal.ast_type is ast.ASTType.ConditionalLiteral:
                literal, conditions = literal.literal, [*literal.condition, *conditions]
            if literal is not None:
                self._with(self._define, literal)
            for condition in conditions:
                self._with(self._use, condition)

    def _in_body_of(self, statement: ast.AST) -> None:
        for literal in statement.body:
            self._with(self._use, literal)

    def _in_body(self, statement: ast.AST) -> None:
        self._with(self._use, statement)

    def _with(self, add: Callable[[Signature, ast.AST], None], node: ast.AST) -> None:
        self._add = add
        self(node)

    def visit_SymbolicAtom(self, atom: ast.AST) -> ast.AST:  # noqa: N802 (clingo's name)
        for signature in signatures(atom.symbol):
            self._add(signature, atom.symbol)
        self.visit_children(atom)
        return atom

    def visit_Function(self, term: ast.AST) -> ast.AST:  # noqa: N802 (clingo's name)
        if term.external and term.name in (ways.DISTANCE, ways.ROUTE) and term.arguments:
            for name, _ in signatures(term.arguments[0]):
                self._use((name, ways.ARITY), term)
        self.visit_children(term)
        return term


def signatures(term: ast.AST) -> List[Signature]:
    """Returns name and number of arguments of a term, or of those that a pool stands for."""
    if term.ast_type is ast.ASTType.Function:
        return [(term.name, len(term.arguments))]
    if term.ast_type is ast.ASTType.SymbolicTerm and str(term).isidentifier():
        return [(str(term), 0)]
    if term.ast_type is ast.ASTType.Pool:
        return [one for argument in term.arguments for one in signatures(argument)]
    if term.ast_type is ast.ASTType.UnaryOperation:
        return signatures(term.argument)
    return []
