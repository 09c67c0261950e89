#!/usr/bin/env python3
"""Times explanations of 20 observations in the office, by a solver node and in process.

In each draw, a mailbot fails to drive and looks around, and people announce ways that are blocked,
until 20 observations are noted. What is timed is one request, with the last of these as news: the
planner is told, finds the explanations, and knows what holds.

Run by scripts/bench. Exit status 1 says that a limit is missed.
"""

from __future__ import annotations

import random
import sys
from pathlib import Path
from typing import Callable, List, Sequence, Tuple

from harness import Report, RosSystem, Row, Samples, measure, milliseconds
from rosclingo.ros.client import Client
from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.wire.commands import Command, GetPrograms, Part, Programs, Reply, Restart
from rosoclingo.loop.planner.demand import Demand

MAILBOT = Path(__file__).resolve().parents[1] / "rosoclingo_aspprograms" / "mailbot"
FILES = (str(MAILBOT / "instances" / "graph_wg.lp"), str(MAILBOT / "mailbot_causes.lp"))
DRAWS = 50
OBSERVATIONS = 20
MEDIAN, WORST = 50.0, 200.0  # ms

Run = Callable[[Sequence[Command]], Reply]

WAYS = [
    *((f"c{number}", f"c{number + 1}") for number in range(1, 6)),
    *(("c1", "o1"), ("c1", "o3"), ("c2", "o13"), ("c2", "o2"), ("c3", "o14"), ("c3", "o4")),
    *(("c3", "o5"), ("c4", "o11"), ("c4", "o6"), ("c4", "o7"), ("c5", "o12"), ("c5", "o8")),
    *(("c5", "o9"), ("c6", "o10"), ("open2", "open3")),
]
NEAR = ("c1", "c6", "open2")  # to where the robot stands


def draw(dice: random.Random) -> List[List[str]]:
    """Returns what is told in each step, of which 20 observations come."""
    target = dice.choice(NEAR)
    way = ",".join(sorted(("open1", target)))
    drive = [f"event(commit,do(mailbot,go({target})),T)", "event(mailbot,failure,T)"]
    look = [
        "event(commit,do(mailbot,look),T)",
        "event(info,at(mailbot,open1),T)",
        f"event(info,{dice.choice(('un', ''))}blocked({way}),T)",
        "event(mailbot,success,T)",
    ]
    told = OBSERVATIONS - 4  # a drive, a look, where that was, and what was seen
    said = [[f"event(info,blocked({v},{w}),T)"] for v, w in dice.sample(WAYS, told)]
    before = dice.randrange(told)
    return [*said[:before], drive, look, *said[before:]]


def explain(run: Run, steps: Sequence[Sequence[str]]) -> float:
    """Tells a solver what happens, and returns how long the last request took, in milliseconds."""
    demand = Demand()
    taken = 0.0
    run([Restart()])
    (programs,) = run([GetPrograms()]).answers
    assert isinstance(programs, Programs)
    demand.begin(programs.parts)
    run([demand.ground([Part("base")])])
    for step, atoms in enumerate([[], *steps]):
        demand.tell([atom.replace("T)", f"{step})") for atom in atoms])
        commands = [demand.ground_step(step), *demand.take_pending(), *demand.prepare(step)]
        taken, reply = milliseconds(lambda commands=commands: run(commands))  # type: ignore[misc]
        assert reply.failure is None, reply.failure
    return taken


def bench(system: RosSystem, _: Path, report: Report) -> None:
    """Adds the rows of the table."""
    dice = random.Random(1)
    draws = [draw(dice) for _ in range(DRAWS)]
    system.rosrun(
        "rosclingo",
        "run.py",
        *[word for file in FILES for word in ("-f", file)],
        name="planner",
    )
    client, engine = Client("planner"), Engine(Options(FILES))
    client.wait(30)
    pairs: List[Tuple[float, float]] = []
    for steps in draws:
        pairs.append((explain(engine.run, steps), explain(client.run, steps)))
    base, ros = (Samples("ms", values) for values in zip(*pairs))
    name = f"explanation of {OBSERVATIONS} observations"
    report.add(Row(name, base, ros, "median", ros.median, "ms", MEDIAN))
    report.add(Row(f"{name}, worst", base, ros, "maximum", max(ros.values), "ms", WORST))


if __name__ == "__main__":
    sys.exit(measure("causes", bench))
