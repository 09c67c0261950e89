"""The command ``check.py``, which checks an encoding. Needs no ROS, but for ``--live``.

``python3 -m rosoclingo.tools.check`` is ``rosrun rosoclingo check.py`` without ROS.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from typing import Iterator, NoReturn, Optional, Sequence, Set, Tuple

from rosclingo.errors import OptionsError, RosclingoError
from rosclingo.terminal import PROGRESS, ProgressPrinter, lines, say
from rosoclingo.encodings.alphabet import Alphabet, read_alphabet
from rosoclingo.in_process.parts import SINGLE
from rosoclingo.loop.single.dialects import Dialect2, detect
from rosoclingo.tools.check import live, model, static
from rosoclingo.tools.check.command_line import Chosen, parse
from rosoclingo.tools.check.examples import judge, read_examples
from rosoclingo.tools.check.findings import Finding, Words
from rosoclingo.tools.check.live import LiveLook
from rosoclingo.tools.check.run import Runner
from rosoclingo.tools.check.search import FailureSearch

_PROGRAM = "check.py"
_RESETS = "dynamic.incremental.reset"
_STATIC = "static.incremental.recording"


def main(look: Optional[LiveLook] = None, arguments: Optional[Sequence[str]] = None) -> NoReturn:
    """Runs the command and ends the process.

    Args:
        look: Looks at the running system; None without ROS.
        arguments: The command line without the program's name; by default that of the process.
    """
    try:
        sys.exit(run(sys.argv[1:] if arguments is None else arguments, look))
    except (RosclingoError, OSError) as err:
        say(_PROGRAM, str(err))
        sys.exit(2)


def run(arguments: Sequence[str], look: Optional[LiveLook] = None) -> int:
    """Runs the command and returns its exit status.

    Args:
        arguments: The command line without the program's name.
        look: Looks at the running system; None without ROS.

    Raises:
        RosclingoError: The command line is wrong.
        OSError: A file cannot be read.
    """
    chosen = parse(arguments, knows_live=look is not None)
    checking = Checking(chosen, look)
    count = hints = 0
    with ProgressPrinter(checking.done):
        for finding in checking.findings():
            count += not finding.is_hint
            hints += finding.is_hint
            PROGRESS.print(lines(str(finding)), sys.stdout)
    hinted = f", {hints} hint{'' if hints == 1 else 's'}" if hints else ""
    print(f"{checking.done()}: {count or 'nothing'} found{hinted}{checking.missed()}")
    return 1 if count else 0


class Checking:
    """Checks an encoding, and knows its own progress."""

    def __init__(self, chosen: Chosen, look: Optional[LiveLook] = None) -> None:
        """Prepares the checks.

        Args:
            chosen: What was typed.
            look: Looks at the running system.
        """
        self._chosen = chosen
        self._look = look
        self._runner = Runner(chosen.seconds)
        self._examples = 0
        self._search: Optional[FailureSearch] = None

    @property
    def commands(self) -> Sequence[Words]:
        """The arguments of ``plan.py`` for each run so far, in order."""
        return tuple(self._runner.commands)

    def done(self) -> str:
        """Returns a summary of the work so far."""
        episodes = 0 if self._search is None else self._search.episodes
        return f"{self._examples} examples, {episodes} episodes, {len(self._runner.commands)} runs"

    def missed(self) -> str:
        """Returns that the time budget ran out; empty if all was tried."""
        if not self._runner.is_over:
            return ""
        return f", and then the {self._chosen.seconds:g} s were over; --seconds S gives more"

    def findings(self) -> Iterator[Finding]:
        """Yields each finding as soon as there is one, without duplicates.

        Raises:
            RosclingoError: An option is wrong.
            OSError: A file cannot be read.
        """
        known: Set[Tuple[str, str, str]] = set()
        for finding in self._all():
            if finding.key not in known:
                known.add(finding.key)
                yield finding

    def _all(self) -> Iterator[Finding]:
        chosen = self._chosen
        shown = (*chosen.words, "--simulate")
        try:
            dialect = detect(chosen.options)
        except OptionsError as err:
            yield Finding("parts", str(err), commands=(shown,))
            return
        except RosclingoError as err:  # it does not parse, and what follows could not run either
            yield Finding("program", str(err), commands=(shown,))
            return
        try:
            alphabet = read_alphabet(chosen.options)
        except OptionsError:
            raise
        except RosclingoError as err:
            yield Finding("program", str(err), commands=(shown,))
            return
        written = static.look(chosen.options, dialect, alphabet)
        yield from written
        if any(finding.check == "names" and not finding.is_hint for finding in written):
            return  # each run would end for the same reason
        yield from model.look(chosen.options, alphabet)
        yield from self._on_examples()
        if chosen.requests:
            alphabet = replace(alphabet, requests=chosen.requests)
        if chosen.messages:
            alphabet = replace(alphabet, messages=chosen.messages)
        yield from self._in_episodes(alphabet)
        slowest = self._runner.slowest
        if slowest is not None and (slowest.place or self._runner.is_over):
            yield Finding("slow", str(slowest), commands=(slowest.words,), is_hint=True)
        if chosen.live and self._look is not None:
            yield from live.compare(self._look(), chosen.options, alphabet)

    def _on_examples(self) -> Iterator[Finding]:
        chosen = self._chosen
        for file in chosen.options.files:
            for example in read_examples(file, chosen.options.files):
                self._examples += 1
                try:
                    run = self._runner.run(example.words)
                except OptionsError as err:
                    raise OptionsError(f"{example.place}: {err}") from err
                yield from judge(example, run)

    def _in_episodes(self, alphabet: Alphabet) -> Iterator[Finding]:
        chosen = self._chosen
        is_dialect2 = detect(chosen.options) is Dialect2
        fitting = ("" if alphabet.slots else _STATIC) if is_dialect2 else SINGLE
        can_reset = is_dialect2 and alphabet.can_be_saved and not chosen.mode
        self._search = search = FailureSearch(
            chosen.words,
            alphabet,
            mode=chosen.mode or fitting,
            resets=_RESETS if can_reset else "",
            steps=chosen.steps,
            runner=self._runner,
        )
        for finding in search.alone():
            search.ignored.add(finding.check)
            yield finding
        yield from search.by_chance(chosen.episodes, chosen.seed)
