"""Tells the third scenario against a running system, and draws it.

An obstacle is put between c5 and c4, of which nobody is told. The exit status is 0 if the robot
has driven as the paper has it.
"""

from __future__ import annotations

import sys
import threading
import time
from pathlib import Path
from typing import Callable, List, NoReturn

import rospkg
import rospy
from nav_msgs.msg import Odometry
from std_msgs.msg import Bool

from rosclingo.errors import RosclingoError
from rosclingo.ros.init import init_node
from rosclingo.ros.low_latency import subscriber
from rosoclingo.msg import ROSoClingoIn, ROSoClingoOut
from rosoclingo_aspprograms.validator import Map
from rosoclingo_examples.client import Client
from rosoclingo_examples.orders import Orders
from rosoclingo_gazebo.demo.picture import draw
from rosoclingo_gazebo.demo.story import ROBOT, Story
from rosoclingo_interfaces.navigation.waypoints import read_waypoints
from rosoclingo_simulator.simulator.occupancy import read_map
from rosoclingo_simulator.srv import Obstacle

_USAGE = f"""\
usage: demo.py [_output:=FOLDER] [ROS remappings]

{__doc__}
The pictures office.png and office.svg are written to FOLDER, by default the working directory."""
_SECONDS = 170.0  # of wall time, for the whole story
_POLL_SECONDS = 0.05  # how often the main thread looks at what it waits for


class Demo:
    """Connects a story with ROS. Make it after the node is initialised."""

    def __init__(self) -> None:
        packages = rospkg.RosPack()
        simulator = Path(packages.get_path("rosoclingo_simulator"))
        interfaces = Path(packages.get_path("rosoclingo_interfaces"))
        programs = Path(packages.get_path("rosoclingo_aspprograms"))
        self._floor = read_map(simulator / "maps" / "office.yaml")
        waypoints = read_waypoints(interfaces / "config" / "graph_wg.yaml")
        self._places = {name: (place.x, place.y) for name, place in waypoints.places.items()}
        self._orders = Orders()
        self._client = Client(self._orders, self._on_line)
        graph = Map.read(programs / "mailbot" / "instances" / "graph_wg.lp")
        self.story = Story(graph, self._places["c6"], self._client.send)
        self._topics = [
            subscriber("/ground_truth", Odometry, self._on_ground_truth),
            subscriber("/simulator/touches", Bool, self._on_touches),
            subscriber("rosoclingo/in", ROSoClingoIn, self._on_in),
            subscriber("rosoclingo/out", ROSoClingoOut, self._on_out),
        ]

    def run(self) -> List[str]:
        """Runs to the end of the story, and returns what went wrong."""
        if not _wait_for(self._ready):
            return [f"after {_SECONDS:g} s, the simulator or rosoclingo is not there"]
        try:
            done = rospy.ServiceProxy("/simulator/obstacle", Obstacle)("block c5 c4")
        except rospy.ServiceException as err:
            return [f"there is no obstacle: {err}"]
        print(f"nobody knows: {done.message}", flush=True)
        (x5, y5), (x4, y4) = self._places["c5"], self._places["c4"]
        self.story.begins(((x5 + x4) / 2, (y5 + y4) / 2))
        ended = _wait_for(lambda: not self._orders.open)
        wrong = [] if ended else [f"the requests did not end within {_SECONDS:g} s"]
        if not self._orders.all_as_asked:
            wrong.append("a request did not end as it should")
        return wrong + self.story.wrong()

    def draw(self, folder: Path) -> List[Path]:
        """Writes the pictures to a folder and returns their names.

        Raises:
            OSError: They cannot be written.
        """
        folder.mkdir(parents=True, exist_ok=True)
        files = [folder / "office.png", folder / "office.svg"]
        trace = self.story.trace
        title = (
            f"{self._orders.summary()} on {trace.metres:.0f} m in {trace.seconds:.0f} s: "
            "the way from c5 to c4 is blocked"
        )
        draw(self._floor, self._places, trace, title, files)
        return files

    def summary(self) -> str:
        """Returns what there was of everything."""
        trace = self.story.trace
        return (
            f"{self._orders.summary()}; {trace.metres:.0f} m in {trace.seconds:.0f} s of "
            "simulated time"
        )

    def _ready(self) -> bool:
        connected = all(topic.get_num_connections() for topic in self._topics[:2])
        return bool(connected and self.story.trace.path and self._client.there())

    def _on_line(self, line: str) -> None:
        self.story.hears(line)

    def _on_ground_truth(self, message: Odometry) -> None:
        place = message.pose.pose.position
        self.story.moves(message.header.stamp.to_sec(), (place.x, place.y))

    def _on_touches(self, message: Bool) -> None:
        if message.data:
            self.story.touches()

    def _on_in(self, message: ROSoClingoIn) -> None:
        if message.id == ROBOT:
            self.story.answers(message.value)

    def _on_out(self, message: ROSoClingoOut) -> None:
        if message.id == ROBOT:
            self.story.acts(message.action)


def main() -> NoReturn:
    """Tells the story and ends the process, with exit status 1 if something was wrong."""
    init_node("demo", usage=_USAGE)
    begin = time.monotonic()
    demo = None
    try:
        demo = Demo()
        wrong = demo.run()
        print(f"\n{demo.summary()}, {time.monotonic() - begin:.0f} s of wall time", flush=True)
        if demo.story.trace.path:
            for file in demo.draw(Path(str(rospy.get_param("~output", "."))).absolute()):
                print(f"  {file}", flush=True)
    except (OSError, RosclingoError) as err:
        wrong = [str(err)]
    for line in wrong:
        print(f"wrong: {line}", file=sys.stderr)
    rospy.signal_shutdown("the story has ended")
    sys.exit(1 if wrong else 0)


def _wait_for(condition: Callable[[], bool]) -> bool:
    end = time.monotonic() + _SECONDS
    pause = threading.Event()
    while not condition():
        if rospy.is_shutdown() or time.monotonic() > end:
            return False
        pause.wait(_POLL_SECONDS)
    return True
