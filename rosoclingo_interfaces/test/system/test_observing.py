"""observe.py as a process: its file and the system around it.

Needs a sourced workspace, in devel or install space.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from terminals import Terminal, Terminals, package, terminals, wait_for

__all__ = ["terminals"]

DOOR = """observers:
- topic: door
  equals: true
  tell: blocked(c3,c4)
  else: unblocked(c3,c4)
"""

# Each file, with the line and the error that a node ends with, once it knows the topic's type.
WRONG = {
    DOOR.replace("equals: true", "pattern: a"): "line 2: field: data of std_msgs/Bool is bool; a",
    DOOR + "  field: open\n": "line 6: field: open: std_msgs/Bool has no field open; there are: da",
    DOOR + "  type: std_msgs/Boo\n": "line 6: type: there is no type of messages std_msgs/Boo here",
    DOOR + "  type: std_msgs/_Bool\n": "line 6: type: there is no type of messages std_msgs/_Bool",
    DOOR + "  types: std_msgs/Bool\n": "line 6: unknown key 'types'; there are topic, tf, type",
    DOOR.replace("door", "do or"): "line 2: topic: 'do or' is no name; expected one such as scan",
}


def observe(terminals: Terminals, folder: Path, text: str, name: str = "observe") -> Terminal:
    """Starts a node with a file of this content."""
    file = folder / f"{name}.yaml"
    file.write_text(text)
    return terminals.start(
        "rosrun", "rosoclingo_interfaces", "observe.py", f"_observers:={file}", f"__name:={name}"
    )


def test_mistakes_end_the_node(terminals: Terminals, tmp_path: Path) -> None:
    nodes = [
        observe(terminals, tmp_path, text, f"wrong{number}") for number, text in enumerate(WRONG)
    ]
    # The type of the topic, which the first two do not say, comes when all others have ended.
    for node in nodes[2:]:
        assert node.wait() == 2
    nodes[0].wait_for("waiting for a publisher of /door")
    terminals.publish("/door", "std_msgs/Bool", "{data: true}")
    for number, (node, message) in enumerate(zip(nodes, WRONG.values())):
        assert node.wait() == 2
        assert f"{tmp_path / f'wrong{number}.yaml'}, {message}" in node.output
        assert "Traceback" not in node.output
    # It is known already when the next one starts, whose file says another one.
    text = DOOR.replace("equals: true", "pattern: a") + "  type: std_msgs/String\n"
    late = observe(terminals, tmp_path, text, "late")
    assert late.wait() == 2
    assert "line 6: type: /door has the types std_msgs/Bool and std_msgs/String" in late.output


def test_a_topic_whose_type_changes_is_named(terminals: Terminals, tmp_path: Path) -> None:
    node = observe(terminals, tmp_path, DOOR)
    terminals.publish("/door", "std_msgs/Bool", "{data: true}")
    node.wait_for("door (line 2): told blocked(c3,c4)")
    terminals.publish("/door", "std_msgs/String", "{data: open}")
    node.wait_for("the type of /door has changed from std_msgs/Bool to std_msgs/String")
    node.interrupt()
    assert node.wait() == 0
    assert node.output.count("the type of /door has changed") == 1
    assert "told unblocked" not in node.output


@pytest.mark.install_space
def test_what_holds_is_told_to_whoever_comes(terminals: Terminals, tmp_path: Path) -> None:
    node = observe(terminals, tmp_path, DOOR)
    terminals.publish("/door", "std_msgs/Bool", "{data: true}")
    node.wait_for("door (line 2): told blocked(c3,c4)")
    for _ in range(2):
        heard = terminals.listen("/observe", "/rosoclingo/in")
        heard.wait_for('id: "info"\nvalue: "blocked(c3,c4)"')
    node.interrupt()
    assert node.wait() == 0
    assert node.output.count("told blocked(c3,c4)") == 1
    assert "Traceback" not in node.output


def test_terms_that_the_planner_does_not_know(terminals: Terminals, tmp_path: Path) -> None:
    """They are named when the planner's encoding is known; the others arrive."""
    line = package("rosoclingo") / "example" / "line.lp"
    paths = tmp_path / "paths.lp"
    paths.write_text("#program state(t). #external event(info,blocked(c3,c4),t).")
    node = observe(terminals, tmp_path, DOOR)
    system = terminals.start(
        "roslaunch", "rosoclingo", "rosoclingo.launch", "mode:=dynamic.incremental.dyn_reset",
        f"encoding:={line} {paths}", "steps:=20",
    )  # fmt: skip
    node.wait_for(
        "observe.yaml, line 2: the planner's encoding does not know 'info:unblocked(c3,c4)', which "
        "is dropped when it is told; the nearest that it knows is 'info:blocked(c3,c4)'"
    )
    wait_for(lambda: "/rosoclingo" in terminals.receivers("/observe", "/rosoclingo/in"))
    journal = terminals.listen("/rosoclingo", "/rosoclingo/journal")
    terminals.publish("/door", "std_msgs/Bool", "{data: true}")
    journal.wait_for("blocked(c3,c4)")
    assert "was dropped" not in system.output
