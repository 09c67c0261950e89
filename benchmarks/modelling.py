#!/usr/bin/env python3
"""Times the encodings of docs/modelling.md on larger and larger maps: how large each can get.

A map is a corridor with a room beside each of its places. Robots bring things between random rooms:
by the plain encoding of the guide, by its encodings for actions.lp, without and with batteries and
bags, and by the mailbot's, which has agenda.lp. Each plan is made by plan.py in a process of its
own, whose processor time it is. Run by hand:

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
from typing import Dict, List, Sequence, Tuple

ROOT = Path(__file__).resolve().parents[1]
GUIDE = ROOT / "docs/modelling.md"
ASP = ROOT / "rosoclingo_aspprograms"
ACTIONS, MAILBOT = str(ASP / "lib" / "actions.lp"), str(ASP / "mailbot" / "mailbot.lp")
PLACES, ROBOTS, REQUESTS = (10, 40, 160), (1, 3), (1, 2, 6, 20)
SECONDS = 60  # that a plan may take
ENCODINGS = {
    "plain": ["my_plain.lp"],
    "`actions.lp`": [ACTIONS, "my_robot.lp"],
    "with batteries and bags": [ACTIONS, "my_robot.lp", "my_battery.lp", "my_bags.lp"],
    "`agenda.lp`": [MAILBOT],
}


def files() -> Dict[str, str]:
    """Returns the files of the guide, by their names."""
    text = GUIDE.read_text()
    return dict(re.findall(r"`(my_\w+\.lp)`[^`]*?:\n\n```prolog\n(.*?)```", text, re.DOTALL))


def building(places: int, robots: int) -> Tuple[str, List[str]]:
    """Returns a map for all encodings, and its rooms."""
    half = places // 2
    ways = [(f"c{i}", f"c{i + 1}") for i in range(1, half)]
    ways += [(f"c{i}", f"r{i}") for i in range(1, half + 1)]
    rooms = [f"r{i}" for i in range(1, half + 1)]
    lines = ["#program base.", "charger(c1)."]
    lines += [f"robot(b{i}). start(b{i},c{1 + i % half})." for i in range(robots)]
    lines += [f"corridor({v},{w}). connection({v},{w})." for v, w in ways]
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
        words = ["places.lp", *encoding, "-c", f"slots={goals}", "-c", "steps=3000"]
        words += ["-c", f"full={2 * places}"] if "my_battery.lp" in encoding else []
        for _ in range(goals):
            words += ["--goal", "bring({},{})".format(*chance.sample(rooms, 2))]
        command = [sys.executable, "-m", "rosoclingo.tools.plan", *words, "--patience", "0.3"]
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


class Column:
    """The times of one encoding, which is not tried any more where less has taken too long."""

    def __init__(self, encoding: Sequence[str], draws: int) -> None:
        self._encoding = encoding
        self._draws = draws
        self._too_large: List[Tuple[int, int, int]] = []

    def cell(self, places: int, robots: int, goals: int) -> str:
        """Returns the median, as the table says it."""
        size = (places, robots, goals)
        if any(all(a >= b for a, b in zip(size, known)) for known in self._too_large):
            return "-"
        draws: List[float] = []
        while len(draws) < self._draws and float("inf") not in draws:
            draws.append(seconds(self._encoding, *size, len(draws)))
        if draws[-1] == float("inf"):
            self._too_large.append(size)
            return f"over {SECONDS} s"
        return f"{statistics.median(draws):.1f} s"


def main(draws: int) -> None:
    """Prints a table for the guide."""
    columns = [Column(encoding, draws) for encoding in ENCODINGS.values()]
    print(f"| places | robots | requests | {' | '.join(ENCODINGS)} |")
    print(f"|{'---|' * (3 + len(columns))}")
    for places in PLACES:
        for robots in ROBOTS:
            for goals in REQUESTS:
                cells = [column.cell(places, robots, goals) for column in columns]
                print(f"| {places} | {robots} | {goals} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 3)
