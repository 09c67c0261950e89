#!/usr/bin/env python3
"""Replays runs that have ended in each way in which a run can end; nothing may be different.

    benchmarks/replay_ends.py [--replays 20] [--jobs 2] [--only WORD] [--keep FOLDER]

records a run for each line of CASES below, with real nodes, and replays each bag so many times at
the level exact, some at a time. Exit status 1 says that there was a difference, which is printed.
With --keep, the bags stay in a folder, and those that are there already are not recorded anew.
"""

from __future__ import annotations

import argparse
import signal
import subprocess
import sys
import tempfile
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Callable, Dict, List, NamedTuple, Tuple

import rospy
from actionlib_msgs.msg import GoalID

from harness import HarnessError, RosSystem
from mailbot import FOLDER, MODES, ROOT
from rosclingo.ros.local_master import executable
from rosclingo.ros.low_latency import publisher, subscriber
from rosoclingo.loop import journal
from rosoclingo.msg import ROSoClingoActionGoal, ROSoClingoEvent, ROSoClingoGoal, ROSoClingoIn

EXAMPLE = ROOT / "rosoclingo" / "example"
RECORDING, RESET, DYN_RESET = (
    f"dynamic.incremental.{kind}" for kind in ("recording", "reset", "dyn_reset")
)
ISLAND = "#program transition(t). :- do(robot,go(5),t)."
"""No robot gets to cell 5, nor beyond it."""
BROKEN = "#program state(t). #external event(info,broken,t). :- event(info,broken,t)."
"""A message contradicts the program; it is dropped then."""
FRAGILE = "#program state(t). :- t = 4."
"""The program contradicts itself."""

_TIMEOUT_SECONDS = 180.0  # no more than a bound for what never comes
_POLL_SECONDS = 0.02


class EndCase(NamedTuple):
    """A run, and how it ends.

    Attributes:
        planner: The planner's command line, or that of the one node.
        mode: The controller's mode; empty for one node.
        steps: The last step.
        goals: What is asked for: groups that are sent at once, each when those before have ended.
        messages: What is said to the planner after the first action.
        answers: How many actions the robot answers.
        end: ``alone``, or what ends the run when the robot does not answer any more, or when all
            goals have ended: ``interrupt``, or the node that is killed.
        parameters: Of rosoclingo.
        says: What rosoclingo says in the end.
        edit: What is replaced in the mode by what.
    """

    planner: Tuple[str, ...]
    mode: str = ""
    steps: int = 20
    goals: Tuple[Tuple[str, ...], ...] = ()
    messages: Tuple[Tuple[str, str], ...] = ()
    answers: int = 10**6
    end: str = "alone"
    parameters: Tuple[str, ...] = ()
    says: str = ""
    edit: Tuple[str, str] = ("", "")


def line(*more: str, name: str = "line") -> Tuple[str, ...]:
    """Returns the command line of a planner for the robot on a line.

    Args:
        more: Further rules, or options.
        name: The encoding's name.
    """
    return ("-f", str(EXAMPLE / f"{name}.lp"), *more)


MAILBOT = (
    "-f", str(FOLDER / "instances" / "graph_bench.lp"), "-f", str(FOLDER / "mailbot.lp"),
    "-c", "x=2", "-c", "y=2", "-c", "slots=2",
)  # fmt: skip
HANOI = ("-f", str(EXAMPLE / "instance.lp"), "-f", str(EXAMPLE / "itoh.lp"))
FIVE = (("visit(3)", "visit(5)", "visit(1)", "visit(6)", "visit(2)"),)
NO_PLAN, TOO_LATE = "no plan within the horizon", "the mode ended after its last step"
CONTRADICTION = "contradicts itself"
LOST = "start that node again"
ALONE = ("_abort_unreachable:=true",)
LAST = ("-c", "steps=3")

CASES: Dict[str, EndCase] = {
    "no plan": EndCase(line(), RECORDING, 3, (("visit(6)",),), says=NO_PLAN),
    "no plan, five goals": EndCase(line(), DYN_RESET, 3, FIVE, says=NO_PLAN),
    "no plan, mailbot": EndCase(
        MAILBOT, DYN_RESET, 8, (("bring(1,2)",), ("bring(3,4)", "bring(2,3)")), says=NO_PLAN
    ),
    "no plan, one node": EndCase(line(*LAST), goals=(("visit(2)",), ("visit(6)",)), says=NO_PLAN),
    "no plan, dialect 1.0": EndCase(line(*LAST, name="line_1.0"), goals=FIVE, says=NO_PLAN),
    "no plan, dialect paper": EndCase(line(*LAST, name="line_paper"), goals=FIVE, says=NO_PLAN),
    "last step": EndCase(
        line(), RECORDING, 4, (("visit(3)", "visit(2)"), ("visit(4)", "visit(5)")), says="step"
    ),
    "last step, reset": EndCase(
        line(), RESET, 6, (("visit(6)",), *FIVE, ("visit(1)",)), says="step"
    ),
    "last step, one node": EndCase(
        line("-c", "steps=4"), goals=(("visit(5)",), ("visit(1)", "visit(2)")), says=TOO_LATE
    ),
    "exit by the mode": EndCase(
        line(), RECORDING, 12, (("visit(3)", "visit(2)"),), says=TOO_LATE,
        edit=("next(idle,done) :- stage(done), not news, last.",
              "#external event(info,step(0),0). first :- event(info,step(0),0)."
              "next(idle,done) :- stage(done), not news, last, first."
              "next(exit,done) :- stage(done), not news, last, not first."),
    ),
    "exit by the mode, goals open": EndCase(
        line(), DYN_RESET, 12, FIVE, says=NO_PLAN,
        edit=("next(status_update(now),done)", "next(exit,done)"),
    ),
    "planner gone": EndCase(line(), DYN_RESET, 20, FIVE, answers=3, end="planner", says=LOST),
    "controller gone": EndCase(line(), RECORDING, 20, FIVE, answers=2, end="controller", says=LOST),
    "Ctrl-C": EndCase(line(), DYN_RESET, 20, FIVE, answers=4, end="interrupt"),
    "Ctrl-C, one node": EndCase(line(), goals=FIVE, answers=3, end="interrupt"),
    "static, incremental": EndCase(HANOI, "static.incremental.recording", 4, says=NO_PLAN),
    "static, fixed": EndCase(HANOI, "static.fixed.recording", 4, says=NO_PLAN),
    "contradiction": EndCase(line("FRAGILE"), RECORDING, 20, FIVE, says=CONTRADICTION),
    "contradiction, one node": EndCase(line("FRAGILE"), goals=FIVE, says=CONTRADICTION),
    "contradiction by a message": EndCase(
        line("BROKEN"), DYN_RESET, 20, FIVE, (("info", "broken"),), end="interrupt"
    ),
    "unreachable alone": EndCase(
        line("ISLAND"), DYN_RESET, 8, (("visit(3)", "visit(6)", "visit(2)"), ("visit(1)",)),
        end="interrupt", parameters=ALONE,
    ),
    "unreachable alone, one node": EndCase(
        line("ISLAND", "-c", "steps=8"), goals=(("visit(3)", "visit(5)"), ("visit(1)",)),
        end="interrupt", parameters=ALONE,
    ),
}  # fmt: skip


class EndDriver:
    """Sends goals, and answers actions, of one run after the other. Make it in a ROS node."""

    def __init__(self) -> None:
        self._changed = threading.Condition()  # guards all that follows
        self._events: Dict[int, journal.Event] = {}
        self._open: Dict[str, None] = {}
        self._case = EndCase(())
        self._actions = 0
        self._goal = publisher("/rosoclingo/goal", ROSoClingoActionGoal)
        self._in = publisher("/rosoclingo/in", ROSoClingoIn)
        self._journal = subscriber("/rosoclingo/journal", ROSoClingoEvent, self._on_event)

    def drive(self, case: EndCase, has_ended: Callable[[], bool]) -> None:
        """Drives a run until it is to be ended, or has ended."""
        with self._changed:
            self._case = case
            self._actions = 0
            self._events.clear()
            self._open.clear()
        topics = (self._goal, self._in)
        _wait("connections", lambda: all(topic.get_num_connections() > 1 for topic in topics))
        for number, group in enumerate(case.goals):
            for place, request in enumerate(group):
                self._send(f"g{number}{place}", request)
            _wait("the goals", lambda: has_ended() or self._is_through())
        if case.end == "alone":
            _wait("the end", has_ended)

    def _is_through(self) -> bool:
        with self._changed:
            return self._actions > self._case.answers or not self._open

    def _send(self, name: str, request: str) -> None:
        with self._changed:
            self._open[name] = None
        goal = ROSoClingoGoal(request, [])
        self._goal.publish(ROSoClingoActionGoal(goal_id=GoalID(id=name), goal=goal))

    def _on_event(self, message: ROSoClingoEvent) -> None:
        event = journal.decode(message)
        with self._changed:
            if message.number in self._events:  # the history, once more
                return
            self._events[message.number] = event
            if isinstance(event, journal.StatusSet):
                if event.status is not journal.Status.ACCEPTED:
                    self._open.pop(event.goal, None)
            elif isinstance(event, journal.ActionPublished):
                self._actions += 1
                if self._actions == 1:
                    for said in self._case.messages:
                        self._in.publish(*said)
                if self._actions <= self._case.answers:
                    self._in.publish(event.actuator, "success")


def record_run(case: EndCase, system: RosSystem, driver: EndDriver, bag: Path) -> None:
    """Records a run in a bag.

    Raises:
        HarnessError: It does not end as it is to.
    """
    planner = list(case.planner)
    for number, word in enumerate(planner):
        if word in ("ISLAND", "BROKEN", "FRAGILE"):
            file = bag.with_suffix(".lp")
            file.write_text(globals()[word])
            planner[number : number + 1] = ["-f", str(file)]
    started = ["rosoclingo", "recorder"]
    if case.mode:
        mode = bag.with_name(f"{bag.stem}.mode.lp")
        text = (MODES / f"{case.mode}.lp").read_text()
        if case.edit[0] not in text:
            raise HarnessError(f"the mode {case.mode} has no {case.edit[0]!r} to be replaced")
        mode.write_text(text.replace(*case.edit))
        steps = f"steps={case.steps}"
        system.rosrun("rosclingo", "run.py", "-f", str(mode), "-c", steps, name="controller")
        system.rosrun("rosclingo", "run.py", *planner, name="planner")
        started += ["planner", "controller"]
    recorder = executable("rosoclingo", "record.py")
    system.start("recorder", [recorder, "-o", str(bag), "__name:=recorder"])
    _wait("the recorder", lambda: "recording /rosoclingo" in system.output("recorder"))
    own = ["run.py"] if case.mode else ["run-1.0.py", *planner]
    program, *arguments = own
    command = [executable("rosoclingo", program), *arguments, *case.parameters]
    process = system.start("rosoclingo", command)
    if case.mode.startswith("static"):
        _wait("the end", lambda: process.poll() is not None)
    else:
        system.wait_until_hears("/recorder", "rosoclingo")
        driver.drive(case, lambda: process.poll() is not None)
    if case.end == "interrupt":
        process.send_signal(signal.SIGINT)
    elif case.end != "alone":
        system.kill(case.end)
        started.remove(case.end)
    _wait("the end", lambda: process.poll() is not None)
    said = system.output("rosoclingo")
    for name in started:
        system.end(name)
    if case.says not in said:
        raise HarnessError(f"it has not ended with {case.says!r}:\n{said}")


def replay_bag(bag: Path, folder: Path) -> str:
    """Replays a bag, and returns what is different; nothing if that is nothing."""
    command = [executable("rosoclingo", "replay.py"), str(bag), "--level", "exact"]
    try:
        run = subprocess.run(
            command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False,
            timeout=_TIMEOUT_SECONDS, cwd=folder,
        )  # fmt: skip
    except subprocess.TimeoutExpired as err:
        return f"{err}\n{err.output!r}"
    return (
        "" if run.returncode == 0 and "no difference at level exact" in run.stdout else run.stdout
    )


def _wait(what: str, condition: Callable[[], bool]) -> None:
    end = time.monotonic() + _TIMEOUT_SECONDS
    while not condition():
        if time.monotonic() > end:
            raise HarnessError(f"waited in vain for {what}")
        time.sleep(_POLL_SECONDS)


def main() -> int:
    """Records, replays, and returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--replays", type=int, default=20, help="of each bag")
    parser.add_argument("--jobs", type=int, default=2, help="replays at the same time")
    parser.add_argument("--only", default="", help="the runs with this word in their names")
    parser.add_argument("--keep", type=Path, help="where the bags are, and stay")
    options = parser.parse_args()
    names = [name for name in CASES if options.only in name]
    with tempfile.TemporaryDirectory() as temporary:
        folder = options.keep or Path(temporary)
        folder.mkdir(exist_ok=True)
        bags = {name: folder / f"{name.replace(', ', '_').replace(' ', '_')}.bag" for name in names}
        with RosSystem() as system:
            rospy.init_node("driver", disable_signals=True)
            driver = EndDriver()
            for name, bag in bags.items():
                if not bag.exists():
                    record_run(CASES[name], system, driver, bag)
                    print(f"recorded: {name}", flush=True)
            rospy.signal_shutdown("recorded")
        failures: List[str] = []
        count = 0
        with ThreadPoolExecutor(options.jobs) as pool:
            for name, bag in bags.items():
                found = list(
                    pool.map(lambda _, bag=bag: replay_bag(bag, folder), range(options.replays))
                )
                count += len(found)
                different = [said for said in found if said]
                failures += different
                print(f"{name}: {len(different)} of {len(found)} replays differ", flush=True)
                if different:
                    print(different[0], flush=True)
    print(f"{len(failures)} of {count} replays of {len(names)} runs differ")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
