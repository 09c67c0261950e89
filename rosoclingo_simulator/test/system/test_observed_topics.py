"""Observers of rosoclingo_interfaces: each kind hears the simulator, and a bag of its topics."""

from __future__ import annotations

from pathlib import Path
from typing import Sequence

from terminals import Terminal, Terminals, package, terminals, wait_for

__all__ = ["terminals"]

# The robot stands at open1, and looks along the way to c1.
OBSERVERS = """observers:
- {{topic: ground_truth, field: pose.pose.position.y, range: {{above: -7}}, tell: has_left}}
- {{topic: battery_state, field: percentage, range: {{below: 0.4}}, tell: battery(low)}}
- {{topic: odom, field: child_frame_id, pattern: ^base, tell: has_wheels}}
- {{topic: simulator/touches, equals: false, tell: touches_nothing}}
- topic: amcl_pose
  nearest_waypoint: {{waypoints: {places}, within: 0.8, hysteresis: 0.5}}
  tell: at(amcl,W)
- topic: odom
  nearest_waypoint: {{waypoints: {places}, within: 0.8, hysteresis: 0.5}}
  tell: at(odom,W)
- tf: {{child: base_link}}
  nearest_waypoint: {{waypoints: {places}, within: 0.8, hysteresis: 0.5}}
  tell: at(tf,W)
- {{topic: amcl_pose, covariance: {{above: 0}}, tell: uncertain}}
- topic: scan
  closed: {{waypoints: {places}, from: open1, to: c1}}
  tell: blocked(open1,c1)
  else: unblocked(open1,c1)
- {{topic: map, closed: {{waypoints: {places}, from: o1, to: o2}}, tell: 'no_way(o1,o2)'}}
- {{topic: map, closed: {{waypoints: {places}, from: c1, to: c2}}, tell: 'no_way(c1,c2)'}}
- {{topic: camera, silent: 2, tell: no_camera}}
"""

# The robot drives 5 m.
FAULTS = "faults:\n- {fault: battery, level: 0.5, per_metre: 0.05}\n"

TOLD = [
    "has_left", "battery(low)", "has_wheels", "touches_nothing", "at(amcl,open1)", "at(amcl,open2)",
    "at(odom,open1)", "at(odom,open2)", "at(tf,open1)", "at(tf,open2)", "uncertain",
    "blocked(open1,c1)", "unblocked(open1,c1)", "no_way(o1,o2)", "no_camera",
]  # fmt: skip
TOPICS = (
    "/ground_truth", "/odom", "/simulator/touches", "/amcl_pose", "/tf", "/tf_static", "/scan",
    "/map", "/battery_state",
)  # fmt: skip


def check(node: Terminal, terms: Sequence[str]) -> None:
    """Waits until these terms are told, and checks that no other way is closed."""
    for term in terms:
        node.wait_for(f": told {term}\n")
    assert "told no_way(c1,c2)" not in node.output


def test_observers_hear_the_simulator_and_a_bag(terminals: Terminals, tmp_path: Path) -> None:
    file, bag = tmp_path / "observers.yaml", tmp_path / "topics.bag"
    places = package("rosoclingo_interfaces") / "config" / "graph_wg.yaml"
    file.write_text(OBSERVERS.format(places=places))
    terminals.master.setParam("/test", "/use_sim_time", True)
    command = ("rosrun", "rosoclingo_interfaces", "observe.py", f"_observers:={file}")
    live = terminals.start(*command, "__name:=live")
    # Not by the program rosbag, which complains of Ctrl-C where its own caller ignores that.
    record = ("rosrun", "rosbag", "record", "-O", str(bag), "__name:=recorder", *TOPICS)
    recorder = terminals.start(*record)
    wait_for(lambda: all("/recorder" in terminals.subscribers(topic) for topic in TOPICS))
    faults = tmp_path / "faults.yaml"
    faults.write_text(FAULTS)
    simulator = terminals.start(
        "rosrun", "rosoclingo_simulator", "simulator.py", "_speed:=4", f"_faults:={faults}"
    )
    simulator.wait_for("simulates")
    check(live, ["at(amcl,open1)", "at(odom,open1)", "at(tf,open1)"])
    for word, term in (("block", "blocked(open1,c1)"), ("unblock", "unblocked(open1,c1)")):
        asked = terminals.run("rosservice", "call", "/simulator/obstacle", f"{word} open1 c1")
        assert "success: True" in asked.output
        check(live, [term])
    terminals.publish(
        "/move_base_simple/goal", "geometry_msgs/PoseStamped",
        "{header: {frame_id: map}, pose: {position: {x: 3, y: -5}, orientation: {w: 1}}}",
    )  # fmt: skip
    check(live, TOLD)
    for node in (recorder, live, simulator):
        node.interrupt()
        assert node.wait() == 0
        assert "Traceback" not in node.output

    again = terminals.start(*command, "__name:=again")
    wait_for(lambda: "/again/about" in terminals.names())
    player = terminals.start(
        "rosrun", "rosbag", "play", "--clock", "--rate=4", "--wait-for-subscribers", str(bag)
    )
    check(again, TOLD)
    player.interrupt()
    again.interrupt()
    assert again.wait() == 0
    assert "Traceback" not in again.output
