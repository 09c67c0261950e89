"""Runs Fast Downward's translator, which grounds a task and finds variables with one value each."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from importlib.util import find_spec
from pathlib import Path

from rosoclingo.pddl.expressions import PddlError, read_file
from rosoclingo.pddl.sas import Task, parse_sas
from rosoclingo.pddl.support import check_domain, check_problem

_PACKAGE = "up_fast_downward"


def fast_downward() -> Path:
    """Returns the folder of Fast Downward, an optional dependency.

    Raises:
        PddlError: It is not installed.
    """
    spec = find_spec(_PACKAGE)
    if spec is None or spec.origin is None:
        raise PddlError("importing PDDL needs Fast Downward: pip install up-fast-downward")
    return Path(spec.origin).parent / "downward"


def translate(domain: Path, problem: Path) -> Task:
    """Returns the task of a domain and a problem.

    Raises:
        PddlError: Fast Downward is missing, or the files are not understood.
    """
    check_domain(read_file(domain))
    check_problem(read_file(problem))
    programs = fast_downward() / "builds/release/bin"
    with tempfile.TemporaryDirectory() as folder:
        output = Path(folder) / "output.sas"
        files = [str(domain.absolute()), str(problem.absolute())]
        ended = subprocess.run(  # noqa: S603 (a list, without a shell)
            [sys.executable, "-m", "translate", *files, "--sas-file", str(output)],
            cwd=folder,
            env={**os.environ, "PYTHONPATH": str(programs)},
            capture_output=True,
            text=True,
            check=False,
        )
        if ended.returncode or not output.exists():
            said = (ended.stderr.strip() or ended.stdout.strip()).splitlines()
            reason = said[-1] if said else f"exit status {ended.returncode}"
            raise PddlError(f"{domain}, {problem}: not understood by the translator: {reason}")
        return parse_sas(output.read_text(encoding="utf-8"))
