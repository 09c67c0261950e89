"""Asks a running system why: each question, each way to an answer, and what goes wrong.

Needs a sourced workspace, in devel or install space.
"""

from __future__ import annotations

import contextlib
import json
import os
import signal
from pathlib import Path
from typing import List

import pytest
from terminals import Terminal, Terminals, package, terminals, wait_for

__all__ = ["terminals"]

# A request of which nothing becomes, so that the goal waits.
WAITS = """
rslot(1).
#program state(t).
#external event(1,(here;there),t).
status(1,accepted,t) :- event(1,_,t).
status(1,succeeded,t) :- event(1,here,t).
#program query(t).
#external query(t).
"""
# Other tests may take most of the time; without ~why_nice, they could take all of it.
PATIENCE = 600.0  # seconds
PATIENT = (f"_why_seconds:={PATIENCE}", "_why_nice:=0")


def answering(node: Terminal) -> List[int]:
    """Returns the processes of a node that answer."""
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            parent = int((process / "stat").read_text().rpartition(")")[2].split()[1])
            is_one = "rosoclingo.why.serving" in (process / "cmdline").read_text()
            if is_one and parent == node.process.pid:
                found.append(int(process.name))
    return found


def send(terminals: Terminals, request: str) -> None:
    """Sends a goal as an old client may do, by the topic."""
    wait_for(lambda: "/rosoclingo/goal" in terminals.names())
    terminals.publish(
        "/rosoclingo/goal", "rosoclingo/ROSoClingoActionGoal",
        f"{{goal: {{request: '{request}'}}}}",
    )  # fmt: skip


def why(terminals: Terminals, *options: str, status: int = 0) -> str:
    """Asks, and returns what is said."""
    asked = terminals.start("rosrun", "rosoclingo", "why.py", *options)
    assert asked.wait(PATIENCE) == status, asked.output
    lines = asked.output.splitlines(keepends=True)
    return "".join(line for line in lines if not line.startswith("why.py: waiting for "))


@pytest.mark.install_space
def test_three_nodes(terminals: Terminals) -> None:
    """Until there is no plan: what was found out then is heard before the node ends."""
    mode = package("rosoclingo") / "modes" / "dynamic.incremental.dyn_reset.lp"
    line = package("rosoclingo") / "example" / "line.lp"
    options = {"controller": [str(mode), "-c", "steps=12"], "planner": [str(line)]}
    node = terminals.start("rosrun", "rosoclingo", "run.py", *PATIENT)
    for name, arguments in options.items():
        terminals.start("rosrun", "rosclingo", "run.py", f"__name:={name}", "-f", *arguments)
    feedback = terminals.listen("/rosoclingo", "/rosoclingo/feedback")
    journal = terminals.listen("/rosoclingo", "/rosoclingo/journal")
    send(terminals, "visit(3)")
    node.wait_for("robot: go(2)")

    assert why(terminals) == "There is a plan of 1 step.\n"
    assert why(terminals, "--goal", "1").startswith("visit(3) ends in step ")
    assert "If robot were not to do go(3) in step" in why(
        terminals, "--action", "do(robot,go(3),9)"
    )
    assert "If robot were to do go(1) in step" in why(terminals, "--instead", "do(robot,go(1),9)")
    said = "There would be no plan for visit(3) because info says close(3)."
    assert why(terminals, "--if", "info:close(3)").startswith(said)
    found = json.loads(why(terminals, "--if", "goal:visit(2)", "--if", "info:close(3)", "--json"))
    assert found["text"].startswith(said)
    assert [told.rpartition(",")[0] for told in found["told"]] == [
        "event(2,visit(2)", "event(info,close(3)",
    ]  # fmt: skip
    assert "no open goal visit(4); there are visit(3)" in why(
        terminals, "--goal", "visit(4)", status=2
    )

    (process,) = answering(node)
    os.kill(process, signal.SIGKILL)
    assert why(terminals) == "There is a plan of 1 step.\n"
    assert "the process that answers questions has ended by SIGKILL" in node.output

    terminals.publish("/rosoclingo/in", "rosoclingo/ROSoClingoIn", "{id: info, value: close(3)}")
    assert node.wait(PATIENCE) == 1
    reason = "There is no plan for visit(3) because"  # the rest is on another line
    assert f"why: {reason}" in node.output
    feedback.wait_for(f"why: {reason}", PATIENCE)
    journal.wait_for('kind: "end"')
    heard = journal.output.partition('kind: "end"')[0]
    assert reason in heard.rpartition('kind: "why"')[2]
    assert answering(node) == []
    assert "no node of that name runs" in why(terminals, status=1)
    for word in ("Traceback", "internal error"):
        assert word not in node.output


@pytest.mark.costly
def test_a_reason_that_took_too_long_is_looked_for_again(
    terminals: Terminals, tmp_path: Path
) -> None:
    """With twice the time each time, until the goal is told; a client's question comes first."""
    file = tmp_path / "waits.lp"
    file.write_text(WAITS)
    options = ("_why_seconds:=0.001", "_why_nice:=0")
    node = terminals.start("rosrun", "rosoclingo", "run-1.0.py", "-f", str(file), *options)
    feedback = terminals.listen("/rosoclingo", "/rosoclingo/feedback")
    send(terminals, "there")
    node.wait_for("there was no time for an answer within 0.001 s")
    feedback.wait_for("why: There is no plan for there, whatever", PATIENCE)


@pytest.mark.costly
def test_a_question_does_not_wait_for_background_reasons(
    terminals: Terminals, tmp_path: Path
) -> None:
    """Their search is cancelled for it, even if its process stands still, and begins again."""
    file = tmp_path / "waits.lp"
    file.write_text(WAITS)
    node = terminals.start("rosrun", "rosoclingo", "run-1.0.py", "-f", str(file), *PATIENT)
    feedback = terminals.listen("/rosoclingo", "/rosoclingo/feedback")
    wait_for(lambda: "/rosoclingo/why" in terminals.names())
    why(terminals)
    (process,) = answering(node)
    os.kill(process, signal.SIGSTOP)
    send(terminals, "there")
    feedback.wait_for("waiting in step ")
    assert why(terminals, "--goal", "there").startswith("There is no plan for there, whatever")
    assert process not in answering(node)
    feedback.wait_for("why: There is no plan for there, whatever", PATIENCE)


@pytest.mark.costly
def test_one_node(terminals: Terminals, tmp_path: Path) -> None:
    """A goal is told why it waits; and a node ends while it is asked."""
    file = tmp_path / "waits.lp"
    file.write_text(WAITS)
    node = terminals.start("rosrun", "rosoclingo", "run-1.0.py", "-f", str(file), *PATIENT)
    feedback = terminals.listen("/rosoclingo", "/rosoclingo/feedback")
    send(terminals, "there")
    reason = "There is no plan for there, whatever"  # the rest is on another line
    feedback.wait_for("waiting in step ")
    feedback.wait_for(f"why: {reason}", PATIENCE)
    assert why(terminals, "--goal", "there").startswith(reason)

    (process,) = answering(node)
    os.kill(process, signal.SIGSTOP)
    asked = terminals.start("rosrun", "rosoclingo", "why.py")
    asked.wait_for("waiting for /rosoclingo/why, which computes the answer, for ")
    for _ in range(4):  # which waits for no other question, and for no process
        assert why(terminals, "--happened", "go(2)").startswith("go(2) was never done")
    node.interrupt()
    assert node.wait() == 0
    assert asked.wait() == 1
    assert "the node is shutting down" in asked.output
    assert answering(node) == []
    for terminal in (node, asked):
        assert "Traceback" not in terminal.output
