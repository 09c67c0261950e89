"""Fast Downward's search in a process of its own, with the first iteration of LAMA.

It is an optional dependency, which the Python package up-fast-downward has. Versions 0.5 and 1.0 of
that package are tested; their folders differ in where the translator is.
"""

from __future__ import annotations

import contextlib
import os
import re
import resource
import subprocess
import threading
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path
from typing import List, Optional

from rosclingo.errors import shorten
from rosoclingo.errors import SeedPlannerError

DOWNWARD_PACKAGE = "up-fast-downward"
REINSTALL = f"run pip install --force-reinstall {DOWNWARD_PACKAGE}==1.0.0"
"""The remedy for a package that is damaged, or that has another layout."""

NONE = "none"
"""Stands for no seed planner."""

_LAMA = "lama"
_BINARY = Path("builds", "release", "bin", "downward")
_SECONDS = 30
_BYTES = 2**31
# All actions of a task cost 1 (see sas.py): the two versions name transformed costs differently.
_SEARCH = (
    "let(hlm,landmark_sum(lm_factory=lm_reasonable_orders_hps(lm_rhw()),pref=false),let(hff,ff(),"
    "lazy_greedy([hff,hlm],preferred=[hff,hlm],cost_type=one,reopen_closed=false,"
    f"max_time={_SECONDS})))"
)
_TRIVIAL_TASK = b"""\
begin_version
3
end_version
begin_metric
0
end_metric
1
begin_variable
v
-1
2
Atom off()
Atom on()
end_variable
0
begin_state
0
end_state
begin_goal
1
0 1
end_goal
1
begin_operator
0
0
1
0 0 0 1
1
end_operator
0
"""
_STEP = re.compile(rb"^\((\d+) ?\)$", re.MULTILINE)
_FOUND = 0  # its exit status


def find_fast_downward() -> Optional[Path]:
    """Returns Fast Downward's folder, with its driver and its programs; None if there is none."""
    spec = find_spec(
        DOWNWARD_PACKAGE.replace("-", "_")
    )  # an import would need unified-planning, too
    return None if spec is None or spec.origin is None else Path(spec.origin).parent / "downward"


def installed_version() -> str:
    """Returns the version of the package that is installed, "" if that is unknown."""
    try:
        return metadata.version(DOWNWARD_PACKAGE)
    except metadata.PackageNotFoundError:
        return ""


def find_seed_planner(name: str) -> Optional[Path]:
    """Returns the program of a seed planner, by its name; None for :data:`NONE`.

    Raises:
        SeedPlannerError: There is none of that name, or it is not installed.
    """
    if name == NONE:
        return None
    if name != _LAMA:
        raise SeedPlannerError(f"expected {_LAMA} or {NONE}: {name}")
    folder = find_fast_downward()
    if folder is None:
        raise SeedPlannerError(
            f"{_LAMA} needs the package {DOWNWARD_PACKAGE}, which is not installed: run pip "
            f"install {DOWNWARD_PACKAGE} in the Python of the node, or say {NONE}"
        )
    program = folder / _BINARY
    if not os.access(program, os.X_OK):
        raise SeedPlannerError(
            f"{_LAMA} needs {program}, which cannot be executed: {REINSTALL}, or say {NONE}"
        )
    _try(program)
    return program


def _try(program: Path) -> None:
    """Solves a task with one action.

    Raises:
        SeedPlannerError: That fails; the message names the installed version and the remedy.
    """
    try:
        ended = subprocess.run(  # noqa: S603 (found by find_seed_planner)
            _command(program), input=_TRIVIAL_TASK, capture_output=True, check=False
        )
        said = (ended.stderr or ended.stdout).decode(errors="replace").strip().splitlines()
        why = f"{shorten(said[0])}, exit status" if said else "exit status"
        reason = f"{why} {ended.returncode}" if ended.returncode != _FOUND else ""
    except OSError as err:
        reason = str(err)
    if reason:
        raise SeedPlannerError(
            f"{_LAMA} cannot be used: {program} of {DOWNWARD_PACKAGE} {installed_version()} fails "
            f"({reason}); {REINSTALL}, or say {NONE}"
        )


def _command(program: Path) -> List[str]:
    return [str(program), "--internal-plan-file", "/dev/stdout", "--search", _SEARCH]


class SeedProcess:
    """A search of Fast Downward's, which begins at once. Thread-safe."""

    def __init__(self, program: Path, task: str) -> None:
        """Starts the process.

        Args:
            program: Fast Downward's search.
            task: What it is to plan, in SAS+.

        Raises:
            OSError: The process cannot be started.
        """
        self._output = b""
        self._process = subprocess.Popen(  # noqa: S603 (found by find_seed_planner)
            _command(program),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            start_new_session=True,  # so that Ctrl-C does not reach it
        )
        with contextlib.suppress(ProcessLookupError):  # it has ended already
            # So it ends even if this process is killed.
            resource.prlimit(self._process.pid, resource.RLIMIT_CPU, (_SECONDS, _SECONDS))
            resource.prlimit(self._process.pid, resource.RLIMIT_AS, (_BYTES, _BYTES))
        self._thread = threading.Thread(target=self._run, args=(task.encode(),), daemon=True)
        self._thread.start()

    def _run(self, task: bytes) -> None:
        self._output, _ = self._process.communicate(task)

    @property
    def has_ended(self) -> bool:
        """Tells whether it has ended, with or without a plan."""
        return not self._thread.is_alive()

    @property
    def pid(self) -> int:
        """The number of the process."""
        return self._process.pid

    def plan(self) -> Optional[List[int]]:
        """Returns the numbers of its plan's operators, once it has ended; None without a plan."""
        if not self.has_ended or self._process.returncode != _FOUND:
            return None
        return [int(number) for number in _STEP.findall(self._output)]

    def close(self) -> None:
        """Ends the process."""
        self._process.kill()  # does nothing to one that has ended
        self._thread.join()
