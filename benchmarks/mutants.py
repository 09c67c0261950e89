#!/usr/bin/env python3
"""Mutation test: counts the mutants of the mailbot's encoding that check.py finds.

A mutant is mailbot.lp with one change: a statement dropped, the sign of a condition flipped, or an
index off by one. Those that clingo refuses are none, and the phrases, which no plan depends on,
have none. Each is judged by check.py, up to the first finding that has a command of plan.py; that
is typed again, and has to do the same. What was judged is in the file of results, and not judged
again.

    benchmarks/mutants.py [--count N] [--seed S] [--episodes N] [--results FILE.jsonl] [--only K]

Takes some minutes on one core, and is not run by scripts/bench. Exit status 1 says that fewer than
nine of ten are found.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import random
import shutil
import sys
import tempfile
import time
from dataclasses import asdict, dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Dict, Iterator, List, Optional, Sequence, Tuple

from clingo import ast

from reproduced import is_reproduced
from rosclingo.errors import RosclingoError
from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosoclingo.tools.check.command import Checking
from rosoclingo.tools.check.command_line import parse

ENCODINGS = Path(__file__).resolve().parents[1] / "rosoclingo_aspprograms"
RESULTS = Path(__file__).resolve().parent / "results" / "mutants.jsonl"
SEED = 14
SHARE = 0.9  # to be found
_SECONDS = 300.0  # for one mutant

EQUIVALENT: Dict[str, str] = {
    "69:1 #external event(s,c) : passed = c, s = info. dropped": (
        "no rule asks whether a step has gone by: past and plan are told apart by what is committed"
    ),
}
"""Mutants that plan as the encoding does, and why; by what was changed."""


@dataclass(frozen=True)
class Mutant:
    """A change of the encoding.

    Attributes:
        name: Where it is, and what.
        text: The whole encoding with it.
    """

    name: str
    text: str


@dataclass(frozen=True)
class Verdict:
    """The result of checking a mutant.

    Attributes:
        name: The mutant's.
        check: The check that has found it; empty if none has.
        said: What it says.
        commands: How it is seen, as arguments of plan.py.
        reproduced: Whether plan.py does the same.
        seconds: How long it took, in seconds of processor time.
    """

    name: str
    check: str = ""
    said: str = ""
    commands: Sequence[Sequence[str]] = ()
    reproduced: bool = False
    seconds: float = 0.0


class Mutations:
    """All changes of a text, by the positions of what clingo has parsed."""

    def __init__(self, file: Path) -> None:
        self._file = file
        self._text = file.read_text()
        self._lines = self._text.splitlines(keepends=True)

    def all(self) -> List[Mutant]:
        """Returns all mutants, in the order of the text."""
        changes: List[Tuple[int, int, str, str]] = []
        part = "base"
        statements: List[ast.AST] = []
        ast.parse_files([str(self._file)], statements.append)
        for statement in statements:
            if statement.location.begin.filename != str(self._file):
                continue  # of the library
            kind = statement.ast_type
            if kind is ast.ASTType.Program:
                part = statement.name
            elif part != "phrases" and kind in (
                ast.ASTType.Rule,
                ast.ASTType.External,
                ast.ASTType.ShowTerm,
            ):
                changes += self._of(statement)
        return [self._mutant(*change) for change in dict.fromkeys(changes)]

    def _of(self, statement: ast.AST) -> Iterator[Tuple[int, int, str, str]]:
        begin, end = self._span(statement)
        yield begin, end, "", "dropped"
        for literal in statement.body:
            yield from self._flipped(literal)
        yield from self._off_by_one(statement)

    def _flipped(self, literal: ast.AST) -> Iterator[Tuple[int, int, str, str]]:
        if literal.ast_type is not ast.ASTType.Literal:
            return
        begin, end = self._span(literal)
        text = self._text[begin:end]
        flipped = text[len("not ") :] if text.startswith("not ") else f"not {text}"
        yield begin, end, flipped, "flipped"

    def _off_by_one(self, statement: ast.AST) -> Iterator[Tuple[int, int, str, str]]:
        indices = _Indices()
        indices(statement)
        for term in indices.found:
            begin, end = self._span(term)
            text = self._text[begin:end]
            other = str(int(text) + 1) if text.isdigit() else f"{text}-1"
            yield begin, end, other, "off by one"

    def _span(self, node: ast.AST) -> Tuple[int, int]:
        begin, end = (self._offset(place) for place in (node.location.begin, node.location.end))
        return begin, end

    def _offset(self, place: ast.Position) -> int:
        line = self._lines[place.line - 1].encode()
        before = sum(map(len, self._lines[: place.line - 1]))
        return before + len(line[: place.column - 1].decode())

    def _mutant(self, begin: int, end: int, other: str, kind: str) -> Mutant:
        line = self._text.count("\n", 0, begin) + 1
        column = begin - (self._text.rfind("\n", 0, begin) + 1) + 1
        was = " ".join(self._text[begin:end].split())
        change = f"{was} {kind}" + (f", {other}" if other else "")
        return Mutant(f"{line}:{column} {change}", self._text[:begin] + other + self._text[end:])


class _Indices(ast.Transformer):
    """Finds numbers, and the parameters of parts that count: the search k and the step t."""

    def __init__(self) -> None:
        self.found: List[ast.AST] = []

    def visit_SymbolicTerm(self, term: ast.AST) -> ast.AST:  # noqa: N802 (clingo's name)
        if str(term) in ("k", "t") or str(term).isdigit():
            self.found.append(term)
        return term

    def visit_Function(self, term: ast.AST) -> ast.AST:  # noqa: N802 (clingo's name)
        if not term.arguments and term.name in ("k", "t"):
            self.found.append(term)
        return term.update(**self.visit_children(term))


def chosen(count: int, seed: int) -> List[Mutant]:
    """Returns so many mutants, drawn at random, which clingo takes."""
    mutants = Mutations(ENCODINGS / "mailbot" / "mailbot.lp").all()
    random.Random(seed).shuffle(mutants)
    taken: List[Mutant] = []
    with tempfile.TemporaryDirectory() as folder:
        for mutant in mutants:
            if len(taken) == count:
                break
            file = _written(mutant, Path(folder))
            try:
                Engine(Options((str(file.parent / "instances" / "graph_bench.lp"), str(file))))
            except RosclingoError:
                continue
            taken.append(mutant)
    return taken


def _written(mutant: Mutant, folder: Path) -> Path:
    """Writes a mutant with all that belongs to it, and returns its path."""
    for name in ("lib", "mailbot"):
        if not (folder / name).exists():
            shutil.copytree(ENCODINGS / name, folder / name)
    file = folder / "mailbot" / "mailbot.lp"
    file.write_text(mutant.text)
    return file


def judge(mutant: Mutant, episodes: int) -> Verdict:
    """Runs check.py on a mutant, in a process that may take some minutes."""
    ours, theirs = multiprocessing.Pipe(duplex=False)
    context = multiprocessing.get_context("fork")
    process = context.Process(target=_judge, args=(mutant, episodes, theirs))
    process.start()
    theirs.close()  # so that it is seen when the process ends
    try:
        if ours.poll(_SECONDS):
            verdict = ours.recv()
            assert isinstance(verdict, Verdict)
            return verdict
        return Verdict(mutant.name, said=f"not judged within {_SECONDS:g} s")
    except EOFError:
        return Verdict(mutant.name, said="the process has ended")
    finally:
        process.kill()
        process.join()


def _judge(mutant: Mutant, episodes: int, answer: Connection) -> None:
    begin = time.process_time()
    with tempfile.TemporaryDirectory() as name:
        file = _written(mutant, Path(name))
        instance = file.parent / "instances" / "graph_bench.lp"
        words = [str(instance), str(file), "--episodes", str(episodes)]
        said = ""
        for finding in Checking(parse(words)).findings():
            said = said or f"only {finding.check}: {finding.text}"
            if finding.commands:
                used = time.process_time() - begin
                commands = [[w.replace(f"{name}/", "") for w in c] for c in finding.commands]
                text = finding.text.replace(f"{name}/", "")
                reproduced = is_reproduced(finding)
                verdict = Verdict(mutant.name, finding.check, text, commands, reproduced, used)
                answer.send(verdict)
                return
        answer.send(Verdict(mutant.name, said=said, seconds=time.process_time() - begin))


def main() -> int:
    """Judges the mutants that are not judged yet, and prints the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=100, help="how many mutants")
    parser.add_argument("--episodes", type=int, default=30, help="random runs of each")
    parser.add_argument("--results", type=Path, default=RESULTS, help="where verdicts are added")
    parser.add_argument("--seed", type=int, default=SEED, help="which mutants are drawn")
    parser.add_argument("--only", type=int, metavar="K", help="judge the K-th again, from 0 on")
    given = parser.parse_args()
    mutants = chosen(given.count, given.seed)
    if given.only is not None:
        print(json.dumps(asdict(judge(mutants[given.only], given.episodes)), indent=1))
        return 0
    given.results.parent.mkdir(exist_ok=True)
    known = _read(given.results)
    for number, mutant in enumerate(mutants):
        if mutant.name in known:
            continue
        verdict = judge(mutant, given.episodes)
        known[mutant.name] = verdict
        with given.results.open("a") as file:
            file.write(json.dumps(asdict(verdict)) + "\n")
        print(f"{number}: {verdict.name}: {verdict.check or 'NOT FOUND'}", file=sys.stderr)
    return _report([known[mutant.name] for mutant in mutants])


def _read(file: Path) -> Dict[str, Verdict]:
    lines = file.read_text().splitlines() if file.exists() else []
    verdicts = [Verdict(**json.loads(line)) for line in lines]
    return {verdict.name: verdict for verdict in verdicts}


def _report(verdicts: List[Verdict]) -> int:
    found = [one for one in verdicts if one.check and one.reproduced]
    by_check: Dict[str, int] = {}
    for one in found:
        by_check[one.check] = by_check.get(one.check, 0) + 1
    print(f"{len(found)} of {len(verdicts)} mutants found, each with a command that does the same")
    for check, number in sorted(by_check.items(), key=lambda pair: -pair[1]):
        print(f"{number:5}  {check}")
    times = sorted(one.seconds for one in found)
    if times:
        print(f"processor time of each: median {times[len(times) // 2]:.1f} s, "
              f"worst {times[-1]:.1f} s")  # fmt: skip
    for one in verdicts:
        if one not in found:
            why: Optional[str] = EQUIVALENT.get(one.name)
            print(f"not found: {one.name}: {f'equivalent: {why}' if why else one.said or '?'}")
    return 0 if len(found) >= SHARE * len(verdicts) else 1


if __name__ == "__main__":
    sys.exit(main())
