"""The mailbot on a grid for benchmarks: over ROS with three nodes or one, and in process."""

from __future__ import annotations

import queue
import random
import threading
import time
from pathlib import Path
from typing import Callable, List, NamedTuple, Sequence, Tuple, TypeVar

import rospy
from actionlib import ClientGoalHandle

from harness import HarnessError, RosSystem, wait_for_node
from rosclingo.ros.action_client import LowLatencyActionClient
from rosclingo.ros.low_latency import publisher, subscriber
from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.wire.commands import Result, Truth
from rosoclingo.loop.journal import LoopWaits, decode
from rosoclingo.loop.planner.planner import Planner
from rosoclingo.loop.values.atoms import Plan, event
from rosoclingo.msg import (
    ROSoClingoAction,
    ROSoClingoEvent,
    ROSoClingoGoal,
    ROSoClingoIn,
    ROSoClingoOut,
    ROSoClingoPlan,
)

ROOT = Path(__file__).resolve().parents[1]
FOLDER = ROOT / "rosoclingo_aspprograms" / "mailbot"
ENCODING = FOLDER / "mailbot.lp"
ROBOTS = Path(__file__).with_name("encodings") / "robots.lp"
MODES = ROOT / "rosoclingo" / "modes"
MODE = MODES / "dynamic.incremental.dyn_reset.lp"
_STEPS = 500  # more than the longest plan has
_TIMEOUT_SECONDS = 30.0

Request = Tuple[int, int]
"""The offices from which and to which something is brought."""

_Came = TypeVar("_Came")


class Grid(NamedTuple):
    """The mailbot's task.

    Attributes:
        size: Offices along each side of the grid.
        requests: How many are dealt with at the same time.
        robots: How many robots there are.
    """

    size: int
    requests: int
    robots: int = 1

    @property
    def files(self) -> Tuple[str, ...]:
        """The encodings for the planner."""
        return (str(FOLDER / "instances" / "graph_bench.lp"), str(ROBOTS), str(ENCODING))

    @property
    def options(self) -> Tuple[str, ...]:
        """The planner's options."""
        constants = {"x": self.size, "y": self.size, "slots": self.requests, "robots": self.robots}
        return tuple(part for item in constants.items() for part in ("-c", "{}={}".format(*item)))

    def draw(self, seed: object) -> List[Request]:
        """Returns random requests."""
        dice = random.Random(f"{self.size} {self.requests} {seed}")
        offices = range(1, self.size**2 + 1)
        pairs = (dice.sample(offices, 2) for _ in range(self.requests))
        return [(origin, destination) for origin, destination in pairs]


def bring(request: Request) -> str:
    """Returns a request as it is sent."""
    return f"bring({request[0]},{request[1]})"


class InProcess:
    """A planner in this process that has grounded what it can before it is told anything."""

    def __init__(self, grid: Grid) -> None:
        self._planner = Planner(Engine(Options(grid.files, grid.options)))
        self._planner.begin()

    def plan(self, requests: Sequence[Request]) -> Plan:
        """Plans as the incremental modes do, told all at once.

        Raises:
            HarnessError: The encoding does not know a request.
        """
        planner, horizon = self._planner, 0
        events = [event(str(slot), bring(pair), 0) for slot, pair in enumerate(requests, 1)]
        if planner.tell(events):
            raise HarnessError("the encoding does not know the requests")
        while True:
            planner.set_external(f"query({horizon})", Truth.TRUE)
            outcome = planner.search(0, horizon, lambda: False)
            if outcome.result is Result.SAT:
                return Plan(outcome.symbols)
            planner.set_external(f"query({horizon})", Truth.FALSE)
            first, horizon = horizon + 1, planner.needed or horizon + 1
            planner.ground_steps(range(first, horizon + 1))


class Run:
    """A rosoclingo node as its client and its robots see it. Times are those of perf_counter."""

    def __init__(self, name: str) -> None:
        """Waits until the node is there, and waits for something to do."""
        self._actions: queue.Queue[Tuple[float, ROSoClingoOut]] = queue.Queue()
        self._plans: queue.Queue[Tuple[float, ROSoClingoPlan]] = queue.Queue()
        idle = threading.Event()

        def note(message: ROSoClingoEvent) -> None:
            if isinstance(decode(message), LoopWaits):
                idle.set()

        self._in = publisher(f"{name}/in", ROSoClingoIn)
        journal = subscriber(f"{name}/journal", ROSoClingoEvent, note)
        self._topics = [
            subscriber(
                f"{name}/out",
                ROSoClingoOut,
                lambda action: self._actions.put((time.perf_counter(), action)),
            ),
            subscriber(
                f"{name}/plan",
                ROSoClingoPlan,
                lambda plan: self._plans.put((time.perf_counter(), plan)),
            ),
        ]
        self._client = LowLatencyActionClient(name, ROSoClingoAction)
        self._sent: List[ClientGoalHandle] = []  # actionlib forgets goals without a reference
        wait_for_node(self._client, self._in, *self._topics)
        if not idle.wait(_TIMEOUT_SECONDS):
            raise HarnessError(f"{name} is not ready")
        journal.unregister()

    def send(self, request: Request) -> ClientGoalHandle:
        """Sends a goal."""
        return self.ask_for(bring(request))

    def ask_for(self, request: str) -> ClientGoalHandle:
        """Sends a goal with any request."""
        self._sent.append(self._client.send_goal(ROSoClingoGoal(request, [])))
        return self._sent[-1]

    def begin(self, *requests: str) -> float:
        """Sends goals, and returns the milliseconds until the first action."""
        start = time.perf_counter()
        for request in requests:
            self.ask_for(request)
        return (self.action()[0] - start) * 1e3

    def say(self, source: str, value: str) -> None:
        """Sends a message."""
        self._in.publish(source, value)

    def action(self) -> Tuple[float, ROSoClingoOut]:
        """Returns when the next action came, and which."""
        return _next(self._actions, "action")

    def actions(self) -> List[ROSoClingoOut]:
        """Returns the actions that have come since one was taken."""
        came = []
        while not self._actions.empty():
            came.append(self._actions.get()[1])
        return came

    def plan(self, fits: Callable[[Sequence[str]], bool]) -> Tuple[float, Sequence[str]]:
        """Returns when the next plan came that fits, and its actions."""
        while True:
            when, plan = _next(self._plans, "plan")
            if fits(plan.actions):
                return when, plan.actions

    def latest_plan(self) -> Sequence[str]:
        """Returns the actions of the last plan that has come since one was taken; else none."""
        actions: Sequence[str] = ()
        while not self._plans.empty():
            actions = self._plans.get()[1].actions
        return actions

    def close(self) -> None:
        """Listens no longer."""
        for topic in self._topics:
            topic.unregister()


def _next(came: queue.Queue[_Came], what: str) -> _Came:
    try:
        return came.get(timeout=_TIMEOUT_SECONDS)
    except queue.Empty:
        raise HarnessError(f"no {what} came") from None


class Nodes:
    """A rosoclingo that is started anew for each run, and the solvers, which stay."""

    def __init__(
        self,
        system: RosSystem,
        grid: Grid,
        *parameters: str,
        together: bool,
        steps: int = _STEPS,
    ) -> None:
        """Starts what stays: two solvers, or nothing.

        Args:
            system: The ROS system.
            grid: What is planned.
            parameters: Of rosoclingo, such as ``_patience:=1``.
            together: Whether one node does all.
            steps: The last step that may be planned for, which the mode's time depends on.
        """
        self._system = system
        self._together = together
        self._name = f"{'one' if together else 'three'}_{'_'.join(map(str, grid))}"
        files = [part for file in grid.files for part in ("-f", file)]
        self._planner = [*files, *grid.options]
        self._parameters = parameters
        self._solvers: List[str] = []
        if not together:
            mode = ["-f", str(MODE), "-c", f"steps={steps}"]
            for role, arguments in (("controller", mode), ("planner", self._planner)):
                name = f"{self._name}_{role}"
                system.rosrun("rosclingo", "run.py", *arguments, name=name)
                self._solvers.append(name)

    def start(self) -> Run:
        """Starts rosoclingo, and with it the solvers anew."""
        if self._together:
            arguments = ["run-1.0.py", *self._planner]
        else:
            roles = ("controller", "planner")
            solvers = (f"_{role}:={name}" for role, name in zip(roles, self._solvers))
            arguments = ["run.py", *solvers]
        self._system.rosrun("rosoclingo", *arguments, *self._parameters, name=self._name)
        return Run(rospy.resolve_name(self._name))

    def end(self, run: Run) -> None:
        """Ends rosoclingo."""
        run.close()
        self._system.end(self._name)

    def close(self) -> None:
        """Ends the solvers."""
        for node in reversed(self._solvers):
            self._system.end(node)


def ask_all(run: Run, requests: Sequence[Request]) -> Tuple[float, Sequence[str]]:
    """Sends goals, and waits until there is a plan for all of them.

    Returns:
        The milliseconds from before the first goal was sent, and the plan's actions.
    """
    begin = time.perf_counter()
    for request in requests:
        run.send(request)
    when, actions = run.plan(lambda plan: deliveries(plan) == len(requests))
    return (when - begin) * 1e3, actions


def deliveries(actions: Sequence[str]) -> int:
    """Returns how many requests a plan serves."""
    return sum("deliver(" in action for action in actions)
