"""A run in a process whose memory is limited: ``short_of_memory.py MODE MEGABYTES KIND``.

Prints, as JSON, each goal's request with its statuses and the reason of its end, what was
published, and by what the loop has ended, if it has.
"""

from __future__ import annotations

import json
import resource
import sys
from pathlib import Path
from typing import List

from rosclingo.solver.options import Options
from rosoclingo.in_process.parts import make_parts
from rosoclingo.in_process.system import System

ENCODING = Path(__file__).resolve().parents[1] / "encodings" / "large_step.lp"
LARGE = "visit(r1,4)"
NOW = {"alone": [LARGE], "together": [LARGE, "visit(r2,3)"], "meanwhile": ["visit(r2,3)"]}
LATER = ["visit(r2,2)", "visit(r1,2)"]


class Run(System):
    """A run in which more is asked for while the first action is on its way."""

    meanwhile: List[str]

    def turn(self) -> bool:
        """Asks for it, and answers."""
        while self.meanwhile:
            self.request(self.meanwhile.pop())
        return super().turn()


def main() -> None:
    mode, megabytes, kind = sys.argv[1:]
    run = Run(make_parts(mode, Options((str(ENCODING),)), ("-c", "steps=20")).loop)
    run.meanwhile = []
    run.request("visit(r2,2)")
    assert run.run() is None
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    limit = pages * resource.getpagesize() + int(megabytes) * 2**20
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    run.meanwhile = [LARGE] if kind == "meanwhile" else []
    for request in NOW[kind]:
        run.request(request)
    error = run.run()
    for request in LATER:
        run.request(request)
    error = error or run.run()
    goals = [(goal.request, goal.words, goal.reason) for goal in run.goals]
    print(json.dumps([goals, run.published, error and str(error)]))


if __name__ == "__main__":
    main()
