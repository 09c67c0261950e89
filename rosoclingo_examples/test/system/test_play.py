"""Plays a whole recorded bag onto the live system that it was recorded from.

Needs a sourced workspace, in devel or install space.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from terminals import Terminal, Terminals, terminals, wait_for

__all__ = ["terminals"]

LINE = Path(__file__).resolve().parents[3] / "rosoclingo" / "example" / "line.lp"

# The request visit(6) takes a longer search, in step 0 too: no ten pigeons fit into nine holes.
HARD = """
#program state(t).
{ hard(t) } :- event(_,visit(6),t).
1 { nest(P,H,t) : H = 1..9 } 1 :- P = 1..10, hard(t).
:- nest(P,H,t), nest(Q,H,t), P < Q.
#minimize { 1@2,t : event(_,visit(6),t), not hard(t) }.
"""


@pytest.mark.costly
def test_a_loop_survives_a_whole_bag(terminals: Terminals, tmp_path: Path) -> None:
    """Foreign goals end the loop's searches of planner and controller; it tries them again."""
    bag, hard = tmp_path / "a.bag", tmp_path / "hard.lp"
    hard.write_text(HARD)
    system = terminals.start(
        "roslaunch", "rosoclingo", "rosoclingo.launch", "mode:=dynamic.incremental.dyn_reset",
        f"encoding:={LINE} {hard}", "steps:=100",
    )  # fmt: skip
    terminals.start("rosrun", "rosoclingo_interfaces", "fulfill.py")
    recorder = terminals.start(
        "rosrun", "rosoclingo", "record.py", "-o", str(bag), "__name:=recorder"
    )
    recorder.wait_for("recording /rosoclingo in")
    wait_for(lambda: "/recorder" in terminals.subscribers("/rosoclingo/goal"))
    results = terminals.listen("/rosoclingo", "/rosoclingo/result")

    def visit(cell: int, name: str) -> None:
        terminals.publish(
            "/rosoclingo/goal", "rosoclingo/ROSoClingoActionGoal",
            f"{{goal_id: {{id: {name}}}, goal: {{request: visit({cell})}}}}",
        )  # fmt: skip

    def succeeded(name: str) -> bool:
        return f'id: "{name}"\n  status: 3\n' in results.output

    visit(3, "first")
    wait_for(lambda: succeeded("first"))
    recorder.interrupt()
    assert recorder.wait() == 0

    player = terminals.start("rosbag", "play", str(bag))
    visit(5, "second")
    assert player.wait() == 0
    wait_for(lambda: succeeded("second"))

    # A bag's goals hit a search now and then; these are sure to.
    def rival(solver: str, rate: str, topic: str, kind: str) -> Terminal:
        publisher = ("rostopic", "pub", "-r", rate, f"/{solver}/{topic}", kind, "{}")
        started = terminals.start(*publisher)
        sender, of = f"/rostopic_{started.process.pid}_", f"/{solver}/{topic}"
        wait_for(
            lambda: any(
                f"/{solver}" in terminals.receivers(name, of)
                for name in terminals.publishers(of)
                if name.startswith(sender)
            )
        )
        return started

    def is_disturbed(solver: str) -> bool:
        return f"a search of /{solver} was ended by a goal" in system.output

    # The controller's searches are short: it takes some until one is hit.
    first = rival("controller", "500", "goal", "rosclingo/ROSClingoActionGoal")
    for number in range(100):
        if is_disturbed("controller"):
            break
        name = f"again{number}"
        visit(4 + number % 2, name)
        wait_for(lambda name=name: succeeded(name))
    assert is_disturbed("controller")
    first.interrupt()
    first.wait()

    rivals = [
        rival("planner", "10", "goal", "rosclingo/ROSClingoActionGoal"),
        rival("planner", "10", "cancel", "actionlib_msgs/GoalID"),
    ]
    visit(6, "last")
    wait_for(lambda: is_disturbed("planner"))
    for one in rivals:
        one.interrupt()
        one.wait()

    wait_for(lambda: succeeded("last"))
    for word in ("died", "FATAL", "Traceback"):
        assert word not in system.output
    assert system.output.count("and is tried again") == 2
