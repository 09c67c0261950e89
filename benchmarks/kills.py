#!/usr/bin/env python3
"""Kills processes of a running system by SIGKILL, and judges if anything is lost or done twice.

A robot brings packages between two offices, in rounds of two: rosoclingo with its controller and
planner, an interface for each kind of action, and a client, each a process that is started again
when it ends. This process is the world, and the judge: it offers move_base, has the packages, and
hears how goals end.

    benchmarks/kills.py points [--process loop] [--most 9]  at each point of each, one kill a round
    benchmarks/kills.py pairs [--most 9]                    two kills a round, also in the recovery
    benchmarks/kills.py random [--rounds 100] [--seed 7]    up to six kills a round, by seeds

With ``--ways int term rosnode``, processes are ended by SIGINT, SIGTERM, or as by ``rosnode kill``
instead, one of these for each kill; ``kill`` is SIGKILL. In these rounds, the second package is
asked for as soon as the first process begins to end.

What a point is, says mortal.py. Exit status 1 says that something was wrong, which is printed with
what was killed where.
"""

from __future__ import annotations

import argparse
import random
import signal
import subprocess
import sys
import tempfile
import threading
import time
import xmlrpc.client
from collections import Counter
from pathlib import Path
from typing import Dict, List, NamedTuple, Sequence, Set, Tuple

import actionlib
import rosgraph
import rospy
from actionlib_msgs.msg import GoalStatus, GoalStatusArray
from move_base_msgs.msg import MoveBaseAction, MoveBaseResult
from std_msgs.msg import String

from harness import HarnessError, RosSystem
from mailbot import ENCODING, MODE
from mortal import WAYS, Fate
from mortal_client import REQUESTS
from rosclingo.ros.action_server import LowLatencyActionServer
from rosclingo.ros.local_master import executable
from rosclingo.ros.low_latency import publisher, subscriber
from rosclingo.srv import ROSClingoControl, ROSClingoControlRequest
from rosoclingo.msg import ROSoClingoActionResult, ROSoClingoIn

HERE = Path(__file__).resolve().parent
OFFICES = HERE / "encodings" / "two_offices.lp"
PLACES = {"a": 0.0, "b": 1.0}  # x in metres
ROBOT = "mailbot"
PROCESSES = ("loop", "planner", "controller", "driver", "robot", "client")
MANY = 10**6  # points, more than any round has
MOST_POINTS = {
    "loop": 600, "planner": 100, "controller": 300, "driver": 100, "robot": 100, "client": 8,
}  # fmt: skip
"""About how many points a round has; what a seed says rests on it."""

# How a process may end that was ended in a polite way, be it before its handlers are there.
_POLITE_STATUSES = (0, -signal.SIGINT, -signal.SIGTERM, 128 + signal.SIGINT)
_ROUND_SECONDS = 60.0  # no more than a bound for what never comes
_QUIET_SECONDS = 0.25  # so long without a point: all that was to be sent is sent
_POLL_SECONDS = 0.01
_ENDED = {
    GoalStatus.PREEMPTED, GoalStatus.SUCCEEDED, GoalStatus.ABORTED, GoalStatus.REJECTED,
    GoalStatus.RECALLED, GoalStatus.LOST,
}  # fmt: skip


class World:
    """The simulated world of robot and packages, which is not killed. Thread-safe."""

    def __init__(self) -> None:
        """Starts with the robot at office a, without packages."""
        self._lock = threading.Lock()  # guards all of it
        self._violations: List[str] = []
        self._done: List[Tuple[str, str]] = []  # in this round, with the package
        self._place = "a"
        self._load = ""
        self._packages: Dict[str, str] = {}  # what lies where, to be taken
        self._service = rospy.Service("world", ROSClingoControl, self._on_request)
        self._navigation = LowLatencyActionServer(
            "move_base", MoveBaseAction, self._on_drive, lambda _: None, MoveBaseResult()
        )
        self._navigation.start()

    def begin(self, name: str) -> None:
        """Puts a package into each office."""
        with self._lock:
            self._done.clear()
            self._packages = {place: f"{name} {place}" for place in REQUESTS}

    def done(self, package: str) -> List[str]:
        """Returns what was done with a package in this round, in order."""
        with self._lock:
            return [action for action, other in self._done if other == package]

    def tidy_up(self, package: str) -> str:
        """Takes a package away, wherever it is; returns where the robot is."""
        with self._lock:
            self._packages = {key: one for key, one in self._packages.items() if one != package}
            if self._load == package:
                self._load = ""
            return self._place

    def take_violations(self) -> List[str]:
        """Returns what was done since the last call that cannot be right."""
        with self._lock:
            violations, self._violations = self._violations, []
        return sorted(set(violations))

    def _on_drive(self, goal: actionlib.ServerGoalHandle) -> None:
        x = goal.get_goal().target_pose.pose.position.x
        with self._lock:
            self._place = next(place for place, other in PLACES.items() if other == x)
        goal.set_accepted()
        goal.set_succeeded(MoveBaseResult())

    def _on_request(self, request: ROSClingoControlRequest) -> str:
        """Does what a robot's hand does, and says what it has then."""
        action = request.commands
        with self._lock:
            if action == "pickup" and not self._load and self._place in self._packages:
                self._load = self._packages.pop(self._place)
                self._done.append((action, self._load))
            elif action == "deliver" and self._load and not self._load.endswith(self._place):
                self._done.append((action, self._load))
                self._load = ""
            elif action != "look":
                self._violations.append(f"{action} at {self._place}, where it has {self._load!r}")
                return "wrong"
            return self._load or "nothing"


class Judge:
    """Hears how goals end. Thread-safe."""

    def __init__(self) -> None:
        """Subscribes."""
        self._changed = threading.Condition()  # guards all of it
        self._violations: List[str] = []
        self._ends: Dict[str, Tuple[int, str]] = {}
        self._listed: Set[str] = set()  # what has ended by a list of statuses
        self._heard: Set[str] = set()  # of what the client has the result
        self._topics = [
            subscriber("heard", String, self._on_heard),
            subscriber("rosoclingo/result", ROSoClingoActionResult, self._on_result),
            subscriber("rosoclingo/status", GoalStatusArray, self._on_statuses),
        ]

    def _on_result(self, message: ROSoClingoActionResult) -> None:
        with self._changed:
            self._end(message.status)

    def _on_heard(self, message: String) -> None:
        with self._changed:
            self._heard.add(message.data)
            self._changed.notify_all()

    def _on_statuses(self, message: GoalStatusArray) -> None:
        with self._changed:
            for status in message.status_list:
                key = status.goal_id.id
                if status.status in _ENDED:
                    self._listed.add(key)
                    self._end(status)
                elif key in self._listed:  # a list and a result may overtake each other
                    self._violations.append(f"{key} goes on after its end")

    def _end(self, status: GoalStatus) -> None:
        key = status.goal_id.id
        end, _ = self._ends.setdefault(key, (status.status, status.text))
        if end != status.status:
            words = [GoalStatus.to_string(one) for one in (end, status.status)]
            self._violations.append(f"{key} ends twice: {' and '.join(words)}")
        self._changed.notify_all()

    def wait(self, keys: Set[str], seconds: float) -> Dict[str, Tuple[int, str]]:
        """Waits until a goal has ended.

        Args:
            keys: The goals' ids.
            seconds: How long.

        Returns:
            The statuses and texts of those that have, by their ids.
        """
        with self._changed:
            self._changed.wait_for(lambda: keys & self._ends.keys(), seconds)
            return {key: self._ends[key] for key in keys & self._ends.keys()}

    def wait_for_client(self, keys: Set[str], seconds: float) -> Set[str]:
        """Waits until the client has results; returns the ids of the goals of which it has none."""
        with self._changed:
            self._changed.wait_for(lambda: keys <= self._heard, seconds)
            return keys - self._heard

    def take_violations(self) -> List[str]:
        """Returns what was heard since the last call that cannot be right."""
        with self._changed:
            violations, self._violations = self._violations, []
        return sorted(set(violations))


class Kill(NamedTuple):
    """A kill to inject.

    Attributes:
        process: Which one.
        point: At which of its points.
        later: At which point of the one that is started then; 0 for none.
        delay: How many seconds after the first point.
        way: How, of ``mortal.WAYS``.
    """

    process: str
    point: int
    later: int = 0
    delay: float = 0.0
    way: str = WAYS[0]


class Mortals:
    """The processes of the system, each of which is started again when it has ended.

    Attributes:
        kills: How often each was killed, or ended in a polite way.
    """

    def __init__(self, system: RosSystem, folder: Path, *, blind: bool, forgets: bool) -> None:
        """Starts them.

        Args:
            system: Where they run.
            folder: For their files.
            blind: Whether the robot cannot look what it has done.
            forgets: Whether it has no store.
        """
        self._system = system
        self._folder = folder
        self._fates: Dict[str, Fate] = {}
        self._commands: Dict[str, List[str]] = {}
        self._processes: Dict[str, subprocess.Popen[bytes]] = {}
        self._open = True
        self._polite: Set[str] = set()  # those that are to end in such a way
        self.kills: Counter[str] = Counter()
        self._crashes: List[str] = []
        places = (f"  {name}: {{x: {x}, y: 0.0, theta: 0.0}}" for name, x in PLACES.items())
        waypoints = folder / "waypoints.yaml"
        waypoints.write_text("\n".join(["frame: map", "waypoints:", *places, ""]))
        drives = executable("rosoclingo_interfaces", "move_base_interface.py")
        solver = executable("rosclingo", "run.py")
        store = f"_store:={folder}/"
        self._add("controller", solver, "-f", str(MODE), "-c", "steps=60")
        self._add("planner", solver, "-f", str(OFFICES), "-f", str(ENCODING))
        self._add("loop", executable("rosoclingo", "run.py"), f"{store}loop.store")
        self._add(
            "driver", drives, f"_waypoints:={waypoints}", f"_actuators:={ROBOT}", f"{store}driver"
        )
        robot = [str(HERE / "mortal_robot.py"), f"_looks:={not blind}"]
        self._add("robot", *robot, *([] if forgets else [f"{store}robot"]))
        self._add("client", str(HERE / "mortal_client.py"))
        self._thread = threading.Thread(target=self._watch, name="respawn", daemon=True)
        self._thread.start()

    def _add(self, name: str, *command: str) -> None:
        self._fates[name] = Fate(self._folder / f"{name}.fate")
        mortal = [sys.executable, str(HERE / "mortal.py"), str(self._fates[name].path)]
        self._commands[name] = [*mortal, *command, f"__name:={_node(name)}"]
        self._processes[name] = self._system.start(name, self._commands[name])

    def _watch(self) -> None:
        while self._open:
            for name, process in self._processes.items():
                if process.poll() is not None and self._open:
                    is_polite = name in self._polite and process.returncode in _POLITE_STATUSES
                    if is_polite or process.returncode == -signal.SIGKILL:
                        self.kills[name] += 1
                    else:
                        self._crashes.append(f"{name} has ended with {process.returncode}")
                    self._processes[name] = self._system.start(name, self._commands[name])
            time.sleep(_POLL_SECONDS)

    def take_crashes(self) -> List[str]:
        """Returns which processes have ended by themselves since the last call, and how."""
        crashes, self._crashes = self._crashes, []
        return crashes

    def wait_until_quiet(self) -> None:
        """Waits until all processes are there, and nothing is to be sent any more.

        Raises:
            HarnessError: That does not come to pass.
        """
        master = rosgraph.Master("/judge")
        end = time.monotonic() + _ROUND_SECONDS
        since, before = time.monotonic(), [-1]
        while time.monotonic() - since < _QUIET_SECONDS:
            if time.monotonic() > end:
                raise HarnessError("the processes do not come to rest")
            now = [fate.seen for fate in self._fates.values()]
            if now != before or not all(self._is_there(master, name) for name in PROCESSES):
                since, before = time.monotonic(), now
            time.sleep(_POLL_SECONDS)

    def _is_there(self, master: rosgraph.Master, name: str) -> bool:
        if self._fates[name].ends:
            return False
        try:
            node = xmlrpc.client.ServerProxy(master.lookupNode(f"/{_node(name)}"))
            return bool(node.getPid("/judge")[2] == self._processes[name].pid)  # type: ignore[index]
        except (rosgraph.MasterException, xmlrpc.client.Error, OSError):
            return False

    def arm(self, kills: Sequence[Kill]) -> None:
        """Arms kills, and disarms all others."""
        for fate in self._fates.values():
            fate.arm(0)
        if kills:
            self._polite = {kill.process for kill in kills if kill.way != "kill"}
        for kill in kills:
            self._fates[kill.process].arm(kill.point, kill.later, kill.delay, kill.way)

    @property
    def ends(self) -> bool:
        """Tells if a process is about to end in a polite way."""
        return any(fate.ends for fate in self._fates.values())

    def fate(self, name: str) -> Fate:
        """Returns when a process is killed."""
        return self._fates[name]

    def output(self) -> str:
        """Returns what the processes that run have printed at last."""
        return "\n".join(f"--- {name}\n{self._system.output(name)}" for name in PROCESSES)

    def close(self) -> None:
        """Starts none again any more."""
        self._open = False
        self._thread.join()


def _node(process: str) -> str:
    return "rosoclingo" if process == "loop" else process


class Trial:
    """A running system and what was found in it.

    Attributes:
        mortals: Its processes.
        wrong: What was wrong, in words.
        rounds: How many there were.
        unknown: How many goals ended because it is unknown whether an action was done.
    """

    def __init__(self, mortals: Mortals, blind: bool, ways: Sequence[str]) -> None:
        """Puts the world around the processes.

        Args:
            mortals: The processes.
            blind: Whether the robot, when it is killed, may not know what it has done.
            ways: How processes are killed, of ``mortal.WAYS``.
        """
        self.mortals = mortals
        self._blind = blind
        self._ways = ways
        self._world = World()
        self._judge = Judge()
        self._asked = publisher("asked", String, latch=True)
        self._in = publisher("rosoclingo/in", ROSoClingoIn)
        self._kills: Sequence[Kill] = ()
        self.wrong: List[str] = []
        self.rounds = 0
        self.unknown = 0

    def round(self, kills: Sequence[Kill] = ()) -> None:
        """Runs a round: two packages are brought while processes are killed; then judges.

        Raises:
            HarnessError: A goal does not end, or a process does not come back.
        """
        self.mortals.arm(())
        self.mortals.wait_until_quiet()
        self.rounds += 1
        name = f"round {self.rounds}"
        # By what it is, so that a seed says it, too.
        kills = [one._replace(way=random.Random(repr(one)).choice(self._ways)) for one in kills]
        self._kills = kills
        self._world.begin(name)
        self.mortals.arm(kills)
        first, *_ = REQUESTS
        if any(kill.way != "kill" for kill in kills):
            self._asked.publish(f"{name}: {first}")
            while not (self.mortals.ends or self._judge.wait({f"{name} {first}"}, _POLL_SECONDS)):
                pass
        self._asked.publish(f"{name}: {' '.join(REQUESTS)}")
        may_not_know = self._blind and any(kill.process == "robot" for kill in kills)
        keys = {f"{name} {place}" for place in REQUESTS}
        wrong = self._verdicts(keys, may_not_know)
        if all(kill.process != "client" for kill in kills):
            missing = self._judge.wait_for_client(keys, _ROUND_SECONDS)
            wrong += [f"the client does not get the result of {key}" for key in sorted(missing)]
        wrong += self._world.take_violations() + self._judge.take_violations()
        wrong += self.mortals.take_crashes()
        self.wrong += wrong
        for one in wrong:
            print(f"{self.about}: {one}", flush=True)

    @property
    def about(self) -> str:
        """Describes the round and its kills."""
        points = (f"{kill} {self.mortals.fate(kill.process).last}" for kill in self._kills)
        return f"round {self.rounds}, {'; '.join(points) or 'undisturbed'}"

    def _verdicts(self, keys: Set[str], may_not_know: bool) -> List[str]:
        """Waits for the ends of goals, and returns what is wrong with them."""
        wrong: List[str] = []
        until = time.monotonic() + _ROUND_SECONDS
        while keys:
            ended = self._judge.wait(keys, until - time.monotonic())
            if not ended:
                raise HarnessError(f"{' and '.join(sorted(keys))}: no end")
            keys = keys.difference(ended)
            for key, (status, text) in ended.items():
                word, done = GoalStatus.to_string(status), self._world.done(key)
                if may_not_know and word == "ABORTED" and "is unknown" in text:
                    self.unknown += 1
                    is_right = done in ([], ["pickup"], ["pickup", "deliver"])
                    # A person looks after the robot.
                    self._in.publish("info", f"at({ROBOT},{self._world.tidy_up(key)})")
                else:
                    is_right = word == "SUCCEEDED" and done == ["pickup", "deliver"]
                if not is_right:
                    wrong.append(f"{key} is {word} ({text}), and was {done}")
        return wrong


def points(trial: Trial, process: str, first: int, most: int, every: int) -> int:
    """Kills a process at each of its points, in a round each, until a round has no more.

    Args:
        trial: The system.
        process: Which one.
        first: At which point at first.
        most: At how many at most.
        every: How many there are from one at which it is killed to the next.

    Returns:
        At how many it was killed.
    """
    for number in range(most):
        trial.round([Kill(process, first + number * every)])
        if trial.mortals.fate(process).left:
            return number
    return most


def pairs(trial: Trial, first: str, second: str, most: int) -> int:
    """Kills two processes in each round, or one again while it recovers; returns how often.

    Args:
        trial: The system.
        first: The one that is killed at points spread over the round.
        second: The one that is killed at other points; if it is the same, of its next life.
        most: In how many rounds.
    """
    for number in range(most):
        point = 1 + number * MOST_POINTS[first] // most
        other = 1 + number * 7 % MOST_POINTS[second]
        if first == second:
            trial.round([Kill(first, point, other)])
        else:
            trial.round([Kill(first, point), Kill(second, other)])
    return most


def some_kills(seed: int) -> List[Kill]:
    """Returns what is killed in the round with a seed: one to three processes, maybe twice."""
    chance = random.Random(seed)
    kills = []
    for process in chance.sample(PROCESSES, chance.choice([1, 1, 2, 3])):
        point, later = (chance.randint(1, MOST_POINTS[process]) for _ in range(2))
        delay = chance.choice([0.0, chance.uniform(0.0, 0.05)])
        kills.append(Kill(process, point, 0 if delay else chance.choice([0, later]), delay))
    return kills


def run(arguments: argparse.Namespace) -> int:
    """Runs what the command line says, and returns the exit status."""
    began = time.monotonic()
    failed = False
    with tempfile.TemporaryDirectory() as folder, RosSystem() as system:
        rospy.init_node("judge", disable_signals=True)
        # A client that is started again has to find its goals, however long that takes.
        rospy.set_param("rosoclingo/status_list_timeout", _ROUND_SECONDS)
        mortals = Mortals(system, Path(folder), blind=arguments.blind, forgets=arguments.forgets)
        trial = Trial(mortals, arguments.blind, arguments.ways)
        try:
            for _ in range(2):
                trial.round()
            seen = (f"{mortals.fate(name).seen} of {name}" for name in PROCESSES)
            print(f"points of an undisturbed round: {', '.join(seen)}", flush=True)
            _run(trial, arguments)
            trial.round()
        except HarnessError as err:
            failed = True
            print(f"{trial.about}: {err}\n{mortals.output()}")
        finally:
            mortals.close()
            rospy.signal_shutdown("done")
    counts = ", ".join(f"{count} of {name}" for name, count in sorted(mortals.kills.items()))
    print(
        f"{trial.rounds} rounds, {sum(mortals.kills.values())} kills ({counts}), "
        f"{trial.unknown} goals of unknown end, {len(trial.wrong) + failed} violations, "
        f"{time.monotonic() - began:.0f} s"
    )
    return 1 if trial.wrong or failed else 0


def _run(trial: Trial, arguments: argparse.Namespace) -> None:
    processes = arguments.process or PROCESSES
    if arguments.mode == "points":
        for process in processes:
            count = points(trial, process, arguments.first, arguments.most, arguments.every)
            print(f"{process}: {count} points", flush=True)
    elif arguments.mode == "pairs":
        for first in processes:
            for second in PROCESSES:
                count = pairs(trial, first, second, arguments.most)
                print(f"{first} and {second}: {count} pairs", flush=True)
    else:
        for seed in range(arguments.seed, arguments.seed + arguments.rounds):
            before = len(trial.wrong)
            is_right = False
            try:
                trial.round(some_kills(seed))
                is_right = len(trial.wrong) == before
            finally:  # also if a goal does not end
                if not is_right:
                    print(f"{trial.about}: that was --seed {seed}", flush=True)


def main() -> int:
    """Reads the command line, runs, and returns the exit status."""
    parser = argparse.ArgumentParser(
        description="Kills processes of a running system by SIGKILL, and judges what it does."
    )
    parser.add_argument("mode", choices=["points", "pairs", "random"])
    parser.add_argument("--process", action="append", choices=PROCESSES)
    parser.add_argument("--first", type=int, default=1, help="of the points")
    parser.add_argument("--most", type=int, default=0, help="points or pairs for each")
    parser.add_argument("--every", type=int, default=1, help="how many points further the next is")
    parser.add_argument(
        "--ways", nargs="+", choices=WAYS, default=WAYS[:1], help="how it is killed"
    )
    parser.add_argument("--blind", action="store_true", help="the robot cannot look what it did")
    parser.add_argument("--forgets", action="store_true", help="the robot has no store")
    parser.add_argument("--rounds", type=int, default=100, help="of the mode random")
    parser.add_argument("--seed", type=int, default=0, help="of the first of them")
    arguments = parser.parse_args()
    arguments.most = arguments.most or {"points": MANY, "pairs": 9}.get(arguments.mode, 0)
    return run(arguments)


if __name__ == "__main__":
    sys.exit(main())
