"""Fast Downward's search in a process of its own, with the first iteration of LAMA.

It is an optional dependency, which the Python package up-fast-downward has.
"""

from __future__ import annotations

import contextlib
import os
import re
import resource
import subprocess
import threading
from importlib.util import find_spec
from pathlib import Path
from typing import List, Optional

from rosoclingo.errors import SeedPlannerError

DOWNWARD_PACKAGE = "up-fast-downward"

NONE = "none"
"""Stands for no seed planner."""

_LAMA = "lama"
_BINARY = Path("builds", "release", "bin", "downward")
_SECONDS = 30
_BYTES = 2**31
_SEARCH = (
    "let(hlm,landmark_sum(lm_factory=lm_reasonable_orders_hps(lm_rhw()),"
    "transform=adapt_costs(one),pref=false),let(hff,ff(transform=adapt_costs(one)),"
    "lazy_greedy([hff,hlm],preferred=[hff,hlm],cost_type=one,reopen_closed=false,"
    f"max_time={_SECONDS})))"
)
_STEP = re.compile(rb"^\((\d+) ?\)$", re.MULTILINE)
_FOUND = 0  # its exit status


def find_fast_downward() -> Optional[Path]:
    """Returns Fast Downward's folder, with its driver and its programs; None if there is none."""
    spec = find_spec(
        DOWNWARD_PACKAGE.replace("-", "_")
    )  # an import would need unified-planning, too
    return None if spec is None or spec.origin is None else Path(spec.origin).parent / "downward"


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
            f"{_LAMA} needs {program}, which cannot be executed: install the package "
            f"{DOWNWARD_PACKAGE} anew, or say {NONE}"
        )
    return program


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
            [str(program), "--internal-plan-file", "/dev/stdout", "--search", _SEARCH],
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
