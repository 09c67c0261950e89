"""The README of rosoclingo, and recovery."""

from __future__ import annotations

import shutil

import pytest
import yaml
from page import LINE, OFFICE, PAPER, Page, has_libraries, of
from readmes import check_output

from rosoclingo.loop.execution.policies import ActionPolicies


@pytest.mark.costly
@of("rosoclingo/README.md", "rosoclingo")
def test_rosoclingo(page: Page) -> None:
    page.type("rosoclingo.launch")
    page.hears("/rosoclingo/about")
    fulfill = page.type("fulfill.py")
    page.run("/rosoclingo/goal")
    fulfill.wait_for("go(3): success")
    check_output("rosoclingo/README.md", "rosoclingo", fulfill.output)
    page.interrupt()

    page.type("roscore")
    for _ in range(3):
        page.type("run.py")
    page.hears("/rosoclingo/about")


@pytest.mark.costly
@of("rosoclingo/README.md", "The manual's example")
def test_the_blocks_world(page: Page) -> None:
    for _ in range(3):
        page.type("run.py")
    page.type("rostopic echo").wait_for("do(arm,putdown(3),14)")


@pytest.mark.costly
@of("rosoclingo/README.md", "Diagnostics")
def test_diagnostics(page: Page) -> None:
    terminals = page.terminals
    terminals.start("rosrun", "rosoclingo", "run-1.0.py", "-f", str(LINE))
    page.sees("/rosoclingo/pause")
    assert "success: True" in terminals.run("rosservice", "call", "/rosoclingo/pause").output
    echo = page.type("rostopic echo")
    echo.wait_for("paused by an operator")
    summary = page.run("/rosoclingo/summary")
    check_output("rosoclingo/README.md", "Diagnostics", echo.output + summary)
    page.run("rosparam load")
    analyzers = terminals.run("rosparam", "get", "/diagnostic_aggregator/analyzers/rosoclingo")
    assert "path: ROSoClingo" in analyzers.output


@pytest.mark.costly
@of("rosoclingo/README.md", "An operator")
def test_an_operator(page: Page) -> None:
    terminals = page.terminals
    node = terminals.start(
        "roslaunch", "rosoclingo", "single.launch", f"encoding:={LINE}", "ask_before:=go(3) stop(*)"
    )
    page.sees("/rosoclingo/pause")
    check_output("rosoclingo/README.md", "An operator", page.run("pause"))
    held = terminals.listen("/rosoclingo", "/rosoclingo/held")
    terminals.publish(
        "/rosoclingo/goal", "rosoclingo/ROSoClingoActionGoal", "{goal: {request: visit(3)}}"
    )
    held.wait_for("do(robot,go(2))")
    assert "success: True" in page.run("hold")
    call = ("rosservice", "call")
    for name, arguments in (("resume", []), ("release", ["{actuator: robot}"])):
        assert "robot: go(2)" not in node.output
        said = terminals.run(*call, f"/rosoclingo/{name}", *arguments)
        assert "success: True" in said.output
    node.wait_for("robot: go(2)")
    terminals.publish("/rosoclingo/in", "rosoclingo/ROSoClingoIn", "{id: robot, value: success}")
    held.wait_for("approval")
    assert "success: True" in page.run("approve")
    node.wait_for("robot: go(3)")
    assert "no action deliver(1) of robot is held" in page.run("reject")


@pytest.mark.costly
@of("rosoclingo/README.md", "Retries and timeouts")
def test_policies(page: Page) -> None:
    """An action that fails twice is told to the planner as one success."""
    terminals = page.terminals
    shutil.copy(LINE, page.folder / "my_task.lp")
    terminals.start(
        "rosrun", "rosoclingo_interfaces", "fulfill.py", "_sequence:=failure failure success"
    )
    launched = page.type("rosoclingo.launch")
    page.hears("/rosoclingo/about")
    heard = terminals.listen("/rosoclingo", "/rosoclingo/feedback")
    result = terminals.listen("/rosoclingo", "/rosoclingo/result")
    terminals.publish(
        "/rosoclingo/goal", "rosoclingo/ROSoClingoActionGoal", "{goal: {request: visit(2)}}"
    )
    result.wait_for("succeeded")
    for retry in (1, 2):
        heard.wait_for(f"robot go(2): failure, retry {retry} of 2 in 1 s")
    assert launched.output.count("robot: go(2)") == 3


@of("docs/protocol.md", "Policies")
def test_the_policies_of_the_protocol(page: Page) -> None:
    """As roslaunch and rosparam have it: a file that is loaded for the node."""
    file = page.folder / "policies.yaml"
    file.write_text(page.block("yaml"))
    loaded = page.terminals.run("rosparam", "load", str(file), "/rosoclingo")
    assert loaded.wait() == 0, loaded.output
    said = page.terminals.run("rosparam", "get", "/rosoclingo/policies").output
    policies = ActionPolicies(yaml.safe_load(said))
    assert policies.of("robot", "go(3)").factor == 3
    assert policies.of("robot", "deliver(3)").then == "stuck"


@of("rosoclingo/README.md", "At the desk: plan.py")
def test_plan(page: Page) -> None:
    planned = page.run("plan.py")
    said = planned + page.run("--simulate")
    check_output("rosoclingo/README.md", "At the desk: plan.py", said)
    page.has(line_lp=LINE)
    has_libraries(page)
    assert page.run("python3 -m").splitlines()[1:] == planned.splitlines()[1:]


@of("rosoclingo/README.md", "Where the time goes")
def test_profile(page: Page) -> None:
    page.has(line_lp=LINE)
    check_output("rosoclingo/README.md", "Where the time goes", page.run("--profile"))


@pytest.mark.costly
@of("rosoclingo/README.md", "Before it runs: check.py")
def test_check(page: Page) -> None:
    """The command shows what it says."""
    (page.folder / "my_rule.lp").write_text(page.block("prolog"))
    page.has(line_lp=LINE)
    terminal = page.type("check.py")
    assert terminal.wait() == 1, terminal.output
    check_output("rosoclingo/README.md", "Before it runs: check.py", terminal.output)


@pytest.mark.costly
@of("rosoclingo/README.md", "A domain in PDDL: pddl.py")
def test_pddl(page: Page) -> None:
    page.set_variables()
    written = page.run("pddl.py")
    check_output("rosoclingo/README.md", "A domain in PDDL: pddl.py", written)
    assert "goal 1, goal, succeeds" in page.run("plan.py")


@pytest.mark.costly
@of("rosoclingo/README.md", "One node: run-1.0.py")
def test_one_node(page: Page) -> None:
    page.has(instance_lp=OFFICE, encoding_lp=PAPER)
    for word in ("run-1.0.py", "single.launch"):
        page.type(word)
        page.hears("/rosoclingo/about")
        page.interrupt()


@pytest.mark.costly
@of("docs/recovery.md", "Recovery")
def test_recovery(page: Page) -> None:
    shutil.copy(LINE, page.folder / "my_task.lp")
    launched = page.type("rosoclingo.launch")
    page.hears("/rosoclingo/about")
    page.run("/rosoclingo | awk")
    launched.wait_for("goes on with the run in the store")
    page.interrupt()
