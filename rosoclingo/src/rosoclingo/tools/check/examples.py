"""Examples: goals, and the plans that the author of an encoding expects for them.

Beside ``robot.lp`` may lie ``robot.examples``. Each line has arguments of ``plan.py``, and after
``=>`` what comes of them (docs/check.md, section "Examples"):

>>> line = "maps/small.lp --goal 'bring(1,4)' --at 3 cancel:1 => 4 steps, canceled, deliver(1)"
>>> example = read_example(line, Path("robots/robot.lp"), "robot.examples:1")
>>> example.words[:3]
('robots/maps/small.lp', 'robots/robot.lp', '--simulate')
>>> example.steps, example.statuses, example.actions
(4, ('canceled',), ('deliver(1)',))
"""

from __future__ import annotations

import os
import re
import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import Iterator, List, Optional, Sequence, Tuple

from rosclingo.errors import OptionsError, TermError, shorten
from rosclingo.solver.options import arguments, mark_files
from rosclingo.solver.terms import parse_term
from rosclingo.wire.term_text import split_term
from rosoclingo.loop.journal import STATUSES, MessageDropped, Status
from rosoclingo.loop.values.atoms import canonical
from rosoclingo.tools.check.findings import Finding, Words
from rosoclingo.tools.check.invariants import findings
from rosoclingo.tools.check.run import DOES, CheckedRun
from rosoclingo.tools.plan.command_line import make_parser, parse
from rosoclingo.tools.plan.why import explain
from rosoclingo.why.answers import WhyGoal, WhyNoPlan
from rosoclingo.why.question import WhyAnswer

ENDING = ".examples"
_STEPS = re.compile(r"(\d{1,9}) steps?")
_NO_PLAN = re.compile(r"no plan|(?:no plan )?because(?: (.+))?")


@dataclass(frozen=True)
class Example:
    """A run, and the outcome that the author expects.

    Attributes:
        words: The arguments of ``plan.py``.
        place: Where it stands, as ``FILE:LINE``.
        steps: The step of the last action; -1 if nothing is said.
        statuses: How each goal ends, in order; if nothing is said, they all succeed. A goal that
            does not end is ``accepted``, or ``waiting``.
        actions: What is done, in order, and maybe more.
        said: What stands in a reason: why a goal has ended, or a message was dropped.
        causes: What is a reason why there is no plan: facts as terms, or words of the answer
            between quotation marks. Then the goals may end in any way, unless it is said how.
    """

    words: Words
    place: str
    steps: int = -1
    statuses: Tuple[str, ...] = ()
    actions: Tuple[str, ...] = ()
    said: Tuple[str, ...] = ()
    causes: Tuple[str, ...] = ()


def read_examples(encoding: str, files: Sequence[str] = ()) -> List[Example]:
    """Returns the examples in the file next to an encoding, if there is one.

    Args:
        encoding: The encoding.
        files: All files of the command line, for the lines that name none.

    Raises:
        OptionsError: A line is none.
        OSError: The file cannot be read.
    """
    path = Path(encoding).with_suffix(ENDING)
    if not path.is_file():
        return []
    lines = enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
    return [
        read_example(line, Path(encoding), f"{path}:{number}", files)
        for number, line in lines
        if line.strip() and not line.lstrip().startswith(("#", "%"))
    ]


def read_example(line: str, encoding: Path, place: str, all_files: Sequence[str] = ()) -> Example:
    """Parses a line.

    Args:
        line: Arguments of ``plan.py``, ``=>``, and what is expected. Files are seen from the
            encoding's folder; the encoding itself is added.
        encoding: The encoding.
        place: Where the line stands.
        all_files: Those that a line without files is planned with; by default the encoding alone.

    Raises:
        OptionsError: It is none.
    """
    typed, arrow, expected = line.rpartition("=>")
    try:
        if not arrow:
            raise OptionsError(
                "expected arguments of plan.py, =>, and what comes of them, such as "
                "--goal 'visit(3)' => 2 steps"
            )
        own, others = make_parser().split(shlex.split(typed))
        files: List[str] = []
        rest: List[str] = []
        for option, value in arguments(mark_files(others, str(encoding.parent))):
            if option == "-f":
                files.append(os.path.normpath(encoding.parent / value))
            else:
                rest += [option, value] if option else [value]
        named = [*files, str(encoding)] if files or not all_files else all_files
        words = (*named, "--simulate", *rest, *own)
        return _expecting(expected, words, place)
    except (OptionsError, TermError, ValueError) as err:
        raise OptionsError(f"{place}: {err}") from err


def _expecting(expected: str, words: Words, place: str) -> Example:
    steps = -1
    statuses: List[str] = []
    actions: List[str] = []
    said: List[str] = []
    causes: List[str] = []
    for part in map(str.strip, split_term(f"all({expected.strip()})")[1]):
        number, no_plan = _STEPS.fullmatch(part), _NO_PLAN.fullmatch(part)
        if number:
            steps = int(number[1])
        elif no_plan:
            if no_plan[1] is None:
                raise OptionsError(f"{part}: name the reason, such as no plan because close(5)")
            causes.append(canonical(no_plan[1]))
        elif part in (*STATUSES, "waiting"):
            statuses.append(part)
        elif part.startswith('"'):
            said.append(parse_term(part).string)
        else:
            actions.append(canonical(part))
    if not (statuses or actions or said or causes or steps >= 0):
        raise OptionsError(
            f"{shorten(expected)!r}: expected N steps, the goals' statuses "
            f"({', '.join(sorted(STATUSES))}, waiting), actions, what is said between quotation "
            "marks, or no plan because of something, with commas between them"
        )
    return Example(words, place, steps, tuple(statuses), tuple(actions), tuple(said), tuple(causes))


def judge(example: Example, run: CheckedRun) -> List[Finding]:
    """Returns the findings in an example's run; none in a run that was cut."""
    if run.is_cut:
        return []
    said = list(_differences(example, run))
    if said:
        return [Finding("example", said[0], example.place, (run.words,))]
    # What is asked for that the encoding does not know, or cannot be done, is as expected here.
    return [found for found in findings(run) if found.check not in ("ends", "error")]


def _differences(example: Example, run: CheckedRun) -> Iterator[str]:
    words = [goal.words[-1] if goal.words else "waiting" for goal in run.goals]
    statuses = list(example.statuses)
    if not (statuses or example.causes):
        statuses = [Status.SUCCEEDED.value] * len(words)
    if statuses and words != statuses:
        why = f": {run.failure}" if run.failure is not None else ""
        yield f"expected {_list(statuses)}, and the goals are {_list(words)}{why}"
    if example.steps not in (-1, run.steps):
        yield f"expected {example.steps} steps, and it takes {run.steps}: {_list(_done(run))}"
    done = iter(_done(run))
    missing = [action for action in example.actions if action not in done]
    if missing:
        yield f"expected {_list(example.actions)} in this order, and it does {_list(_done(run))}"

    reasons = [goal.reason for goal in run.goals]
    reasons += [event.reason for event in run.events if isinstance(event, MessageDropped)]
    for text in example.said:
        if not any(text in reason for reason in reasons):
            yield f'expected "{text}", and it says {_list(reasons)}'
    if example.causes:
        yield from _other_causes(example, run)


def _other_causes(example: Example, run: CheckedRun) -> Iterator[str]:
    """Yields which expected reasons for a missing plan were not found."""
    lost = [g for g in run.goals if g.status not in (Status.SUCCEEDED, Status.CANCELED)]
    answers: List[WhyAnswer] = []
    unanswered: List[str] = []
    if lost and run.situation is not None:
        answers, unanswered = explain(run.situation, parse(example.words), lost)
    found = {
        member.fact.content
        for answer in map(_why_not, answers)
        if answer is not None and answer.reason is not None
        for member in answer.reason.members
    }
    texts = [answer.text for answer in answers]
    for cause in example.causes:
        is_said = cause.startswith('"') and any(parse_term(cause).string in t for t in texts)
        if cause not in found and not is_said:
            said = " ".join([*texts, *unanswered]) or "there is a plan for all goals"
            yield f"expected no plan because {cause}, and why is: {said}"


def _why_not(answer: WhyAnswer) -> Optional[WhyNoPlan]:
    if isinstance(answer, WhyGoal):
        return answer.no_plan
    return answer if isinstance(answer, WhyNoPlan) else None


def _done(run: CheckedRun) -> List[str]:
    return [heard[2] for heard in run.heard if heard[0] == DOES]


def _list(words: Sequence[str]) -> str:
    return ", ".join(words) or "nothing"
