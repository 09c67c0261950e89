#!/usr/bin/env python3
"""Soak test: a fleet in the office works for hours, with all that goes wrong, and is watched.

    scripts/soak HOURS [SEED]

Requests, cancels, blocked ways, faults of robots, and ends of nodes by SIGKILL and SIGINT are
drawn at random, by the seed alone. docs/soak.md says what is watched. It prints a line every few
minutes, and in the end writes a page. Exit status 1 says that there was a violation. Ctrl-C ends
it early, with its page; a second one ends it at once.
"""

from __future__ import annotations

import argparse
import math
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any, List, Sequence

import rospkg
import rospy

from harness import RosSystem, describe_machine
from rosclingo.errors import RosclingoError
from rosclingo.ros.local_master import executable
from rosoclingo.encodings.graph import Graph, read_graph
from rosoclingo_aspprograms.validator import Map
from soak_latencies import BUSY, PROCESSOR
from soak_page import SoakRun, clock, render_soak
from soak_records import Violation
from soak_schedule import Places, disturbances, faults, interface_faults
from soak_trends import latency_trends, memory_trends
from soak_watch import SoakWatch
from soak_world import PLANNING_NODES, SoakWorld

MODE = "dynamic.incremental.dyn_reset"  # which forgets what is over

_INTERFACES = ("pickup_deliver", "move_base_interface")  # of each robot
_SIMULATOR = "simulator"
_OFFICE = "office"
_START_SECONDS = 120.0  # of wall time, for all nodes to be there
_STILL_SECONDS = 60.0  # of wall time, in which simulated time has to go on
_DRAIN_SECONDS = 1800.0  # of simulated time, for open goals to end when nothing goes wrong any more
_SAY_SECONDS = 60.0  # of wall time, between two lines
_POLL_SECONDS = 0.05
_LEAST_SLOTS = 4
_REPLAY_LINES = 15  # of a replay's output


class Soak:
    """A run, from its start to its page."""

    def __init__(self, options: argparse.Namespace) -> None:
        """Reads the office.

        Args:
            options: Those of the command line.

        Raises:
            RosclingoError: The office cannot be read.
        """
        self._options = options
        packages = rospkg.RosPack()
        instances = Path(packages.get_path("rosoclingo_aspprograms")) / "mailbot" / "instances"
        office = instances / "graph_wg.lp"
        fleet = office if options.robots == 1 else instances / f"fleet_{options.robots}.lp"
        self._graph: Graph = read_graph([str(fleet)])
        self._rooms = Map.read(office)
        self._rooms.starts = dict(self._graph.starts)
        self._rooms.durations.update(pickup=1, deliver=1)  # requests may say when
        self._watch = SoakWatch(self._rooms, self._say_violation)
        self._slots = max(_LEAST_SLOTS, 2 * options.robots)
        self._is_stopped = False
        self._from = 0.0  # in simulated time
        self._began = self._lasted = 0.0  # in wall time

    def run(self) -> int:
        """Runs, writes the page, and returns the exit status."""
        options = self._options
        os.environ["PYTHONFAULTHANDLER"] = "1"  # of the nodes, see SoakWorld.end_hung
        with tempfile.TemporaryDirectory(prefix="soak_") as folder, RosSystem() as system:
            process = system.start(_OFFICE, self._launch(Path(folder)))
            rospy.set_param("/use_sim_time", True)
            rospy.init_node("soak", disable_signals=True)
            world = self._world()
            signal.signal(signal.SIGINT, self._stop)
            try:
                if not self._wait(lambda: world.is_ready, _START_SECONDS):
                    raise RosclingoError(f"the nodes did not start: {system.output(_OFFICE)}")
                self._live(world, process)
                if self._watch.violations:
                    print(system.output(_OFFICE), flush=True)
                self._say(world.seconds)
                end = world.began + world.seconds
                if options.replay:
                    system.end(_OFFICE)  # the bag has to be whole
                    self._replay(end)
                return self._finish(end)
            finally:
                rospy.signal_shutdown("the soak has ended")

    def _launch(self, folder: Path) -> List[str]:
        options = self._options
        file = folder / "faults.yaml"
        file.write_text(faults(options.seed, options.sparse), encoding="utf-8")
        if options.replay and not options.record:
            options.record = folder / "run.bag"
        record = [f"record:={options.record.absolute()}"] if options.record else []
        return [
            *("roslaunch", "rosoclingo_gazebo", "mailbot_fleet.launch"),
            *(f"robots:={options.robots}", f"speed:={options.speed}", f"mode:={MODE}"),
            *(f"slots:={self._slots}", f"store:={folder}/run.store", f"faults:={file}"),
            f"interface_faults:={interface_faults(options.seed)}",
            *record,
        ]

    def _world(self) -> SoakWorld:
        robots = sorted(self._graph.starts)
        nodes = [*PLANNING_NODES, *(f"{name}_{robot}" for name in _INTERFACES for robot in robots)]
        ended = [] if self._options.calm else nodes
        offices, sparse = sorted(self._rooms.offices), self._options.sparse
        places = Places(offices, self._graph.edges, ended, len(robots), sparse)
        drawn = disturbances(self._options.seed, places)
        watched = [*nodes, _SIMULATOR]
        return SoakWorld(self._watch, dict(self._graph.places), self._slots, watched, drawn)

    def _live(self, world: SoakWorld, office: Any) -> None:
        """Lets the fleet live until its time is over, and then until all goals have ended."""
        world.begin()
        self._from = world.began
        options = self._options
        kind = "wall" if options.wall else "simulated"
        print(
            f"seed {options.seed}: {options.robots} robots are watched for {options.hours:g} h "
            f"of {kind} time",
            flush=True,
        )
        self._began = time.monotonic()
        said, passed, since = self._began, 0.0, self._began
        until = 0.0
        while True:
            now, wall = world.seconds, time.monotonic()
            self._lasted = wall - self._began
            if not until and (self._is_stopped or self._is_over(now)):
                until = now + _DRAIN_SECONDS
            world.live(disturbs=not until)
            if until and (now > until or not (world.is_unsettled or world.has_boxes)):
                return
            if now > passed:
                passed, since = now, wall
            if office.poll() is not None:
                self._watch.wrong(world.began + now, f"roslaunch ends with {office.poll()}")
                return
            if wall - since > _STILL_SECONDS:
                world.end_hung(_SIMULATOR)
                self._watch.wrong(world.began + now, "the simulator stands still")
                return
            if wall - said > _SAY_SECONDS:
                said = wall
                self._say(now)
            time.sleep(_POLL_SECONDS)

    def _is_over(self, now: float) -> bool:
        passed = time.monotonic() - self._began if self._options.wall else now
        return passed >= 3600 * float(self._options.hours)

    def _replay(self, end: float) -> None:
        """Replays the bag, with the same kills; a difference is a violation."""
        print("the bag is replayed", flush=True)
        command = [executable("rosoclingo", "replay.py"), str(self._options.record), "--kill"]
        ended = subprocess.run(
            command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False
        )
        print(*ended.stdout.splitlines()[-_REPLAY_LINES:], sep="\n", flush=True)
        if ended.returncode:
            last = ended.stdout.strip().rpartition("\n")[2]
            self._watch.wrong(end, f"the replay ends with status {ended.returncode}: {last}")

    def _finish(self, end: float) -> int:
        options, watch = self._options, self._watch
        watch.finish(end)
        watch.judge_alarms(end, math.inf)
        seconds = end - self._from
        hours = seconds / 3600
        memory = memory_trends(watch.memory, hours)
        latencies = latency_trends(watch.latencies.samples, hours, BUSY, PROCESSOR)
        for trend in (*memory, *latencies):
            if trend.is_exceeded:
                watch.wrong(end, str(trend))
        run = SoakRun(
            options.seed,
            options.robots,
            self._from,
            seconds,
            self._lasted,
            memory,
            latencies,
            describe_machine(),
        )
        options.output.write_text(render_soak(run, watch), encoding="utf-8")
        print(f"warnings held against the robots' log: {dict(watch.alarms.counts)}", flush=True)
        print(f"{len(watch.violations)} violations; the page: {options.output}", flush=True)
        return 1 if watch.violations else 0

    def _say(self, now: float) -> None:
        counts = self._watch.counts
        rate = now / max(self._lasted, 1e-3)
        last = (samples[-1].value for samples in self._watch.memory.values())
        print(
            f"{clock(now)}  {counts['asked']} goals, {len(self._watch.open)} open, "
            f"{counts['succeeded']} succeeded, {counts['canceled']} canceled; "
            f"{counts['node killed'] + counts['node interrupted']} nodes ended; "
            f"up to {max(last, default=0.0):.0f} MiB; {rate:.1f}x; "
            f"{counts['violation']} violations",
            flush=True,
        )

    def _say_violation(self, violation: Violation) -> None:
        print(
            f"violation, seed {self._options.seed}, at {violation.seconds:.1f} s of simulated "
            f"time: {violation.text}",
            flush=True,
        )

    def _stop(self, number: int, _: object) -> None:
        print("no more disturbances; the open goals come to their ends", flush=True)
        self._is_stopped = True
        signal.signal(number, signal.default_int_handler)

    def _wait(self, holds: Any, seconds: float) -> bool:
        end = time.monotonic() + seconds
        while not holds():
            if time.monotonic() > end or self._is_stopped:
                return False
            time.sleep(_POLL_SECONDS)
        return True


def _positive(word: str) -> float:
    """Returns a number above 0.

    Raises:
        ValueError: It is none.
    """
    number = float(word)
    if not 0 < number < math.inf:
        raise ValueError(word)
    return number


def main(words: Sequence[str]) -> int:
    """Reads the command line, runs, and returns the exit status."""
    parser = argparse.ArgumentParser(
        prog="soak", description="Lets a fleet work for hours while things go wrong."
    )
    parser.add_argument("hours", type=_positive, help="how long, in simulated time")
    parser.add_argument("seed", type=int, nargs="?", default=1, help="of all draws; 1 by default")
    parser.add_argument("--wall", action="store_true", help="HOURS are of wall time")
    parser.add_argument("--calm", action="store_true", help="no node is ended")
    parser.add_argument(
        "--sparse", type=_positive, default=1.0, help="times as long between two disturbances"
    )
    parser.add_argument("--robots", type=int, choices=range(1, 5), default=2, help="how many")
    parser.add_argument("--speed", type=_positive, default=20.0, help="simulated seconds in one")
    parser.add_argument("--record", type=Path, help="a bag for the run")
    parser.add_argument("--replay", action="store_true", help="replay the run when it is over")
    parser.add_argument("--output", type=Path, default=Path("soak.html"), help="the page")
    options = parser.parse_args(words)
    try:
        return Soak(options).run()
    except RosclingoError as err:
        print(f"soak: {err}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
