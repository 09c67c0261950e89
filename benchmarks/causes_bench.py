#!/usr/bin/env python3
"""Times what it adds to a request that the mailbot looks for the causes of 20 observations.

In each draw, a mailbot fails to drive and looks around, and people announce ways that are blocked,
until 20 observations are noted. One request is timed, with the last of these as news: a solver node
is told, finds the explanations, and knows what holds. The same is told to a mailbot that does not
look for causes, in turn.

Run by scripts/bench. Exit status 1 says that a limit is missed.
"""

from __future__ import annotations

import random
import sys
from pathlib import Path
from typing import Callable, Dict, List, Sequence

from harness import Report, RosSystem, Row, Samples, measure, milliseconds
from rosclingo.ros.client import Client
from rosclingo.wire.commands import Command, GetPrograms, Part, Programs, Reply, Restart
from rosoclingo.loop.planner.demand import Demand, step_parts

MAILBOT = Path(__file__).resolve().parents[1] / "rosoclingo_aspprograms" / "mailbot"
OFFICE = str(MAILBOT / "instances" / "graph_wg.lp")
ENCODINGS = {"without": str(MAILBOT / "mailbot.lp"), "with": str(MAILBOT / "mailbot_causes.lp")}
DRAWS = 40
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
    demand.begin(programs)
    run([demand.ground([Part("base")])])
    for step, atoms in enumerate([[], *steps]):
        demand.tell([atom.replace("T)", f"{step})") for atom in atoms])
        commands = [demand.ground(step_parts(step)), *demand.take_pending(), *demand.prepare(step)]
        taken, reply = milliseconds(lambda commands=commands: run(commands))  # type: ignore[misc]
        assert reply.failure is None, reply.failure
    return taken


def bench(system: RosSystem, folder: Path, report: Report) -> None:
    """Adds the rows of the table."""
    dice = random.Random(1)
    clients: Dict[str, Client] = {}
    for name, encoding in ENCODINGS.items():
        system.rosrun("rosclingo", "run.py", "-f", OFFICE, "-f", encoding, name=name)
        clients[name] = Client(name)
        clients[name].wait(30)
    taken: Dict[str, List[float]] = {name: [] for name in clients}
    for _ in range(DRAWS):
        steps = draw(dice)
        for name, client in clients.items():
            taken[name].append(explain(client.run, steps))
    plain, causes = (Samples("ms", tuple(taken[name])) for name in ("without", "with"))
    report.add(Row("news without causes", None, plain))
    name = f"explanation of {OBSERVATIONS} observations"
    value = causes.median - plain.median
    report.add(Row(name, None, causes, "median - median", value, "ms", MEDIAN))
    value = max(causes.values) - plain.median
    report.add(Row(f"{name}, worst", None, causes, "max - median", value, "ms", WORST))


if __name__ == "__main__":
    sys.exit(measure("causes", bench))
