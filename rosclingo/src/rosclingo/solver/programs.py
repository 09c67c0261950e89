"""Logic programs: text to checked statements.

clingo keeps what it has parsed even when it is wrong, and refuses everything from then on. So a
program is parsed apart from the solver, checked, and handed over only when it is good.
"""

from __future__ import annotations

import os
import re
from dataclasses import dataclass, field
from typing import Callable, Dict, Iterable, Iterator, List, Optional, Sequence, Set, Tuple

import clingo
from clingo import ast

from rosclingo.errors import ForbiddenError, ProgramError
from rosclingo.solver import lexical, limits, scripts
from rosclingo.solver.controls import ClingoMessages, new_control
from rosclingo.solver.options import Options, constants
from rosclingo.solver.terms import quote
from rosclingo.solver.theories import Theory, make_theory

_IDENTIFIER = re.compile(r"[_']*[a-z][A-Za-z0-9_']*")


@dataclass(frozen=True)
class Policy:
    """Permissions of programs and files from clients; those of the command line are trusted.

    Attributes:
        allow_scripts: Whether ``#script`` blocks may run.
        load_path: The folders that files may come from, with all below them.
    """

    allow_scripts: bool = False
    load_path: Tuple[str, ...] = ()

    def check_file(self, path: str) -> None:
        """Raises ForbiddenError if the file, with symbolic links resolved, is outside."""
        real = os.path.realpath(path)
        for folder in self.load_path:
            inside = os.path.realpath(folder)
            if os.path.commonpath([real, inside]) == inside:
                return
        allowed = ", ".join(self.load_path) or "none"
        raise ForbiddenError(
            f"{quote(path)} is outside of the folders that files may be loaded from ({allowed}); "
            "the node's parameter ~load_path sets them"
        )


@dataclass
class Program:
    """A parsed program, with what matters beyond its own rules.

    Attributes:
        scripts: The scripts.
        statements: All other statements, in order.
        definitions: Those that other programs are checked with: constants and theories.
        headers: Those that begin a program part.
        parts: Name and number of parameters of each program part, with the files of its
            statements, but for those that only declare.
        texts: What was in each file, by its real path.
        named: The real paths of the files that were given, in order.
        includes: For each file, the real paths of what it includes, by how it names that.
        remarks: What is said of them.
        externals: Signatures of ``#external`` statements, as name, arity and sign; of those with
            pools in their atoms, not all.
        has_heuristics: Whether there is a ``#heuristic`` statement.
    """

    scripts: List[ast.AST] = field(default_factory=list)
    statements: List[ast.AST] = field(default_factory=list)
    definitions: List[ast.AST] = field(default_factory=list)
    headers: List[ast.AST] = field(default_factory=list)
    parts: Dict[Tuple[str, int], Set[str]] = field(default_factory=dict)
    texts: Dict[str, str] = field(default_factory=dict)
    named: List[str] = field(default_factory=list)
    includes: Dict[str, Dict[str, str]] = field(default_factory=dict)
    remarks: List[str] = field(default_factory=list)
    externals: Set[Tuple[str, int, bool]] = field(default_factory=set)
    has_heuristics: bool = False

    def add_to(
        self,
        control: clingo.Control,
        theory: Optional[Theory] = None,
        *,
        run_scripts: bool = True,
    ) -> None:
        """Adds the statements to a solver, which runs its scripts unless told not to.

        Args:
            control: The solver.
            theory: What extends it.
            run_scripts: Whether it runs its scripts.

        Raises:
            ProgramError: A script fails, or the theory cannot read an atom; then nothing was added.
        """
        statements = self.statements if theory is None else theory.rewritten(self.statements)
        try:
            with ast.ProgramBuilder(control) as builder:
                for statement in [*(self.scripts if run_scripts else ()), *statements]:
                    builder.add(statement)
        except RuntimeError as err:
            raise ProgramError(scripts.reason(str(err).strip())) from err


def parse_files(
    paths: Sequence[str], policy: Optional[Policy] = None, last: Optional[Program] = None
) -> Program:
    """Parses files and those that they include.

    Args:
        paths: The files.
        policy: What they may do; everything if None.
        last: What the same files gave before; returned if nothing in them has changed.

    Raises:
        ProgramError: A file does not parse; the message quotes file, line and column.
        ForbiddenError: The policy does not allow a file, an include or a script.
    """
    if not paths:  # clingo would read standard input
        return Program()
    sources = _Sources(policy)
    named = [sources.open(path) for path in paths]  # all before what they include, as clingo does
    for path in paths:
        sources.check_file(path)
    program = sources.program
    if last is not None and (last.texts, last.includes) == (program.texts, program.includes):
        return last
    program.named = named
    return _parse(lambda add, log: ast.parse_files(list(paths), add, logger=log), sources)


def parse_part(
    name: str, parameters: Sequence[str], text: str, policy: Optional[Policy] = None
) -> Program:
    """Parses a text as the program part ``name(parameters)``.

    Raises:
        ProgramError: The name, a parameter or the text is wrong; the message quotes line and
            column.
        ForbiddenError: The policy does not allow an include or a script.
    """
    for kind, identifier in [("program", name)] + [("parameter", p) for p in parameters]:
        if not _IDENTIFIER.fullmatch(identifier):
            raise ProgramError(
                f"{kind} name {identifier[:50]!r} is not an identifier; it begins with a lower-case"
                " letter and holds letters, digits and underscores"
            )
    sources = _Sources(policy)
    sources.check_text(text)
    program = _parse(lambda add, log: ast.parse_string(text, add, logger=log), sources)
    place = program.statements[0].location  # the "#program base." that clingo begins with
    identifiers = [ast.Id(place, parameter) for parameter in parameters]
    program.statements[0] = program.headers[0] = ast.Program(place, name, identifiers)
    program.parts.setdefault((name, len(parameters)), set())
    return program


def check(program: Program, known: Iterable[ast.AST], options: Options) -> None:
    """Checks that clingo accepts a program, without touching the solver that it is meant for.

    Args:
        program: The program.
        known: Constants and theories of the programs that the solver has already.
        options: The solver's command line, for the constants and the theory that it sets.

    Raises:
        OptionsError: clingo refuses an option.
        ProgramError: A variable is unsafe, a theory atom is not defined, a parameter is named like
            a constant, or the like; the message quotes line and column.
    """
    known = [*known]
    _check_parameters(program, known, options.clingo)
    messages = ClingoMessages()
    scratch = new_control(options.clingo, messages)
    theory = make_theory(options.theory)
    theory.register(scratch)
    Program(statements=[*known]).add_to(scratch)
    program.add_to(scratch, theory, run_scripts=False)
    _check_rules(scratch, messages, theory)


def add_checked(
    program: Program,
    control: clingo.Control,
    messages: ClingoMessages,
    theory: Theory,
    options: Options,
) -> None:
    """Adds a program to a solver that has none yet, and checks it there.

    Args:
        program: The program.
        control: The solver, which is of no more use if clingo does not accept the program.
        messages: Its messages.
        theory: What extends it.
        options: Its command line.

    Raises:
        OptionsError: As :func:`check`.
        ProgramError: As :func:`check`.
    """
    if program.scripts:  # which run as soon as they are added
        check(program, (), options)
        program.add_to(control, theory)
        return
    _check_parameters(program, (), options.clingo)
    program.add_to(control, theory)
    _check_rules(control, messages, theory)


def _check_rules(control: clingo.Control, messages: ClingoMessages, theory: Theory) -> None:
    try:
        # Grounding a part that nothing defines checks the rules and instantiates none.
        control.ground([("_rosclingo_check", [])])
    except RuntimeError as err:
        text = messages.text() or str(err)
        raise ProgramError(text + theory.remedy(text)) from err
    messages.text()  # of what a part defines that is not grounded here


def _check_parameters(program: Program, known: Sequence[ast.AST], options: Sequence[str]) -> None:
    """Checks that clingo replaces no parameter of a part by a constant, which it does silently."""
    names = {
        statement.name
        for statement in (*known, *program.definitions)
        if statement.ast_type is ast.ASTType.Definition
    }.union(constants(options))
    for statement in program.headers:
        for parameter in statement.parameters:
            if parameter.name in names:
                place = parameter.location.begin
                raise ProgramError(
                    f"{place.filename}:{place.line}:{place.column}: the parameter {parameter.name} "
                    f"of the program {statement.name} has the name of a constant, by which clingo "
                    "would replace it; rename one of them"
                )


def _parse(
    parser: Callable[[Callable[[ast.AST], None], ClingoMessages], None], sources: _Sources
) -> Program:
    messages, program = ClingoMessages(), sources.program
    part, place = ("base", 0), ""
    unseen = set(sources.opened.values())  # files without a statement until now

    def add(statement: ast.AST) -> None:
        nonlocal part, place
        kind = statement.ast_type
        # clingo's locations take long. A statement is of the file of the one before, unless it is
        # the first of an included file; where clingo comes back, it says "#program base" first.
        if unseen or kind is ast.ASTType.Program or not place:
            place = statement.location.begin.filename
            unseen.discard(place)
        if kind is ast.ASTType.Script:
            program.scripts.append(statement)
            return
        program.statements.append(statement)
        if kind is ast.ASTType.Program:
            program.headers.append(statement)
            part = statement.name, len(statement.parameters)
            program.parts.setdefault(part, set())
        elif kind is not ast.ASTType.Defined:
            program.parts.setdefault(part, set()).add(place)
        if kind in (ast.ASTType.Definition, ast.ASTType.TheoryDefinition):
            program.definitions.append(statement)
        elif kind is ast.ASTType.External:
            program.externals.update(_signature(statement.atom.symbol))
        elif kind is ast.ASTType.Heuristic:
            program.has_heuristics = True

    try:
        parser(add, messages)
    except RuntimeError as err:
        raise ProgramError(messages.text() or str(err)) from err
    except UnicodeError as err:
        raise ProgramError(f"the program is not valid Unicode: {err}") from err
    if program.scripts and not sources.scripts:
        begin = program.scripts[0].location.begin
        raise _no_scripts(begin.filename, begin.line, begin.column)
    if not sources.trusted:
        limits.check_sizes(program.statements)
    return program


def _signature(symbol: ast.AST) -> Iterator[Tuple[str, int, bool]]:
    """Yields the signature of a symbolic atom; nothing if it is a pool."""
    positive = symbol.ast_type is not ast.ASTType.UnaryOperation
    function = symbol if positive else symbol.argument
    if function.ast_type is ast.ASTType.Function:
        yield function.name, len(function.arguments), positive


class _Sources:
    """Checks texts, and the files that they include, before clingo opens any of them.

    What is trusted may nest and hold anything that clingo does not leave out in silence.

    clingo opens each file once, by the first of its names, and looks for what it includes in the
    working directory, and then next to that name.

    Attributes:
        program: What is to be parsed of them, with their texts, includes and remarks.
        scripts: Whether there may be scripts.
        trusted: Whether statements may have any size.
        opened: By which name clingo opens each file, by its real path.
    """

    def __init__(self, policy: Optional[Policy]) -> None:
        self.program = Program(parts={("base", 0): set()})
        self.opened: Dict[str, str] = {}  # by which name a real path is
        self.scripts = policy is None or policy.allow_scripts
        self.trusted = policy is None
        self._policy = policy

    def open(self, path: str) -> str:
        """Registers a file by one of its names, and returns its real path."""
        if "\0" in path or not path.isprintable():
            raise ProgramError(
                f"the file name {quote(path)} holds characters that no file name has"
            )
        real = os.path.realpath(path)
        self.opened.setdefault(real, path)
        return real

    def check_file(self, path: str) -> None:
        real = self.open(path)
        if self._policy is not None:
            self._policy.check_file(path)
        texts = self.program.texts
        if real not in texts:
            texts[real] = _read(path)
            self.program.includes[real] = self.check_text(texts[real], self.opened[real])

    def check_text(self, text: str, path: str = "") -> Dict[str, str]:
        """Checks a text, by the name of its file, and returns the real paths of its includes."""
        try:
            if text.startswith("asp "):  # clingo's parser would silently take it for empty
                raise ProgramError(
                    "line 1: this is a ground program (aspif); use what it was made of"
                )
            if self._policy is not None:
                self._check_untrusted(text, path)
            included = list(lexical.includes(text, trusted=self._policy is None))
        except ProgramError as err:
            raise ProgramError(f"{path or '<string>'}: {err}") from err
        found: Dict[str, str] = {}
        for file in included:
            if file is None:
                self.program.remarks.append(
                    f"{path}: warning: the main loop of #include <incmode> is not used; clients "
                    "ground and solve"
                )
                continue
            names = (file, os.path.join(os.path.dirname(path), file))
            existing = list(filter(os.path.exists, dict.fromkeys(names)))
            if existing:
                found[file] = os.path.realpath(existing[0])
            # Before clingo opens one, an untrusted client may remove the other.
            for name in existing[:1] if self._policy is None else existing:
                self.check_file(name)
        return found

    def _check_untrusted(self, text: str, path: str) -> None:
        if "\0" in text:
            raise ProgramError("there is a NUL character; remove it")
        script = None if self.scripts else lexical.script(text)
        if script is not None:
            raise _no_scripts(path or "<string>", *lexical.place(text, script))
        if lexical.too_deep(text):
            raise ProgramError(
                f"it nests deeper than {lexical.MAX_NESTING} levels; split the statement"
            )


def _no_scripts(file: str, line: int, column: int) -> ForbiddenError:
    return ForbiddenError(
        f"{file}:{line}:{column}: #script blocks are refused; the node's parameter "
        "~allow_scripts:=true allows them"
    )


def _read(path: str) -> str:
    """Reads a file; a device or a pipe could block for ever."""
    if not os.path.isfile(path):
        raise ProgramError(
            f"there is no file {quote(path)}, seen from {os.getcwd()}; check the path"
        )
    try:
        with open(path, encoding="utf-8") as file:
            return file.read()
    except UnicodeDecodeError as err:
        raise ProgramError(
            f"file {quote(path)} is not UTF-8 at byte {err.start}; convert it to UTF-8"
        ) from err
    except OSError as err:
        raise ProgramError(f"file {quote(path)} cannot be read: {err.strerror}") from err
