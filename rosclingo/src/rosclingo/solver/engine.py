"""The solver: the only owner of a :class:`clingo.control.Control`.

>>> engine = Engine(Options())
>>> base = [wire.Add("base", (), "{ a; b }. :- not a."), wire.Ground((wire.Part("base"),))]
>>> engine.run(base).failure
>>> engine.solve([wire.Assumption("b", True)]).symbols
('a', 'b')
>>> engine.run([wire.Ground((wire.Part("step", ("1",)),))]).failure.message
'there is no program step/1 (name and number of parameters); there are base/0'
"""

from __future__ import annotations

import contextlib
import os
import re
from typing import (
    Any,
    Callable,
    Dict,
    Iterator,
    List,
    Optional,
    Sequence,
    Set,
    Tuple,
    cast,
)

import clingo
from clingo import ast
from clingo.backend import Observer
from clingo.symbolic_atoms import SymbolicAtom

from rosclingo.errors import (
    OutOfMemoryError,
    SolverError,
    UnknownExternalError,
    UnknownProgramError,
    report,
    shorten,
)
from rosclingo.solver import programs, scripts
from rosclingo.solver.activity import GROUNDING, SOLVING, SolverActivity
from rosclingo.solver.controls import ClingoMessages, new_control, use_heuristics
from rosclingo.solver.explanations import CauseFinder
from rosclingo.solver.longest_paths import LongestPaths
from rosclingo.solver.memory import (
    RESERVE,
    is_out_of_memory,
    out_of_memory,
    prepare_thread,
)
from rosclingo.solver.options import Options
from rosclingo.solver.patches import atoms_after
from rosclingo.solver.programs import Policy, Program
from rosclingo.solver.terms import parse_term
from rosclingo.solver.theories import make_theory
from rosclingo.solver.threads import with_threads
from rosclingo.solver.watch import SearchWatch
from rosclingo.solver.ways import ShortestWays
from rosclingo.wire import commands as wire

_MOST_ROUNDS = 10_000  # of grounding what the program asks for
_RESULTS = {True: wire.Result.SAT, False: wire.Result.UNSAT, None: wire.Result.UNKNOWN}
_SIGNATURE = re.compile(r"(-?)(_*[a-z][A-Za-z0-9_']*)/([0-9]{1,9})")  # as in p/2
_CLINGO_VALUES = {wire.Truth.TRUE: True, wire.Truth.FALSE: False, wire.Truth.FREE: None}


_Part = Tuple[str, Tuple[clingo.Symbol, ...]]


class Engine:
    """Runs commands and solve calls on one solver.

    When clingo or Python runs out of memory, the solver and all that it was told is dropped, so
    that there is memory again to say so: until a restart, everything else is refused. Symbols stay
    in memory for as long as the process does, so a new process has more room than a restart.

    Not thread-safe: one thread makes the calls. Only ``policy`` may be set from elsewhere, and
    ``activity`` read.

    Attributes:
        policy: What programs and files from clients may do.
        activity: What it does now, and for how long.
        program: The files of the command line, with those that they include.
        core: Assumptions of the last search that exclude an answer set, whatever the others are;
            not as few as possible. Empty if there is one, or none without assumptions either.
    """

    def __init__(
        self,
        options: Options,
        policy: Optional[Policy] = None,
        log: Callable[[str], None] = lambda _: None,
        *,
        rereads: bool = True,
        rewrite: Callable[[Program], Program] = lambda program: program,
    ) -> None:
        """Loads the files and grounds nothing.

        Args:
            options: The command line. Its files are trusted.
            policy: What clients may do; by default, no scripts, and files from the folders of
                the command line's files and from the working directory.
            log: Called with clingo's warnings, in the thread that runs the command.
            rereads: Whether a restart looks whether the files have changed.
            rewrite: Returns the program that is loaded in the place of the files'.

        Raises:
            OptionsError: clingo refuses an option, or there is no such theory.
            ProgramError: A file does not parse or is not safe.
            OutOfMemoryError: Memory has run out.
        """
        self.policy = policy if policy is not None else default_policy(options)
        self.activity = SolverActivity()
        self._options = options
        self._log = log
        self._runners: Dict[type, Callable[[Any], Optional[wire.Answer]]] = {
            wire.Add: self._add,
            wire.AssignExternal: self._assign_external,
            wire.CleanupDomains: self._cleanup,
            wire.GetExternals: self._get_externals,
            wire.GetPrograms: lambda _: self._programs(),
            wire.GetStats: lambda _: wire.Stats(self._control.statistics),
            wire.Ground: self._ground,
            wire.Load: self._load,
            wire.ReleaseExternal: self._release_external,
            wire.Restart: lambda _: self._restart_in_memory(),
        }
        self.program = Program()
        self._rereads = True
        self._rewrite = rewrite
        self._is_fresh = False  # nothing was done since the last restart
        self._dropped: Optional[str] = None  # why the solver is dropped, if it is
        self._ask: Optional[SymbolicAtom] = None  # the last ground(P) that was seen
        self.core: Tuple[wire.Assumption, ...] = ()
        try:
            self._restart()
        except MemoryError:
            raise out_of_memory("starting") from None
        self._rereads = rereads

    def use_threads(self, threads: int) -> None:
        """Restarts with so many threads, unless it is one.

        Raises:
            OptionsError: The command line has a number of threads already.
        """
        if threads > 1:
            self._options = with_threads(self._options, threads)
            self._is_fresh = False
            self._restart()

    def apply(self, command: wire.Command) -> Optional[wire.Answer]:
        """Runs a command.

        Returns:
            The answer of a command that has one.

        Raises:
            RosclingoError: The command is wrong; the solver is as it was before.
            OutOfMemoryError: Memory has run out.
            SolverError: clingo failed; only ``wire.Restart`` is sure to work afterwards.
        """
        is_ground = isinstance(command, wire.Ground)
        doing = GROUNDING if is_ground else wire.command_name(command)
        self.activity.begin(doing)
        prepare_thread()
        try:
            if not isinstance(command, wire.Restart):
                self._check_memory()
                self._is_fresh = False
            try:
                with scripts.using(self._scripts):
                    return self._runners[type(command)](command)
            except (RuntimeError, MemoryError) as err:
                if not is_out_of_memory(err):
                    reason = scripts.reason(str(err))
                    reason = "\n".join(filter(None, [reason, self._messages.text()]))
                    self.activity.failure = reason
                    raise SolverError(
                        f"clingo failed: {reason}; a restart gives a fresh solver"
                    ) from err
            raise self._drop(doing)  # here, because the error's traceback would keep the solver
        finally:
            self.activity.end()
            self._log_messages()

    def run(self, commands: Sequence[wire.Command]) -> wire.Reply:
        """Runs commands in order until one fails; what ran before that stays.

        Returns:
            The answers, and the failure if there was one.

        Raises:
            OutOfMemoryError: Memory has run out; nothing else is raised.
        """
        answers: List[wire.Answer] = []
        for index, command in enumerate(commands):
            try:
                answer = self.apply(command)
            except OutOfMemoryError:
                raise
            except Exception as err:  # a bug must not end the node: the client learns of it
                name = wire.command_name(command)
                # clingo's messages may quote all of a long program.
                message = report(err, f"in <{name}>")
                return wire.Reply(tuple(answers), wire.Failure(name, index, message))
            if answer is not None:
                answers.append(answer)
        return wire.Reply(tuple(answers))

    def check(self) -> None:
        """Checks nothing: a solver in this process is there. See :meth:`.client.Client.check`."""

    def solve(
        self,
        assumptions: Sequence[wire.Assumed] = (),
        stopped: Optional[Callable[[], bool]] = None,
        improved: Callable[[wire.Improvement], None] = lambda _: None,
    ) -> wire.Outcome:
        """Searches for answer sets.

        Args:
            assumptions: What to assume. An atom that the grounding does not have is false. With
                several bounds of costs, limits of conflicts or strategies, the last one counts.
            stopped: Asked every 10 ms, in another thread, while this one searches; the search ends
                when it says True. Without it the search cannot be ended.
            improved: Called with each better model while optimising.

        Raises:
            TermError: An assumption is not a ground term.
            OutOfMemoryError: Memory has run out.
            SolverError: clingo failed.
        """
        self._check_memory()
        self._is_fresh = False
        literals = [
            (parse_term(a.name), a.value) for a in assumptions if isinstance(a, wire.Assumption)
        ]
        bounds = [a.cost for a in assumptions if isinstance(a, wire.CostBound)]
        limits = [a.conflicts for a in assumptions if isinstance(a, wire.ConflictLimit)]
        strategies = [a.strategy for a in assumptions if isinstance(a, wire.Restarts)]
        self.core = ()
        self.activity.begin(SOLVING)
        try:
            try:
                with self._limited(bounds, limits, strategies):
                    return self._search_watched(literals, stopped or (lambda: False), improved)
            except (RuntimeError, MemoryError) as err:
                if not is_out_of_memory(err):
                    self.activity.failure = str(err)
                    raise SolverError(f"clingo failed while solving: {err}") from err
            raise self._drop(SOLVING)  # here, because the error's traceback would keep the solver
        finally:
            self.activity.end()
            self._log_messages()

    @contextlib.contextmanager
    def _limited(
        self,
        bounds: Sequence[Tuple[int, ...]],
        limits: Sequence[int],
        strategies: Sequence[str],
    ) -> Iterator[None]:
        """A context in which searches have the last of some bounds, limits and strategies."""
        solving = cast(clingo.Configuration, self._control.configuration.solve)
        solver = cast(clingo.Configuration, self._control.configuration.solver)
        restarts = solver.restarts if strategies and len(solver) == 1 else None
        mode, limit = solving.opt_mode, solving.solve_limit
        try:
            if limits:
                solving.solve_limit = str(limits[-1])
            if bounds:
                solving.opt_mode = ",".join(["opt", *map(str, bounds[-1])])
            if restarts is not None:
                _set_restarts(solver, strategies[-1])
            yield
        finally:
            if bounds:
                solving.opt_mode = mode
            if limits:
                solving.solve_limit = limit
            if restarts is not None:
                solver.restarts = restarts

    def _search_watched(
        self,
        assumptions: Sequence[Tuple[clingo.Symbol, bool]],
        stopped: Callable[[], bool],
        improved: Callable[[wire.Improvement], None],
    ) -> wire.Outcome:
        with SearchWatch(stopped, self._control.interrupt) as watch:
            outcome = self._search(assumptions, watch, improved)
            if outcome.interrupted and not watch.stopped:
                # The search before was over when it was interrupted, and left that to this one.
                outcome = self._search(assumptions, watch, improved)
            return outcome

    def _check_memory(self) -> None:
        """Raises the error by which the solver was dropped, if it was.

        Raises:
            OutOfMemoryError: It was dropped, and not restarted since then.
        """
        if self._dropped is not None:
            raise OutOfMemoryError(f"{self._dropped}; begin with a restart")

    def _drop(self, doing: str) -> OutOfMemoryError:
        """Frees the solver, which ran out of memory; returns the error to raise."""
        self._is_fresh = False
        self.__dict__.pop("_control", None)  # a restart may fail, too, when it is dropped
        self._theory = make_theory(self._options.theory)  # the solver goes before its theory
        self._externals = _ExternalValues()
        self._ask = None
        self._ways.forget()
        self._longest.forget()
        self._causes.forget()
        err = out_of_memory(doing)
        self.activity.failure = self._dropped = str(err)
        return err

    def _search(
        self,
        assumptions: Sequence[Tuple[clingo.Symbol, bool]],
        watch: SearchWatch,
        improved: Callable[[wire.Improvement], None],
    ) -> wire.Outcome:
        self._theory.prepare(self._control)
        best: Optional[List[int]] = None
        symbols: Sequence[clingo.Symbol] = ()
        texts: Optional[Tuple[str, ...]] = None  # of them, if they were needed already
        with self._control.solve(assumptions, yield_=True) as handle:
            for model in handle:
                symbols, texts = self._theory.symbols(model), None
                cost = model.cost
                if cost and (best is None or cost < best):
                    best = cost
                    texts = _texts(symbols)
                    improved(wire.Improvement(model.number, tuple(cost), texts))
                if watch.look():
                    break
            texts = _texts(symbols) if texts is None else texts
            if watch.stopped:
                handle.cancel()
                return wire.Outcome(wire.Result.UNKNOWN, True, texts)
            result = handle.get()
            if result.unsatisfiable and assumptions:
                self.core = self._name(set(handle.core()), assumptions)
        return wire.Outcome(_RESULTS[result.satisfiable], result.interrupted, texts)

    def _name(
        self, literals: Set[int], assumptions: Sequence[Tuple[clingo.Symbol, bool]]
    ) -> Tuple[wire.Assumption, ...]:
        """Returns the assumptions that have become some literals."""
        atoms = self._control.symbolic_atoms
        named = []
        for symbol, value in assumptions:
            atom, assumption = atoms[symbol], wire.Assumption(str(symbol), value)
            if atom is None and value:  # it has no literal of its own
                return (assumption,)
            if atom is not None and (atom.literal if value else -atom.literal) in literals:
                named.append(assumption)
        return tuple(named)

    def _restart_in_memory(self) -> None:
        """Restarts; if there is too little memory for two solvers, the old one goes before."""
        try:
            self._restart()
        except (RuntimeError, MemoryError) as err:
            if not is_out_of_memory(err):
                raise
        else:
            return
        self._drop(wire.command_name(wire.Restart()))
        self._restart()

    def _restart(self) -> None:
        # Everything that can fail comes first, so that a failure leaves the old solver in place.
        options = self._options
        program = last = self.program
        if self._rereads:
            program = programs.parse_files(options.files, last=last)
            program = program if program is last else self._rewrite(program)
        if self._is_fresh and program is last:
            return
        ways = ShortestWays(lambda: self._control.symbolic_atoms)
        longest = LongestPaths(lambda: self._control.symbolic_atoms)
        causes = CauseFinder(lambda: self._control.symbolic_atoms)
        namespace: scripts.Namespace = {**ways.functions, **longest.functions, **causes.functions}
        messages = ClingoMessages()
        with scripts.using(namespace):
            control = new_control(options.clingo, messages, has_heuristics=program.has_heuristics)
            theory = make_theory(options.theory)
            theory.register(control)
            externals = _ExternalValues()
            control.register_observer(externals)
            if program is last:
                program.add_to(control, theory)
            else:
                programs.add_checked(program, control, messages, theory, options)
        if program is not last:
            for remark in program.remarks:
                self._log(remark)
        if program.has_heuristics:
            use_heuristics(control, options.clingo)
        self.program = program
        self._scripts = namespace
        self._ways, self._longest, self._causes = ways, longest, causes
        self._control = control  # the old one goes before its theory
        self._theory = theory
        self._messages = messages
        self._externals = externals
        self._parts: Dict[Tuple[str, int], Set[str]] = {("base", 0): set()}
        self._add_parts(program)
        self._definitions: List[ast.AST] = list(program.definitions)
        self._external_signatures = set(program.externals)
        self._once: Set[_Part] = set()  # parts that were grounded by what asks
        self._ask = None
        self.activity.atoms, self.activity.failure, self._dropped = None, "", None
        self._is_fresh = True
        RESERVE.keep()

    def _add(self, command: wire.Add) -> None:
        self._take(
            programs.parse_part(command.name, command.parameters, command.program, self.policy)
        )

    def _load(self, command: wire.Load) -> None:
        self._take(programs.parse_files([command.file], self.policy))

    def _take(self, program: Program) -> None:
        programs.check(program, self._definitions, self._options)
        program.add_to(self._control, self._theory)
        if program.has_heuristics:
            use_heuristics(self._control, self._options.clingo)
        self._add_parts(program)
        self._external_signatures |= program.externals
        self._definitions += program.definitions

    def _add_parts(self, program: Program) -> None:
        for part, files in program.parts.items():
            self._parts[part] = self._parts.get(part, set()) | files

    def _programs(self) -> wire.Programs:
        extended = frozenset(part for part, files in self._parts.items() if len(files) > 1)
        return wire.Programs(tuple(sorted(self._parts)), extended)

    def _ground(self, command: wire.Ground) -> None:
        parts = [self._part(part) for part in command.parts]
        self._ground_parts(parts, command)
        self.activity.atoms = len(self._control.symbolic_atoms)

    def _ground_parts(self, parts: List[_Part], command: wire.Ground) -> None:
        if not command.asking:
            self._control.ground(parts)
            return
        for _ in range(_MOST_ROUNDS):
            new = [part for part in dict.fromkeys(parts) if part not in self._once]
            if not new:
                return
            self._once.update(new)
            self._control.ground(new)
            parts = self._asked_for({"base", *command.reserved})
        name, arguments = parts[0]
        raise SolverError(
            f"the program asked for parts {_MOST_ROUNDS} times, last for "
            f"{shorten(str(clingo.Function(name, arguments)))}: does it ever stop asking?"
        )

    def _part(self, part: wire.Part) -> _Part:
        self._check_part(part.name, len(part.parameters), "")
        return part.name, tuple(parse_term(value) for value in part.parameters)

    def _asked_for(self, reserved: Set[str]) -> List[_Part]:
        """Returns the parts that the program asks for by externals that were not seen before."""
        parts = []
        for atom in atoms_after(self._ask, self._control.symbolic_atoms, "ground", 1):
            self._ask = atom
            if not atom.is_external:
                continue
            part = atom.symbol.arguments[0]
            by = f"; the program asks for it by {shorten(str(atom.symbol))}"
            if part.type is not clingo.SymbolType.Function or not part.name:
                raise UnknownProgramError(f"{shorten(str(part))} names no program part{by}")
            if part.name in reserved:
                raise UnknownProgramError(f"the program {part.name} cannot be asked for{by}")
            self._check_part(part.name, len(part.arguments), by)
            parts.append((part.name, tuple(part.arguments)))
        return parts

    def _check_part(self, name: str, count: int, by: str) -> None:
        if (name, count) not in self._parts:
            known = ", ".join(f"{name}/{arity}" for name, arity in sorted(self._parts))
            raise UnknownProgramError(
                f"there is no program {shorten(name)}/{count} (name and number of parameters); "
                f"there are {shorten(known, 1000)}{by}"
            )

    def _assign_external(self, command: wire.AssignExternal) -> None:
        symbol = self._external(command.name)
        self._control.assign_external(symbol, _CLINGO_VALUES[command.value])

    def _release_external(self, command: wire.ReleaseExternal) -> None:
        signature = _SIGNATURE.fullmatch(command.name)
        if signature is None:
            self._control.release_external(self._external(command.name))
            return
        sign, name, arity = signature.groups()
        atoms = self._control.symbolic_atoms.by_signature(name, int(arity), not sign)
        for atom in [atom for atom in atoms if atom.is_external]:
            self._control.release_external(atom.literal)

    def _external(self, name: str) -> clingo.Symbol:
        symbol = parse_term(name)
        atom = self._control.symbolic_atoms[symbol]
        if atom is None or not atom.is_external:
            state = "not in the grounding" if atom is None else "defined by a rule or released"
            raise UnknownExternalError(
                f"there is no external {shorten(str(symbol))}: it is {state}; get_externals lists "
                "those there are"
            )
        return symbol

    def _cleanup(self, _: wire.CleanupDomains) -> None:
        self._ask = None  # it may go
        self._ways.forget()
        self._longest.forget()
        self._causes.forget()
        self._control.cleanup()

    def _get_externals(self, _: wire.GetExternals) -> wire.Externals:
        atoms = self._control.symbolic_atoms
        found = [
            atom
            for signature in self._external_signatures
            for atom in atoms.by_signature(*signature)
            if atom.is_external
        ]
        if len(found) != len(self._externals.values):
            # There are new signatures (or atoms that are no longer external): look at all atoms.
            found = [atom for atom in atoms if atom.is_external]
            self._external_signatures = {
                (atom.symbol.name, len(atom.symbol.arguments), atom.symbol.positive)
                for atom in found
            }
        values = self._externals.values
        pairs = ((str(atom.symbol), values.get(atom.literal, wire.Truth.FALSE)) for atom in found)
        return wire.Externals(tuple(sorted(pairs, key=lambda pair: pair[0])))

    def _log_messages(self) -> None:
        text = self._messages.text()
        if text:
            self._log(text)


def default_policy(options: Options) -> Policy:
    """Returns the policy of a node that sets no parameter (see :class:`Engine`)."""
    folders = [os.path.dirname(os.path.abspath(file)) for file in options.files]
    return Policy(load_path=tuple(dict.fromkeys([*folders, os.getcwd()])))


def _set_restarts(solver: clingo.Configuration, strategy: str) -> None:
    try:
        solver.restarts = strategy
    except RuntimeError as err:
        raise SolverError(
            f"clingo knows no restart strategy {shorten(strategy)}: there is, for instance, L,60"
        ) from err


class _ExternalValues(Observer):
    """Follows the values of external atoms, which clingo does not tell otherwise.

    Attributes:
        values: By the atoms' literals, also of those that a rule has come to define.
    """

    def __init__(self) -> None:
        self.values: Dict[int, wire.Truth] = {}

    def external(self, atom: int, value: clingo.TruthValue) -> None:
        if value is clingo.TruthValue.Release:
            self.values.pop(atom, None)
        else:
            self.values[atom] = _TRUTHS.get(value, wire.Truth.FALSE)


_TRUTHS = {clingo.TruthValue.True_: wire.Truth.TRUE, clingo.TruthValue.Free: wire.Truth.FREE}


def _texts(symbols: Sequence[clingo.Symbol]) -> Tuple[str, ...]:
    return tuple(str(symbol) for symbol in symbols)
