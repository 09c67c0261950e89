"""Measures how long each kind of node takes to end after Ctrl-C.

python benchmarks/shutdown_bench.py
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import rospy

from harness import Report, RosSystem, Row, Samples, measure

ROOT = Path(__file__).resolve().parents[1]
WAYPOINTS = ROOT / "rosoclingo_interfaces" / "config" / "graph_wg.yaml"
GRAPH = ROOT / "rosoclingo_aspprograms" / "mailbot" / "instances" / "graph_wg.lp"
ENDS = 5
LIMIT = 2000.0  # ms
_WARM_UP_SECONDS = 1.0  # until a node is at its work

NODES = (
    ("rosclingo", "run.py"),
    ("rosoclingo", "run.py"),
    ("rosoclingo", "run-1.0.py", "-f", str(ROOT / "rosoclingo" / "example" / "line.lp")),
    ("rosoclingo", "record.py"),
    ("rosoclingo_console", "console.py", "_port:=0"),
    ("rosoclingo_interfaces", "fulfill.py"),
    ("rosoclingo_interfaces", "move_base_interface.py", f"_waypoints:={WAYPOINTS}"),
    ("rosoclingo_rviz", "graph_markers.py", f"_instance:={GRAPH}"),
    ("rosoclingo_simulator", "simulator.py"),
    ("rosoclingo_simulator", "simulator.py", "_physics:=mujoco"),
    ("rosoclingo_simulator", "simulator.py", "_speed:=0.02"),
)


def run(system: RosSystem, folder: Path, report: Report) -> None:
    """Measures everything."""
    rospy.set_param("/use_sim_time", True)  # without a publisher, but for a simulator
    for package, program, *arguments in NODES:
        times = []
        for number in range(ENDS):
            bag = ["-o", str(folder / f"{number}.bag")] if program == "record.py" else []
            name = f"{program.partition('.')[0].replace('-', '_')}{number}"
            system.rosrun(package, program, *bag, *arguments, name=name)
            time.sleep(_WARM_UP_SECONDS)
            begin = time.monotonic()
            system.end(name)
            times.append((time.monotonic() - begin) * 1e3)
        samples = Samples("ms", tuple(times))
        settings = (one for one in arguments if ":=" in one and "/" not in one)
        about = " ".join((package, program, *settings))
        report.add(Row(f"{about}, worst", None, samples, "max", max(times), "ms", LIMIT))


if __name__ == "__main__":
    sys.exit(measure("shutdown", run))
