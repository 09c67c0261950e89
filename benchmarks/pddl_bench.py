"""Times how long the mailbot plans over ROS, against Fast Downward on the same instances.

Over ROS: from the moment at which the first goal is sent until the first action is heard, with
three nodes and with one. Fast Downward: its whole process, with its translator. All in turn, draw
by draw.
"""

from __future__ import annotations

import queue
import random
import statistics
import sys
import time
from pathlib import Path
from typing import Dict, List, NamedTuple, Sequence, Tuple

import matplotlib as mpl
import rospy

from harness import RESULTS, HarnessError, Report, RosSystem, Row, Samples, measure, wait_for_node
from pddl import fast_downward
from rosclingo.low_latency import LowLatencyActionClient
from rosoclingo.msg import ROSoClingoAction, ROSoClingoGoal, ROSoClingoOut, ROSoClingoPlan

ROOT = Path(__file__).resolve().parents[1]
MAILBOT = ROOT / "rosoclingo_aspprograms" / "mailbot"
MODE = ROOT / "rosoclingo" / "modes" / "dynamic.incremental.dyn_reset.lp"
_TIMEOUT_SECONDS = 120.0
_ONE_TO_THREE = 0.7  # what one node may need of the time of three


class Instance(NamedTuple):
    """Offices along each side of the grid, requests, and what we may need of the other's time."""

    size: int
    requests: int
    limit: float


INSTANCES = (
    Instance(6, 3, 1.0),
    Instance(10, 1, 1.0),
    Instance(10, 3, 1.0),
    Instance(20, 3, 1.0),
    Instance(10, 10, 0.5),
    Instance(20, 10, 0.5),
)
DRAWS = 10


def draw(instance: Instance, seed: int) -> List[Tuple[int, int]]:
    """Returns random requests."""
    dice = random.Random(f"{instance.size} {instance.requests} {seed}")
    offices = range(1, instance.size**2 + 1)
    pairs = (dice.sample(offices, 2) for _ in range(instance.requests))
    return [(origin, destination) for origin, destination in pairs]


class Planning:
    """A rosoclingo that is started anew for each draw."""

    def __init__(self, system: RosSystem, instance: Instance, together: bool) -> None:
        """Starts what stays: two solvers, or nothing.

        Args:
            system: The ROS system.
            instance: The map, and how many requests are dealt with at the same time.
            together: Whether one node does all.
        """
        self._system = system
        self._together = together
        self._name = f"{'one' if together else 'three'}_{instance.size}_{instance.requests}"
        files = [MAILBOT / "instances" / "graph_bench.lp", MAILBOT / "mailbot.lp"]
        self._planner = [part for file in files for part in ("-f", str(file))]
        for option in (f"x={instance.size}", f"y={instance.size}", f"slots={instance.requests}"):
            self._planner += ["-c", option]
        self._nodes: List[str] = []
        if not together:
            mode = ["-f", str(MODE), "-c", "steps=500"]
            for role, arguments in (("controller", mode), ("planner", self._planner)):
                name = f"{self._name}_{role}"
                system.rosrun("rosclingo", "run.py", *arguments, name=name)
                self._nodes.append(name)

    def plan(self, requests: Sequence[Tuple[int, int]]) -> Tuple[float, int]:
        """Plans in a fresh node.

        Returns:
            The seconds until the first action, and the steps of the plan.
        """
        if self._together:
            self._system.rosrun("rosoclingo", "run-1.0.py", *self._planner, name=self._name)
        else:
            solvers = (f"_controller:={self._nodes[0]}", f"_planner:={self._nodes[1]}")
            self._system.rosrun("rosoclingo", "run.py", *solvers, name=self._name)
        actions: queue.Queue[float] = queue.Queue()
        plans: List[ROSoClingoPlan] = []
        topics = [
            rospy.Subscriber(
                f"{self._name}/out",
                ROSoClingoOut,
                lambda _: actions.put(time.perf_counter()),
                tcp_nodelay=True,
            ),
            rospy.Subscriber(f"{self._name}/plan", ROSoClingoPlan, plans.append),
        ]
        client = LowLatencyActionClient(self._name, ROSoClingoAction)
        wait_for_node(client, *topics)
        begin = time.perf_counter()
        goals = [client.send_goal(ROSoClingoGoal(f"bring({o},{p})", [])) for o, p in requests]
        try:
            seconds = actions.get(timeout=_TIMEOUT_SECONDS) - begin
        except queue.Empty:
            raise HarnessError(f"no plan for {requests}") from None
        end = time.monotonic() + _TIMEOUT_SECONDS
        while not (plans and plans[-1].actions):  # another connection
            if time.monotonic() > end:
                raise HarnessError("the plan did not come")
            time.sleep(0.01)
        steps = len(plans[-1].actions)
        del goals
        for topic in topics:
            topic.unregister()
        self._system.end(self._name)
        return seconds, steps

    def close(self) -> None:
        """Ends what stayed."""
        for node in self._nodes:
            self._system.end(node)


def measure_instance(
    system: RosSystem, folder: Path, report: Report, instance: Instance
) -> Dict[str, float]:
    """Adds the rows of an instance, and returns the medians in milliseconds."""
    three, one = (Planning(system, instance, together) for together in (False, True))
    times: Dict[str, List[float]] = {"Fast Downward": [], "three nodes": [], "one node": []}
    for seed in range(DRAWS):
        requests = draw(instance, seed)
        best, length = fast_downward(instance.size, requests, folder)
        times["Fast Downward"].append(best * 1e3)
        for name, planning in (("three nodes", three), ("one node", one)):
            seconds, steps = planning.plan(requests)
            if steps != length:
                raise HarnessError(f"{requests}: {steps} steps, the shortest plan has {length}")
            times[name].append(seconds * 1e3)
    three.close()
    medians = {name: statistics.median(values) for name, values in times.items()}
    ratio = medians["three nodes"] / medians["Fast Downward"]
    name = f"plan {instance.requests} of {instance.size**2} offices"
    others = Samples("ms", tuple(times["Fast Downward"]))
    for nodes, limit in (("three nodes", instance.limit), ("one node", None)):
        samples = Samples("ms", tuple(times[nodes]))
        ratio = medians[nodes] / medians["Fast Downward"]
        row = Row(f"{name}, {nodes}", others, samples, "to Fast Downward", ratio, "x", limit)
        report.add(row)
    ratio = medians["one node"] / medians["three nodes"]
    samples = Samples("ms", tuple(times["one node"]))
    report.add(Row(f"{name}", None, samples, "one node to three", ratio, "x", _ONE_TO_THREE))
    return medians


def plot(medians: Dict[Instance, Dict[str, float]]) -> Path:
    """Draws the medians, and returns the picture's file."""
    mpl.use("Agg")
    from matplotlib import pyplot as plt  # noqa: PLC0415 (the backend has to be set first)

    figure, axes = plt.subplots(figsize=(7, 4.5))
    names = [f"{i.size} x {i.size}\n{i.requests}" for i in medians]
    for name in ("Fast Downward", "three nodes", "one node"):
        axes.plot(names, [of[name] for of in medians.values()], "o-", label=name)
    axes.set(xlabel="offices and requests", ylabel="time to the first action (ms)", yscale="log")
    axes.set_title(f"Shortest plan of the mailbot, median of {DRAWS} random draws")
    axes.grid(True, which="both", alpha=0.3)
    axes.legend(fontsize="small")
    figure.tight_layout()
    RESULTS.mkdir(exist_ok=True)
    file = RESULTS / "pddl.png"
    figure.savefig(file, dpi=120)
    return file


def run(system: RosSystem, folder: Path, report: Report) -> None:
    """Measures all instances."""
    medians = {}
    for instance in INSTANCES:
        medians[instance] = measure_instance(system, folder, report, instance)
    print(f"\nplot: {plot(medians)}")


if __name__ == "__main__":
    sys.exit(measure("pddl", run))
