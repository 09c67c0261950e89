#!/usr/bin/env python3
"""Benchmarks the controller loop: reactions to an actuator, and many goals with resets.

Run by scripts/bench. Exit status 1 says that a limit is missed.
"""

from __future__ import annotations

import json
import queue
import statistics
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Dict, List, Optional, Sequence, Tuple

import rospy
from actionlib import ClientGoalHandle, CommState
from actionlib_msgs.msg import GoalStatus, GoalStatusArray

from harness import (
    HarnessError,
    Measurements,
    Row,
    Samples,
    measure,
    resident_mebibytes,
    wait_for_node,
)
from rosclingo.msg import ROSClingoActionResult
from rosclingo.ros.action_client import LowLatencyActionClient
from rosoclingo.msg import ROSoClingoAction, ROSoClingoGoal, ROSoClingoIn, ROSoClingoOut

PACKAGE = Path(__file__).resolve().parent.parent / "rosoclingo"
PLANNER = PACKAGE / "example" / "line.lp"  # takes some milliseconds to plan
TIMED_NODE = Path(__file__).with_name("timed_node.py")

TARGETS = (6, 1)  # from one end of the line to the other: 5 steps, 4 reactions
RECORDING, DYN_RESET = "dynamic.incremental.recording", "dynamic.incremental.dyn_reset"
WORK_SECONDS = 0.02  # how long an action takes; the loop is idle before its end

# The past is written off at each reset, so 40 more goals should cost nothing that one of them does
# not give back: what is left is the noise of Python's memory, in up to three processes.
GROWTH_MEBIBYTES = 4

_TIMEOUT_SECONDS = 30.0

Interval = Tuple[float, float]  # in seconds of the monotonic clock


# The planner has to put 12 pigeons into 11 holes, until the second goal makes it easy.
HARD = """
rslot(1..2).
#program state(t).
#external event(ID,(hard;easy),t) : rslot(ID).
want(t) :- event(_,hard,t), not event(_,easy,t).
1 { at(P,H,t) : H=1..11 } 1 :- P=1..12, want(t).
:- at(P,H,t), at(Q,H,t), P<Q.
status(ID,succeeded,t) :- event(ID,_,t).
#program query(t).
#external query(t).
"""


class Actuator:
    """The robot, and the client that gives it goals."""

    QUEUE = 1  # messages that wait for the connection

    def __init__(self, name: str) -> None:
        """Opens the connections to a rosoclingo node.

        Args:
            name: The node's name.
        """
        self._events: queue.Queue[Tuple[bool, float]] = queue.Queue()  # whether it is an action
        self._in = rospy.Publisher(
            f"{name}/in", ROSoClingoIn, tcp_nodelay=True, queue_size=self.QUEUE
        )
        self._out = rospy.Subscriber(
            f"{name}/out", ROSoClingoOut, self._on_action, tcp_nodelay=True
        )
        self._client = LowLatencyActionClient(name, ROSoClingoAction)
        self._sent: List[ClientGoalHandle] = []  # actionlib forgets goals without a reference

    def wait(self) -> None:
        """Waits until the node is there.

        Raises:
            HarnessError: It did not come.
        """
        wait_for_node(self._client, self._in, self._out)

    def close(self) -> None:
        """Closes the connections, before another node of this name starts."""
        self._in.unregister()
        self._out.unregister()
        self._client.stop()

    def execute(self, request: str) -> Tuple[List[Interval], float]:
        """Executes a goal, and answers each of its actions.

        Returns:
            From each answer until the action that followed it, and the milliseconds that each step
            took on average without the actions themselves.

        Raises:
            HarnessError: The goal did not succeed.
        """
        reactions: List[Interval] = []
        begin = time.monotonic()
        handle = self._client.send_goal(ROSoClingoGoal(request, []), self._on_transition, None)
        answered: Optional[float] = None
        actions = 0
        while True:
            try:
                is_action, now = self._events.get(timeout=_TIMEOUT_SECONDS)
            except queue.Empty:
                raise HarnessError(f"nothing came for {request}") from None
            if not is_action:
                break
            if answered is not None:
                reactions.append((answered, now))
            actions += 1
            time.sleep(WORK_SECONDS)
            answered = time.monotonic()
            self._in.publish("robot", "success")
        if handle.get_terminal_state() != GoalStatus.SUCCEEDED or not actions:
            raise HarnessError(f"{request} did not succeed: {handle.get_goal_status_text()}")
        return reactions, ((now - begin) / actions - WORK_SECONDS) * 1e3

    def send(self, request: str) -> None:
        """Sends a goal."""
        self._sent.append(
            self._client.send_goal(ROSoClingoGoal(request, []), self._on_transition, None)
        )

    def wait_for_ends(self, number: int) -> None:
        """Waits until so many of the goals that were sent have ended.

        Raises:
            HarnessError: They do not end.
        """
        try:
            for _ in range(number):
                self._events.get(timeout=_TIMEOUT_SECONDS)
        except queue.Empty:
            raise HarnessError("a goal did not end") from None

    def _on_action(self, _: ROSoClingoOut) -> None:
        self._events.put((True, time.monotonic()))

    def _on_transition(self, handle: ClientGoalHandle) -> None:
        if handle.get_comm_state() == CommState.DONE:
            self._events.put((False, time.monotonic()))


class SearchWatch:
    """Listens to a solver: when a search has gone on for long, and when it ends."""

    LONG_SECONDS = 0.3

    def __init__(self, name: str) -> None:
        """Opens the connections.

        Args:
            name: The solver's name.
        """
        self._begins: Dict[str, float] = {}
        self._long: queue.Queue[str] = queue.Queue()
        self._ends: queue.Queue[Tuple[str, float]] = queue.Queue()
        self._search = ""
        self._listeners = [
            rospy.Subscriber(f"{name}/status", GoalStatusArray, self._on_status),
            rospy.Subscriber(f"{name}/result", ROSClingoActionResult, self._on_result),
        ]

    def wait_for_a_long_search(self) -> None:
        """Waits until a search has gone on for :attr:`LONG_SECONDS`."""
        self._search = self._long.get(timeout=_TIMEOUT_SECONDS)

    def wait_for_its_end(self) -> float:
        """Waits until that search has ended, and returns when that was."""
        while True:
            search, end = self._ends.get(timeout=_TIMEOUT_SECONDS)
            if search == self._search:
                return end

    def _on_status(self, message: GoalStatusArray) -> None:
        now = time.monotonic()
        for status in message.status_list:
            if status.status == GoalStatus.ACTIVE:
                identifier = status.goal_id.id
                begin = self._begins.setdefault(identifier, now)
                if now - begin > self.LONG_SECONDS and identifier != self._search:
                    self._begins[identifier] = float("inf")  # said once
                    self._long.put(identifier)

    def _on_result(self, message: ROSClingoActionResult) -> None:
        self._ends.put((message.status.goal_id.id, time.monotonic()))


@dataclass
class Execution:
    """Goals that were executed, one after the other.

    Attributes:
        reactions: From the actuator's answer to the next action, in ms.
        planner: How long of that the planner was grounding and solving.
        steps: Time per step of each goal, in ms.
        memory: Of all nodes together after each goal, in MiB.
    """

    reactions: List[float] = field(default_factory=list)
    planner: List[float] = field(default_factory=list)
    steps: List[float] = field(default_factory=list)
    memory: List[float] = field(default_factory=list)


class Bench(Measurements):
    """The measurements."""

    def run(self) -> None:
        """Measures everything."""
        for together, name, limit in ((False, "three nodes", 20), (True, "one process", 5)):
            self._reactions(f"{name}, recording", self._execute(RECORDING, 60, 9, together), limit)
            execution = self._execute(DYN_RESET, 20, 50, together)
            self._reactions(f"{name}, dyn_reset", execution, limit)
            self._many_goals(name, execution)
        self._interruptions()

    def _reactions(self, name: str, execution: Execution, limit: float) -> None:
        # The planner's own time comes from its log, by the clock that all processes share: what it
        # took in this very reaction, not in another run.
        planner = Samples("ms", tuple(execution.planner))
        ros = Samples("ms", tuple(execution.reactions))
        rest = [all_ - own for all_, own in zip(ros.values, planner.values)]
        value = statistics.median(rest)
        name = f"reaction, {name}"
        self.report.add(Row(name, planner, ros, "median of the rest", value, "ms", limit))

    def _many_goals(self, name: str, execution: Execution) -> None:
        steps = Samples("ms", tuple(execution.steps))
        first, last = Samples("ms", steps.values[:10]), Samples("ms", steps.values[-10:])
        ratio = last.median / first.median
        name = f"{len(steps.values)} goals, {name}"
        self.report.add(
            Row(f"{name}, time per step", None, steps, "last 10 / first 10", ratio, "x", 1.5)
        )
        memory = Samples("MiB", tuple(execution.memory[9:]))
        growth = memory.values[-1] - memory.values[0]
        self.report.add(
            Row(f"{name}, memory", None, memory, "last - 10th", growth, "MiB", GROWTH_MEBIBYTES)
        )

    def _interruptions(self) -> None:
        """Measures how soon a goal ends a search that would go on for minutes."""
        encoding = self.folder / "hard.lp"
        encoding.write_text(HARD)
        mode = str(PACKAGE / "modes" / f"{RECORDING}.lp")
        self.system.rosrun(
            "rosclingo", "run.py", "-f", mode, "-c", "steps=60", name="hard_controller"
        )
        self.system.rosrun("rosclingo", "run.py", "-f", str(encoding), name="hard_planner")
        solvers = ("_controller:=hard_controller", "_planner:=hard_planner")
        self.system.rosrun("rosoclingo", "run.py", *solvers, name="hard")
        actuator = Actuator("hard")
        actuator.wait()
        watch = SearchWatch("hard_planner")
        times = []
        for _ in range(10):
            actuator.send("hard")
            watch.wait_for_a_long_search()
            begin = time.monotonic()
            actuator.send("easy")
            times.append((watch.wait_for_its_end() - begin) * 1e3)
            actuator.wait_for_ends(2)
        samples = Samples("ms", tuple(times))
        name = "goal interrupts a search, worst"
        self.report.add(Row(name, None, samples, "max", max(times), "ms", 200))

    def _execute(self, mode: str, steps: int, goals: int, together: bool) -> Execution:
        """Executes goals in a system of its own, either one process or three nodes."""
        name = f"{mode.rpartition('.')[2]}_{'one' if together else 'three'}"
        log = self.folder / f"{name}.json"
        planner = [str(TIMED_NODE), str(log), "-f", str(PLANNER)]
        controller = ["-f", str(PACKAGE / "modes" / f"{mode}.lp"), "-c", f"steps={steps}"]
        actuator = Actuator(name)
        if together:
            command = [sys.executable, *planner, "+", *controller, f"__name:={name}"]
            self.system.start(name, command)
            nodes = [name]
        else:
            nodes = [f"{name}_controller", f"{name}_planner", name]
            self.system.start(nodes[1], [sys.executable, *planner, f"__name:={nodes[1]}"])
            self.system.rosrun("rosclingo", "run.py", *controller, name=nodes[0])
            solvers = (f"_controller:={nodes[0]}", f"_planner:={nodes[1]}")
            self.system.rosrun("rosoclingo", "run.py", *solvers, name=name)
        processes = [self.system.node_pid(node) for node in nodes]
        actuator.wait()
        execution = Execution()
        reactions: List[Interval] = []
        for number in range(goals):
            target = TARGETS[number % len(TARGETS)]
            new, step = actuator.execute(f"visit({target})")
            reactions += new
            execution.steps.append(step)
            execution.memory.append(sum(map(resident_mebibytes, processes)))
        for node in reversed(nodes):
            self.system.end(node)
        busy = json.loads(log.read_text())
        execution.reactions = [(end - begin) * 1e3 for begin, end in reactions]
        execution.planner = [_overlap(reaction, busy) * 1e3 for reaction in reactions]
        return execution


def _overlap(interval: Interval, others: Sequence[Interval]) -> float:
    """Returns how long of an interval one of the others went on; these do not overlap."""
    begin, end = interval
    return sum(max(0.0, min(end, last) - max(begin, first)) for first, last in others)


def main() -> int:
    """Measures, prints the table, and returns the exit status: 1 says that a limit is missed."""
    return measure("rosoclingo", lambda *parts: Bench(*parts).run())


if __name__ == "__main__":
    sys.exit(main())
