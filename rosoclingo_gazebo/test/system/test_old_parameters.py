"""Launch files on a master that was used before: what they say counts, not what was set there.

Needs a sourced workspace, in devel or install space.
"""

from __future__ import annotations

import pytest
import yaml
from terminals import Terminals, terminals, wait_for

__all__ = ["terminals"]


@pytest.mark.costly
def test_what_the_launch_file_says_counts(terminals: Terminals) -> None:
    # With any of these, a node would end with an error.
    for name, value in (
        ("/graph_markers/world", "/nowhere.yaml"),
        ("/graph_markers/frame", 3),
        ("/simulator/x", -1000),
        ("/move_base_interface/start", "nowhere"),
        ("/pickup_deliver/timeout", "soon"),
        ("/planner/load_path", 7),
    ):
        terminals.master.setParam("/test", name, value)
    launches = [
        terminals.start("roslaunch", *arguments)
        for arguments in (
            ("rosoclingo_rviz", "rviz.launch", "world:=none", "window:=false"),
            ("rosoclingo_simulator", "embedded.launch"),
            ("rosoclingo_interfaces", "mailbot_interfaces.launch", "start:=none"),
            ("rosoclingo_examples", "mailbot_static.launch"),
        )
    ]
    markers = yaml.safe_load(terminals.latched("/graph_markers/markers"))["markers"]
    assert markers[1]["ns"] == "ways"  # comes first, because there are no walls
    launches[1].wait_for("simulates office")
    launches[3].wait_for("solver: [do(mailbot,")
    nodes = {"/move_base_interface", "/pickup_deliver"}
    wait_for(lambda: nodes <= terminals.names())
    wait_for(lambda: "does the actions of mailbot from" in launches[2].output)
    assert not any("has died" in launch.output for launch in launches)
    assert terminals.master.getParam("/test", "/move_base_interface/start")[2] == ""
