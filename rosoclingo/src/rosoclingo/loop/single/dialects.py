"""The three dialects of encodings that the one-node system knows.

See docs/protocol.md, section "Dialects", for what each declares.

The loop speaks the dialect of ROSoClingo 2.0. For the other two, a class here stands between the
loop and the solver and translates, so that neither knows of the other.
"""

from __future__ import annotations

import abc
import dataclasses
import re
from typing import Any, List, Sequence, Set, Type

from clingo import ast

from rosclingo.errors import OptionsError
from rosclingo.solver.options import Options
from rosclingo.solver.programs import parse_files
from rosclingo.wire import commands as wire
from rosclingo.wire.term_text import split_term
from rosoclingo.loop.planner.vocabulary import ANY_EVENT
from rosoclingo.loop.values.added import HAS, SLOT
from rosoclingo.loop.values.atoms import EVENT, PASSED, QUERY, event
from rosoclingo.loop.values.solver import Forwarding, Solver

_ANY_ATOM = f"{EVENT}{ANY_EVENT},"
_HORIZON = "horizon("
_PARTS_1_0 = frozenset({("set_event", 3), ("commit", 3), ("finalize", 1)})


class Dialect2(Forwarding):
    """The dialect of ROSoClingo 2.0: nothing to translate.

    Attributes:
        name: What the dialect is called.
        first_step: The step to which the first goal belongs.
        events_are_facts: Whether an event that was made true stays so.
    """

    name = "2.0"
    first_step = 0
    events_are_facts = False


class _Translation(Dialect2, abc.ABC):
    """Base class of the two older dialects, in which the past is told by grounding program parts.

    The loop uses externals of the dialect 2.0 that encodings of these do not have. Those are
    answered for here.

    Attributes:
        acts: The part that says that an action was published.
        passes: The part that says that a step has gone by.
    """

    first_step = 1
    events_are_facts = True
    acts = passes = ""

    def __init__(self, solver: Solver) -> None:
        super().__init__(solver)
        self._open: Set[str] = set()  # steps that are grounded and have not gone by

    def run(self, commands: Sequence[wire.Command]) -> wire.Reply:
        """Runs commands in order until one fails; what ran before that stays."""
        answers: List[Any] = []
        for index, command in enumerate(commands):
            reply = self._solver.run(self._translate(command))
            if reply.failure is not None:
                return wire.Reply(tuple(answers), dataclasses.replace(reply.failure, index=index))
            answers += reply.answers
            if isinstance(command, wire.GetExternals):
                answers[-1] = self._translate_back(answers[-1])
        return wire.Reply(tuple(answers))

    def _translate(self, command: wire.Command) -> List[wire.Command]:
        if isinstance(command, wire.Restart):
            self._open.clear()
        elif isinstance(command, wire.Ground):
            transitions = [part for part in command.parts if part.name == "transition"]
            self._open.update(part.parameters[0] for part in transitions)
        elif isinstance(command, wire.ReleaseExternal):
            virtual = command.name.startswith((_ANY_ATOM, PASSED))
            return [] if virtual else [command]
        elif isinstance(command, wire.AssignExternal) and command.name.startswith(EVENT):
            return self._tell(command)
        return [command]

    def _tell(self, command: wire.AssignExternal) -> List[wire.Command]:
        source, content, step = split_term(command.name)[1]
        if command.value is not wire.Truth.TRUE:
            return []  # what has happened has happened, and nothing else is true
        if command.name.startswith(PASSED):
            is_open = step in self._open
            self._open.discard(step)
            return [_grounding(self.passes, step)] if is_open else []
        if source == "commit":
            actuator, action = split_term(content)[1]
            return [_grounding(self.acts, actuator, action, step)]
        return [self._happens(source, content, step)]

    def _translate_back(self, externals: wire.Externals) -> wire.Externals:
        virtual = (
            (atom, wire.Truth.FALSE) for step in sorted(self._open) for atom in self._virtual(step)
        )
        return wire.Externals((*externals.values, *virtual))

    def _virtual(self, step: str) -> List[str]:
        """Returns the externals of an open step that the encoding does not have."""
        return [event("info", "passed", int(step))]

    @abc.abstractmethod
    def _happens(self, source: str, content: str, step: str) -> wire.Command:
        """Returns the commands that tell an event."""


class Dialect1(_Translation):
    """The dialect of ROSoClingo 1.0: programs ``set_event``, ``commit`` and ``finalize``.

    Any message is an event, because ``set_event`` takes it. But of a source for which the encoding
    declares externals, only these are: so a request that makes no sense is rejected.
    """

    name = "1.0"
    acts, passes = "commit", "finalize"

    def _virtual(self, step: str) -> List[str]:
        return [*super()._virtual(step), f"{_ANY_ATOM}{step})"]

    def _happens(self, source: str, content: str, step: str) -> wire.Command:
        return _grounding("set_event", source, content, step)


class PaperDialect(_Translation):
    """The dialect of the paper: ``occurs/3``, ``horizon(t)``, and requests with ``id(ID)``.

    An encoding of it does not know of actions that are published, or of steps that have gone by.
    So constraints see to it that what was done stays in the plan, and nothing is added to it.
    """

    name = "paper"
    acts, passes = "rosoclingo_commit", "rosoclingo_pass"
    _RULES = (
        wire.Add("base", (), "#defined id/1. rslot(ID) :- id(ID)."),
        wire.Add(
            acts,
            ("r", "a", "t"),
            "rosoclingo_committed(r,a,t). :- not occurs(r,a,t).",
        ),
        wire.Add(
            passes,
            ("t",),
            "#defined occurs/3. #defined rosoclingo_committed/3."
            ":- occurs(R,A,t), not rosoclingo_committed(R,A,t).",
        ),
    )

    def __init__(self, solver: Solver) -> None:
        super().__init__(solver)
        self._slots: Set[str] = set()

    def _found(self, outcome: wire.Outcome) -> wire.Outcome:
        symbols = (f"do{s[6:]}" if s.startswith("occurs(") else s for s in outcome.symbols)
        return dataclasses.replace(outcome, symbols=tuple(symbols))

    def _translate(self, command: wire.Command) -> List[wire.Command]:
        if isinstance(command, wire.Restart):
            return [*super()._translate(command), *self._RULES]
        if isinstance(command, wire.Add) and HAS in command.program:
            text = command.program.replace("do/3", "occurs/3").replace(" do(", " occurs(")
            return [dataclasses.replace(command, program=text)]
        if isinstance(command, wire.Ground):
            parts = tuple(p for p in command.parts if p.name != "state" and p.parameters != ("0",))
            super()._translate(command)
            return [wire.Ground(parts)]
        if isinstance(command, (wire.AssignExternal, wire.ReleaseExternal)):
            command = dataclasses.replace(command, name=self._name(command.name))
        return super()._translate(command)

    def _name(self, atom: str) -> str:
        """Returns the paper's name of an external of the dialect 2.0."""
        if atom.startswith(QUERY):
            return f"{_HORIZON}{atom[len(QUERY) :]}"
        if atom.startswith(EVENT):
            source, content, step = split_term(atom)[1]
            if source in self._slots:
                return f"event(request,({source},{content}),{step})"
        return atom

    def _translate_back(self, externals: wire.Externals) -> wire.Externals:
        translated = []
        for atom, value in super()._translate_back(externals).values:
            if atom.startswith(SLOT):
                self._slots.add(split_term(atom)[1][0])
            translated.append((self._name_back(atom), value))
        return wire.Externals(tuple(translated))

    def _name_back(self, atom: str) -> str:
        if atom.startswith(_HORIZON):
            return f"{QUERY}{atom[len(_HORIZON) :]}"
        name, arguments = split_term(atom)
        if name == "event" and arguments[:1] == ["request"] and len(arguments) == 3:
            name, request = split_term(arguments[1])
            if not name and len(request) == 2:
                return f"event({request[0]},{request[1]},{arguments[2]})"
        return atom

    def _happens(self, source: str, content: str, step: str) -> wire.Command:
        return wire.AssignExternal(event(source, content, int(step)), wire.Truth.TRUE)


def _grounding(part: str, *parameters: str) -> wire.Ground:
    return wire.Ground((wire.Part(part, parameters),))


def says_status(options: Options) -> bool:
    """Returns whether the encodings of a command line have rules for ``status/3``.

    Raises:
        RosclingoError: A file does not parse.
    """
    rules = (s for s in parse_files(options.files).statements if s.ast_type is ast.ASTType.Rule)
    return any(re.search(r"\bstatus\(", str(rule.head)) for rule in rules)


def detect(options: Options) -> Type[Dialect2]:
    """Returns the dialect of the encodings of a command line.

    Raises:
        OptionsError: They are of none, or not wholly of one.
        RosclingoError: A file does not parse.
    """
    program = parse_files(options.files)
    externals = (s.atom.symbol for s in program.statements if s.ast_type is ast.ASTType.External)
    declared = {(s.name, len(s.arguments)) for s in externals if s.ast_type is ast.ASTType.Function}
    missing = _PARTS_1_0 - program.parts.keys()
    if not missing:
        return Dialect1
    if ("set_event", 3) in program.parts or ("finalize", 1) in program.parts:
        raise OptionsError(
            f"{', '.join(options.files)}: an encoding of the dialect 1.0 has the programs "
            "set_event(id,e,t), commit(r,a,t) and finalize(t), and this one lacks "
            + " and ".join(sorted(f"{name}/{arity}" for name, arity in missing))
        )
    if ("horizon", 1) in declared:
        return PaperDialect
    if ("query", 1) in declared:
        return Dialect2
    raise OptionsError(
        f"{', '.join(options.files) or 'no file'}: there is no encoding of a known dialect; one "
        "declares #external horizon(t), or #external query(t), or the programs set_event(id,e,t), "
        "commit(r,a,t) and finalize(t); is a library missing, such as actions.lp?"
    )
