"""Plays a whole recorded bag onto the live system that it was recorded from.

Needs a sourced workspace, in devel or install space.
"""

from __future__ import annotations

from pathlib import Path

from terminals import Terminals, terminals, wait_for

__all__ = ["terminals"]

LINE = Path(__file__).resolve().parents[3] / "rosoclingo" / "example" / "line.lp"

# The request visit(6) takes a longer search: no ten pigeons fit into nine holes.
HARD = """
#program transition(t).
{ hard(t) } :- event(_,visit(6),t).
1 { nest(P,H,t) : H = 1..9 } 1 :- P = 1..10, hard(t).
:- nest(P,H,t), nest(Q,H,t), P < Q.
#minimize { 1@2,t : event(_,visit(6),t), not hard(t) }.
"""


def test_a_loop_survives_a_whole_bag(terminals: Terminals, tmp_path: Path) -> None:
    """Foreign goals end the loop's searches of planner and controller; it tries them again."""
    bag, hard = tmp_path / "a.bag", tmp_path / "hard.lp"
    hard.write_text(HARD)
    system = terminals.start(
        "roslaunch", "rosoclingo", "rosoclingo.launch", "mode:=dynamic.incremental.dyn_reset",
        f"encoding:={LINE} {hard}", "steps:=100",
    )  # fmt: skip
    terminals.start("rosrun", "rosoclingo_interfaces", "fulfill.py")
    recorder = terminals.start("rosrun", "rosoclingo", "record.py", "-o", str(bag))
    results = terminals.start("rostopic", "echo", "/rosoclingo/result")

    def visit(cell: int) -> None:
        wait_for(lambda: "/rosoclingo/goal" in terminals.run("rostopic", "list").output)
        terminals.start(
            "rostopic", "pub", "-1", "/rosoclingo/goal", "rosoclingo/ROSoClingoActionGoal",
            f"{{goal_id: {{id: live{cell}}}, goal: {{request: visit({cell})}}}}",
        )  # fmt: skip

    def succeeded(cell: int) -> bool:
        return f'id: "live{cell}"\n  status: 3\n' in results.output

    visit(3)
    wait_for(lambda: succeeded(3))
    recorder.interrupt()
    assert recorder.wait() == 0

    player = terminals.start("rosbag", "play", str(bag))
    visit(5)
    assert player.wait() == 0
    wait_for(lambda: succeeded(5))

    # A bag's goals hit a search now and then; these are sure to.
    goal, cancel = "rosclingo/ROSClingoActionGoal", "actionlib_msgs/GoalID"
    rivals = [
        (solver, terminals.start("rostopic", "pub", "-r", rate, f"/{solver}/{topic}", kind, "{}"))
        for solver, rate, topic, kind in (
            ("planner", "10", "goal", goal),
            ("planner", "10", "cancel", cancel),
            ("controller", "500", "goal", goal),
        )
    ]
    for solver in ("planner", "controller"):
        wait_for(lambda s=solver: "/rostopic_" in terminals.run("rosnode", "info", f"/{s}").output)
    visit(6)
    for disturbed, rival in reversed(rivals):
        warning = f"a search of /{disturbed} was ended by a goal"
        wait_for(lambda w=warning: w in system.output or "died" in system.output)
        rival.interrupt()
        rival.wait()

    wait_for(lambda: succeeded(6))
    for word in ("died", "FATAL", "Traceback"):
        assert word not in system.output
    assert system.output.count("and is tried again") == 2
