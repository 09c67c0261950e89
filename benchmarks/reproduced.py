"""Verifies that plan.py reproduces a finding of check.py, command by command."""

from __future__ import annotations

import contextlib
import io
import json
from typing import Any, List

from rosclingo.errors import RosclingoError
from rosoclingo.loop.journal import encode
from rosoclingo.tools.check.findings import Finding, Words
from rosoclingo.tools.check.run import Runner
from rosoclingo.tools.plan import command as plan


def is_reproduced(finding: Finding) -> bool:
    """Returns whether ``plan.py`` does the same as the runs of a finding, command by command."""
    return bool(finding.commands) and all(map(_is_the_same, finding.commands))


def _is_the_same(words: Words) -> bool:
    try:
        run = Runner().run(words)
    except RosclingoError as err:
        return _told(words) == str(err)
    journal = [
        {
            "clock": entry.seconds,
            "step": entry.step,
            "horizon": entry.horizon,
            **encode(entry.event)._asdict(),
        }
        for entry in run.journal
    ]
    return _told(words) == _without_times(json.loads(json.dumps(journal)))


def _told(words: Words) -> Any:
    """Returns the journal that ``plan.py`` prints, or why it prints none."""
    out = io.StringIO()
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(io.StringIO()):
            plan.run([*words, "--json"])
    except RosclingoError as err:
        return str(err)
    return _without_times(json.loads(out.getvalue())["journal"])


def _without_times(entries: List[Any]) -> List[Any]:
    return [{**entry, "seconds": 0} for entry in entries]
