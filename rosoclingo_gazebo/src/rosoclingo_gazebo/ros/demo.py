"""Tells the third scenario against a running system, and draws it.

An unannounced obstacle is put between c5 and c4. With _story:=carried, it is the story of a robot
that is carried from c2 to c5 without an announcement, and finds that out. The exit status is 0 if
the deliveries are made.
"""

from __future__ import annotations

from pathlib import Path
from typing import List, NoReturn

import rospkg
import rospy
from nav_msgs.msg import Odometry

from rosclingo.ros import parameters
from rosclingo.ros.low_latency import subscriber
from rosoclingo.drawing.errors import picture_errors
from rosoclingo.loop.journal import Record, decode
from rosoclingo.loop.values.phrases import TermPhrases
from rosoclingo.msg import ROSoClingoEvent
from rosoclingo_examples.orders import Orders
from rosoclingo_examples.ros.client import RequestClient
from rosoclingo_gazebo.demo.carried_robot import CarriedRobot
from rosoclingo_gazebo.demo.story import DEMO_ROBOT, DemoStory
from rosoclingo_gazebo.demo.third_scenario import ThirdScenario
from rosoclingo_gazebo.ros.killer import Killer
from rosoclingo_gazebo.ros.program import run_demo, wait_for
from rosoclingo_interfaces.navigation.waypoints import read_waypoints
from rosoclingo_simulator.physics.occupancy import read_map
from rosoclingo_simulator.srv import Obstacle

_USAGE = f"""\
usage: demo.py [_story:=STORY] [_output:=FOLDER] [_kill:=SEED] [ROS remappings]

{__doc__}
The pictures office.png and office.svg, or carried.png and carried.svg, are written to FOLDER, by
default the working directory. With SEED, a number from 1, nodes are killed every few seconds, at
random; the system needs a store then."""
_KILLED = ("rosoclingo", "controller", "planner", "move_base_interface", "pickup_deliver")
_OBSTACLE, _CARRIED = "obstacle", "carried"
_FILES = {_OBSTACLE: "office", _CARRIED: "carried"}
_SECONDS = 300.0  # of wall time, for the whole story


class Demo:
    """Connects a story with ROS. Make it after the node is initialised."""

    def __init__(self) -> None:
        self._seed = parameters.integer("kill", 0, least=0)
        packages = rospkg.RosPack()
        simulator = Path(packages.get_path("rosoclingo_simulator"))
        interfaces = Path(packages.get_path("rosoclingo_interfaces"))
        programs = Path(packages.get_path("rosoclingo_aspprograms"))
        self._floor = read_map(simulator / "maps" / "office.yaml")
        waypoints = read_waypoints(interfaces / "config" / "graph_wg.yaml")
        self._places = {name: (place.x, place.y) for name, place in waypoints.places.items()}
        self._orders = Orders()
        self._client = RequestClient(self._orders, self._on_line)
        self._name = str(rospy.get_param("~story", _OBSTACLE))
        self.story: DemoStory
        if self._name == _CARRIED:
            encoding = programs / "mailbot" / "mailbot_causes.lp"
            phrases = TermPhrases.read([encoding.read_text(encoding="utf-8")])
            self.story = CarriedRobot(self._client.send, phrases)
        elif self._name == _OBSTACLE:
            self.story = ThirdScenario(self._places["c6"], self._client.send)
        else:
            known = f"{_OBSTACLE} or {_CARRIED}"
            raise parameters.wrong("story", f"expected {known}, not {self._name!r}")
        self._noted = 0  # in the journal, which tells again what it has told
        self._topics = [
            subscriber("/ground_truth", Odometry, self._on_ground_truth),
            subscriber("rosoclingo/journal", ROSoClingoEvent, self._on_journal),
        ]

    def run(self) -> List[str]:
        """Runs to the end of the story, and returns the faults."""
        if not wait_for(self._ready, _SECONDS):
            return [f"after {_SECONDS:g} s, the simulator or rosoclingo is not there"]
        if self.story.obstacle:
            try:
                done = rospy.ServiceProxy("/simulator/obstacle", Obstacle)(self.story.obstacle)
            except rospy.ServiceException as err:
                return [f"there is no obstacle: {err}"]
            print(f"nobody knows: {done.message}", flush=True)
        self.story.begins(self._places)
        killer = Killer(_KILLED, self._seed, self.story.kills) if self._seed else None
        ended = wait_for(lambda: not self._orders.open, _SECONDS)
        if killer is not None:
            killer.end()
        ended = ended and wait_for(lambda: self.story.has_ended, _SECONDS)
        wrong = [] if ended else [f"the requests did not end within {_SECONDS:g} s"]
        if not self._orders.all_as_asked:
            wrong.append("a request did not end as it should")
        return wrong

    def lines(self, seconds: float) -> List[str]:
        """Returns the summary, with the seconds of wall time."""
        trace = self.story.trace
        return [
            f"{self._orders.summary()}; {trace.metres:.0f} m in {trace.seconds:.0f} s of "
            f"simulated time{self._killed()}, {seconds:.0f} s of wall time"
        ]

    def draw(self, folder: Path) -> List[Path]:
        """Writes the pictures to a folder, if there is anything to draw; returns their names.

        Raises:
            OSError: They cannot be written.
            PictureError: matplotlib is missing.
        """
        trace = self.story.trace
        if not trace.path:
            return []
        title = (
            f"{self._orders.summary()} on {trace.metres:.0f} m in {trace.seconds:.0f} s: "
            f"{self.story.title}{self._killed()}"
        )
        file = folder / _FILES[self._name]
        with picture_errors(file):
            from rosoclingo_gazebo.demo.picture import draw  # noqa: PLC0415 (needs matplotlib)
        return draw(self._floor, self._places, {DEMO_ROBOT: trace}, title, file)

    def _killed(self) -> str:
        return f", {self.story.killed} nodes killed" if self.story.killed else ""

    def _ready(self) -> bool:
        connected = all(topic.get_num_connections() for topic in self._topics)
        return bool(connected and self.story.trace.path and self._client.there())

    def _on_line(self, line: str) -> None:
        self.story.hears(line)

    def _on_ground_truth(self, message: Odometry) -> None:
        place = message.pose.pose.position
        self.story.moves(message.header.stamp.to_sec(), (place.x, place.y))

    def _on_journal(self, message: ROSoClingoEvent) -> None:
        if message.number > self._noted:
            self._noted = message.number
            self.story.notes(Record(decode(message), message.step, message.horizon))


def main() -> NoReturn:
    """Tells the story and ends the process, with exit status 1 if something was wrong."""
    run_demo("demo", _USAGE, Demo)
