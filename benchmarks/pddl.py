"""The mailbot's grid as a PDDL task, and Fast Downward's optimal planner, for comparison."""

from __future__ import annotations

import re
import subprocess
import sys
import time
from pathlib import Path
from typing import List, Sequence, Tuple

from rosoclingo.tools.pddl.downward import find_fast_downward

# A* without a heuristic: of Fast Downward's optimal configurations (lmcut, hmax, merge-and-shrink,
# blind) the quickest on nearly all of these tasks, since the others take longer to prepare.
SEARCH = "astar(blind())"
SECONDS = 300.0

_DOMAIN = """(define (domain mailbot)
(:requirements :strips :typing)
(:types place package)
(:predicates (at ?p - place) (way ?a ?b - place) (empty) (waits ?k - package ?p - place)
  (carries ?k - package) (destination ?k - package ?p - place) (served ?k - package))
(:action go :parameters (?a ?b - place)
  :precondition (and (at ?a) (way ?a ?b)) :effect (and (at ?b) (not (at ?a))))
(:action pickup :parameters (?k - package ?p - place)
  :precondition (and (at ?p) (waits ?k ?p) (empty))
  :effect (and (carries ?k) (not (waits ?k ?p)) (not (empty))))
(:action deliver :parameters (?k - package ?p - place)
  :precondition (and (at ?p) (carries ?k) (destination ?k ?p))
  :effect (and (served ?k) (empty) (not (carries ?k)))))
"""


def _ways(size: int) -> List[Tuple[str, str]]:
    """Returns the connections of ``graph_bench.lp`` with so many offices along each side."""
    ways = []
    for office in range(1, size * size + 1):
        ways.append((f"c{office}", f"o{office}"))
        if office % size:
            ways.append((f"c{office}", f"c{office + 1}"))
        if office + size <= size * size:
            ways.append((f"c{office}", f"c{office + size}"))
    return ways


def _problem(size: int, requests: Sequence[Tuple[int, int]]) -> str:
    offices = range(1, size * size + 1)
    places = " ".join(f"c{office} o{office}" for office in offices)
    packages = " ".join(f"k{number}" for number in range(len(requests)))
    ways = " ".join(f"(way {v} {w}) (way {w} {v})" for v, w in _ways(size))
    told = " ".join(
        f"(waits k{number} o{origin}) (destination k{number} o{destination})"
        for number, (origin, destination) in enumerate(requests)
    )
    goal = " ".join(f"(served k{number})" for number in range(len(requests)))
    return (
        f"(define (problem grid) (:domain mailbot)\n"
        f"(:objects {places} - place {packages} - package)\n"
        f"(:init (at c1) (empty) {ways} {told})\n(:goal (and {goal})))\n"
    )


def fast_downward(
    size: int, requests: Sequence[Tuple[int, int]], folder: Path
) -> Tuple[float, int]:
    """Plans with one robot that stands at c1 in the beginning.

    Args:
        size: Offices along each side of the grid.
        requests: Origin and destination of each package.
        folder: Where files are written.

    Returns:
        The seconds that the whole process took, with its translator, and the steps of the plan.
    """
    place = find_fast_downward()
    assert place is not None, "scripts/setup --bench installs it"
    driver = place / "fast-downward.py"
    (folder / "domain.pddl").write_text(_DOMAIN)
    (folder / "problem.pddl").write_text(_problem(size, requests))
    command = [sys.executable, str(driver), "--overall-time-limit", f"{SECONDS:.0f}",
               "domain.pddl", "problem.pddl", "--search", SEARCH]  # fmt: skip
    begin = time.perf_counter()
    ended = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    seconds = time.perf_counter() - begin
    length = re.search(r"Plan length: (\d+) step", ended.stdout)
    assert length is not None, ended.stdout[-2000:] + ended.stderr
    return seconds, int(length.group(1))
