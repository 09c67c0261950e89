#!/usr/bin/env python3
"""Times the plain encoding of docs/modelling.md, and the library, on larger and larger maps.

A map is a corridor with a room beside each of its places. Robots bring things between random rooms,
by the plain encoding of the guide, and by the mailbot's, which has the library for agendas. Each
plan is made by plan.py in a process of its own, whose processor time it is. Run by hand:

    python benchmarks/modelling.py [DRAWS]
"""

from __future__ import annotations

import random
import re
import resource
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Dict, List, Optional, Sequence, Tuple

ROOT = Path(__file__).resolve().parents[1]
GUIDE = ROOT / "docs/modelling.md"
MAILBOT = ROOT / "rosoclingo_aspprograms" / "mailbot" / "mailbot.lp"
PLACES, REQUESTS, ROBOTS = (10, 20, 40, 80), (1, 2, 4), (1, 3)
SECONDS = 60  # that a plan may take


def files() -> Dict[str, str]:
    """Returns the files of the guide, by their names."""
    text = GUIDE.read_text()
    return dict(re.findall(r"`(\w+\.lp)`[^`]*?:\n\n```prolog\n(.*?)```", text, re.DOTALL))


def building(places: int, robots: int) -> Tuple[str, List[str]]:
    """Returns a map for both encodings, and its rooms."""
    half = places // 2
    ways = [(f"c{i}", f"c{i + 1}") for i in range(1, half)]
    ways += [(f"c{i}", f"r{i}") for i in range(1, half + 1)]
    rooms = [f"r{i}" for i in range(1, half + 1)]
    lines = ["#program base."]
    lines += [f"robot(b{i}). start(b{i},c{1 + i % half})." for i in range(robots)]
    lines += [f"way({v},{w}). connection({v},{w})." for v, w in ways]
    lines += [f"office({room})." for room in rooms]
    return "\n".join(lines), rooms


def seconds(encoding: Sequence[str], places: int, robots: int, goals: int, draw: int) -> float:
    """Returns how long it takes until plan.py has a plan; infinite for too long."""
    chance = random.Random(draw)
    text, rooms = building(places, robots)
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "places.lp").write_text(text)
        for name, content in files().items():
            Path(folder, name).write_text(content)
        words = ["places.lp", *encoding, "-c", f"slots={goals}", "-c", "steps=300"]
        for _ in range(goals):
            words += ["--goal", "bring({},{})".format(*chance.sample(rooms, 2))]
        command = [sys.executable, "-m", "rosoclingo.desk.plan", *words, "--patience", "1"]
        before = _children()
        try:
            ended = subprocess.run(
                command, cwd=folder, capture_output=True, timeout=SECONDS, check=False
            )
        except subprocess.TimeoutExpired:
            return float("inf")
    if ended.returncode:
        raise SystemExit(f"{' '.join(command)}: {ended.stderr.decode()}")
    return _children() - before


def _children() -> float:
    """Returns the processor time of the processes that have ended."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def median(draws: Sequence[float]) -> Optional[float]:
    """Returns the median; None if it is too long."""
    found = statistics.median(draws)
    return None if found == float("inf") else found


def main(draws: int) -> None:
    """Prints a table for the guide."""
    print("| places | robots | requests | plain | library for agendas |\n|---|---|---|---|---|")
    for places in PLACES:
        for robots in ROBOTS:
            for goals in REQUESTS:
                row = []
                for encoding in (["my_robot.lp"], [str(MAILBOT)]):
                    first = seconds(encoding, places, robots, goals, 0)
                    more = [] if first == float("inf") else range(1, draws)
                    found = median(
                        [first, *(seconds(encoding, places, robots, goals, n) for n in more)]
                    )
                    row.append(f"over {SECONDS} s" if found is None else f"{found:.1f} s")
                print(f"| {places} | {robots} | {goals} | {' | '.join(row)} |", flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 3)
