"""Lets a fleet deliver packages that are asked for at random, and draws it.

It needs a running mailbot_fleet.launch. The exit status is 0 if all packages were delivered.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import List, NoReturn

import rospkg
from nav_msgs.msg import Odometry

from rosclingo.ros import parameters
from rosclingo.ros.low_latency import subscriber
from rosoclingo.drawing.errors import picture_errors
from rosoclingo.encodings.graph import read_graph
from rosoclingo.loop.journal import decode
from rosoclingo.msg import ROSoClingoEvent
from rosoclingo_aspprograms.validator import Map
from rosoclingo_examples.orders import Orders
from rosoclingo_examples.ros.client import RequestClient
from rosoclingo_gazebo.demo.fleet import FleetStory, random_orders
from rosoclingo_gazebo.ros.program import run_demo, wait_for
from rosoclingo_simulator.physics.occupancy import read_map

_USAGE = f"""\
usage: fleet_demo.py [_robots:=3] [_packages:=10] [_seed:=1] [_output:=FOLDER] [ROS remappings]

{__doc__}
The pictures fleet.png and fleet.svg are written to FOLDER, by default the working directory."""
_SECONDS_TO_COME = 60.0  # of wall time, for the nodes
_SECONDS_TO_END = 600.0  # of simulated time, in which some request ends
_SECONDS_TO_PASS = 30.0  # of wall time, in which there is some simulated time
_MOST_ROBOTS = 4


class FleetDemo:
    """Connects a fleet's story with ROS. Make it after the node is initialised."""

    def __init__(self) -> None:
        """Opens the topics.

        Raises:
            RosclingoError: A parameter or a file is wrong.
        """
        robots = parameters.integer("robots", 3, _MOST_ROBOTS, least=1)
        packages = rospkg.RosPack()
        instances = Path(packages.get_path("rosoclingo_aspprograms")) / "mailbot" / "instances"
        office = instances / "graph_wg.lp"
        graph = read_graph([str(office if robots == 1 else instances / f"fleet_{robots}.lp")])
        self._floor = read_map(
            Path(packages.get_path("rosoclingo_simulator")) / "maps" / "office.yaml"
        )
        self._places = graph.places
        self.story = FleetStory(graph.starts, graph.places)
        self._due = random_orders(
            sorted(Map.read(office).offices),
            parameters.integer("packages", 10, least=1),
            parameters.integer("seed", 1),
        )
        self._orders = Orders()
        self._client = RequestClient(self._orders, lambda _: None)
        self._topics = [
            *(
                subscriber(f"{robot}/ground_truth", Odometry, partial(self._on_ground_truth, robot))
                for robot in graph.starts
            ),
            subscriber("rosoclingo/journal", ROSoClingoEvent, self._on_event),
        ]

    def run(self) -> List[str]:
        """Runs until all packages are delivered, and returns the faults."""
        if not wait_for(self._ready, _SECONDS_TO_COME):
            return [f"after {_SECONDS_TO_COME:g} s, the simulator or rosoclingo is not there"]
        self.story.begins()
        self._wait()
        wrong: List[str] = []
        if self._due or self._orders.open or self.story.open:
            wrong.append(
                f"no request has ended in {_SECONDS_TO_END:g} s of simulated time, or that stands"
            )
        elif not self._orders.all_as_asked:
            wrong.append("a request did not end as it should")
        return wrong

    def lines(self, seconds: float) -> List[str]:
        """Returns the summary, with the seconds of wall time."""
        return [*self.story.lines(), f"{seconds:.0f} s of wall time"]

    def draw(self, folder: Path) -> List[Path]:
        """Writes the pictures to a folder, if there is anything to draw; returns their names.

        Raises:
            OSError: They cannot be written.
            PictureError: matplotlib is missing.
        """
        if not self.story.there:
            return []
        traces = {name: member.trace for name, member in self.story.members.items()}
        title = self.story.summary()
        file = folder / "fleet"
        with picture_errors(file):
            from rosoclingo_gazebo.demo.picture import draw  # noqa: PLC0415 (needs matplotlib)
        return draw(self._floor, self._places, traces, title, file)

    def _ready(self) -> bool:
        connected = all(topic.get_num_connections() for topic in self._topics)
        return bool(connected and self.story.there and self._client.there())

    def _wait(self) -> None:
        """Sends requests as they are due, until all have ended, or nothing goes on."""
        left, since = 0, 0.0
        while True:
            now = self.story.seconds
            while self._due and self._due[0][0] <= now:
                self._client.send(self._due.pop(0)[1])
            before, left = left, len(self._due) + len(self._orders.open) + self.story.open
            if left != before:
                since = now
            if not left or now - since > _SECONDS_TO_END:
                return
            if not wait_for(partial(self._is_after, now), _SECONDS_TO_PASS):
                return

    def _is_after(self, seconds: float) -> bool:
        return self.story.seconds > seconds

    def _on_ground_truth(self, robot: str, message: Odometry) -> None:
        place, twist = message.pose.pose.position, message.twist.twist
        speed = max(abs(twist.linear.x), abs(twist.angular.z))
        self.story.moves(robot, message.header.stamp.to_sec(), (place.x, place.y), speed)

    def _on_event(self, message: ROSoClingoEvent) -> None:
        self.story.learns(decode(message))


def main() -> NoReturn:
    """Runs the demo, and ends the process, with exit status 1 if something was wrong."""
    run_demo("fleet_demo", _USAGE, FleetDemo)
