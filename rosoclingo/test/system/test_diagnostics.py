"""Nodes publish their health on /diagnostics: docs/protocol.md, section "Diagnostics".

The planning node publishes the same in short on ~summary. Needs a sourced workspace.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, Dict, List, Sequence

import pytest
import yaml
from terminals import Terminal, Terminals, package, terminals, wait_for
from topics import Listener

__all__ = ["terminals"]

OK, WARN, ERROR = range(3)
NODE, PLANNER = "/rosoclingo", "/planner"
MODE = "dynamic.incremental.recording"

# On the line, each action should take a second, and a goal can be asked for that is never reached,
# which takes clingo minutes to find: to put 12 pigeons into 11 holes.
MORE = """
#program state(t).
#external event(ID,hard,t) : rslot(ID).
hard(t) :- event(_,hard,t).
1 { in(P,H,t) : H=1..11 } 1 :- P=1..12, hard(t).
:- in(P,H,t), in(Q,H,t), P < Q.
#program transition(t).
lasts(do(R,A,t),go,1) :- do(R,A,t).
#show lasts/3.
"""


class Diagnostics:
    """Listens to /diagnostics of some nodes."""

    def __init__(self, terminals: Terminals, *nodes: str) -> None:
        self._heard: List[Listener] = [terminals.listen(node, "/diagnostics") for node in nodes]

    def statuses(self) -> Dict[str, Any]:
        """Returns the statuses that each node has published last, by their names."""
        found = {}
        for heard in self._heard:
            for text in heard.output.split("\n---\n")[-2:-1]:
                for status in yaml.load(text, yaml.CSafeLoader)["status"]:
                    values = {pair["key"]: str(pair["value"]) for pair in status["values"]}
                    found[status["name"]] = {**status, "values": values}
        return found

    def wait_for(self, name: str, level: int, message: str, **known: str) -> Dict[str, str]:
        """Waits until a status is so, with some values, and returns all its values."""
        found: Dict[str, str] = {}

        def is_so() -> bool:
            status = self.statuses().get(name, {"level": -1, "message": "", "values": {}})
            found.update(status["values"])
            is_known = all(re.fullmatch(known[key], found.get(key, "")) for key in known)
            is_right = re.search(message, status["message"]) is not None
            return status["level"] == level and bool(found) and is_right and is_known

        wait_for(is_so, self.statuses, poll=0.2)
        return found


class Summaries:
    """Listens to the summaries of the planning node."""

    def __init__(self, terminals: Terminals) -> None:
        self._heard = terminals.listen(NODE, f"{NODE}/summary")

    def last(self) -> Dict[str, Any]:
        """Returns the last one, by its fields; nothing if there is none."""
        found = self._heard.output.split("\n---\n")[-2:-1]
        return yaml.load(found[0], yaml.CSafeLoader) if found else {}

    def wait_for(self, text: str, **known: object) -> Dict[str, Any]:
        """Waits for one whose text and other fields are so, and returns it."""
        found: Dict[str, Any] = {}

        def is_so() -> bool:
            found.update(self.last())
            is_known = all(found.get(name) == value for name, value in known.items())
            return is_known and re.search(text, found.get("text", "")) is not None

        wait_for(is_so, self.last, poll=0.2)
        return found


def line() -> str:
    return str(package("rosoclingo") / "example" / "line.lp")


def start(terminals: Terminals, nodes: int, files: Sequence[str], *more: str) -> List[Terminal]:
    """Starts a system with one node or three, that with the loop first."""
    loaded = [word for file in files for word in ("-f", file)]
    if nodes == 1:
        return [terminals.start("rosrun", "rosoclingo", "run-1.0.py", *loaded, *more)]
    mode = str(package("rosoclingo") / "modes" / f"{MODE}.lp")
    controller = ("-f", mode, "-c", "steps=30", "_diagnostics_period:=0")
    fast = ("_diagnostics_period:=0.2", "_slow_seconds:=0.5")
    return [
        terminals.start("rosrun", "rosoclingo", "run.py", *more),
        terminals.start("rosrun", "rosclingo", "run.py", "__name:=planner", *loaded, *fast),
        terminals.start("rosrun", "rosclingo", "run.py", "__name:=controller", *controller),
    ]


def ask(terminals: Terminals, request: str) -> None:
    terminals.publish(
        f"{NODE}/goal", "rosoclingo/ROSoClingoActionGoal",
        f"{{goal_id: {{id: {request}}}, goal: {{request: {request}}}}}",
    )  # fmt: skip


def call(terminals: Terminals, name: str) -> None:
    assert "success: True" in terminals.run("rosservice", "call", f"{NODE}/{name}").output


@pytest.mark.costly
@pytest.mark.parametrize("nodes", [1, 3])
def test_a_run(terminals: Terminals, tmp_path: Path, nodes: int) -> None:
    """At rest, paused, with a silent robot, in a long search, and without a solver."""
    more, store = tmp_path / "more.lp", tmp_path / "run.store"
    more.write_text(MORE)
    started = start(
        terminals, nodes, [line(), str(more)], f"_store:={store}", "_action_timeout:=8",
        "_diagnostics_period:=0.2", "_slow_seconds:=0.5",
    )  # fmt: skip
    solver_node = NODE if nodes == 1 else PLANNER
    seen = Diagnostics(terminals, *{NODE, solver_node})
    loop, robot, solver = (
        "rosoclingo: loop",
        "rosoclingo: actuator robot",
        f"{solver_node[1:]}: solver",
    )

    values = seen.wait_for(loop, OK, "^waits for inputs, step 0 of 0$")
    assert values["goals with a slot"] == values["goals that wait for a slot"] == "0"
    assert float(values["memory (MB)"]) > 1.0
    values = seen.wait_for("rosoclingo: store", OK, "^each step is written$")
    assert values["path"] == str(store)
    assert float(values["size (MB)"]) > 0.0
    assert float(values["since the last commit (s)"]) >= 0.0
    seen.wait_for(solver, OK, "^idle$", atoms=r"[1-9]\d*")
    assert set(seen.statuses()) == {loop, "rosoclingo: store", solver}
    assert all(status["hardware_id"] for status in seen.statuses().values())

    call(terminals, "pause")
    ask(terminals, "visit(3)")
    values = seen.wait_for(loop, WARN, r"^paused .*: robot go\(2\) \(pause\)$")
    assert (values["goals with a slot"], values["paused"]) == ("1", "yes")
    assert float(values["last search (s)"]) >= 0.0
    seen.wait_for(robot, WARN, r"^go\(2\) waits for an operator \(pause\)$")
    call(terminals, "resume")
    values = seen.wait_for(robot, OK, r"^go\(2\), for ")
    assert values["state"] == "acts"
    values = seen.wait_for(loop, OK, r"^waits for actuators, step \d+ of \d+$")
    assert float(values["since the last decision (s)"]) >= 0.0

    seen.wait_for(robot, WARN, r"^go\(2\) takes \d+ s, and 1 s were expected")
    seen.wait_for(robot, ERROR, r"^has not answered in time")
    terminals.publish(f"{NODE}/in", "rosoclingo/ROSoClingoIn", "{id: robot, value: success}")
    seen.wait_for(robot, OK, "")

    ask(terminals, "hard")
    slow = r"^searches for a plan, for .*~slow_seconds \(0.5 s\)$"
    values = seen.wait_for(loop, WARN, slow, **{"goals with a slot": "2"})
    assert float(values["search under way (s)"]) > 0.5
    values = seen.wait_for(solver, WARN, r"^solving for .*~slow_seconds \(0.5 s\)$")
    assert values["state"] == "solving"
    assert float(values["in this state (s)"]) > 0.5
    if nodes == 3:
        assert "/controller" not in terminals.publishers("/diagnostics")
        started[1].process.kill()
        seen.wait_for(loop, WARN, r"^waits for a solver that was lost")
    started[0].interrupt()
    assert started[0].wait() == 0
    assert not any("Traceback" in one.output for one in started)


def test_a_summary(terminals: Terminals, tmp_path: Path) -> None:
    """At rest, paused, with a robot that acts, and in a long search."""
    more = tmp_path / "more.lp"
    more.write_text(MORE)
    start(terminals, 1, [line(), str(more)], "_diagnostics_period:=0.2")
    summaries = Summaries(terminals)
    summary = summaries.wait_for("^waits for inputs at step 0 of 0: 0 goals open, 0 wait$")
    assert (summary["state"], summary["paused"], summary["actuators"]) == ("waits", False, [])
    assert summary["header"]["stamp"]["secs"] > 0

    call(terminals, "pause")
    ask(terminals, "visit(3)")
    summary = summaries.wait_for(
        r"^paused.* at step \d+ of \d+: 1 goal open, 0 wait; robot waits for an operator to begin",
        paused=True, goals_open=1, goals_waiting=0,
        actuators=["robot"], states=["held"], actions=["go(2)"], seconds=[0.0],
    )  # fmt: skip
    assert summary["horizon"] >= 2
    assert min(summary[f"seconds_{name}"] for name in ("since_decision", "of_last_search")) >= 0.0
    assert summary["age"] >= 0.0
    call(terminals, "resume")
    does = r"; robot does go\(2\) for \d+ s$"
    summary = summaries.wait_for(does, paused=False, states=["acts"], actions=["go(2)"])
    assert summary["seconds"][0] >= 0.0

    ask(terminals, "hard")
    summaries.wait_for("^searches for a plan at ", state="searches", goals_open=2)


def test_the_end_of_a_loop(terminals: Terminals) -> None:
    """Its reason is published before the node ends."""
    (node,) = start(terminals, 1, [line()], "-c", "steps=2")
    seen = Diagnostics(terminals, NODE)
    seen.wait_for("rosoclingo: loop", OK, "^waits for inputs")
    summaries = Summaries(terminals)
    ask(terminals, "visit(6)")
    assert node.wait() == 1
    seen.wait_for("rosoclingo: loop", ERROR, r"^has ended: the planner has no plan within")
    summaries.wait_for(
        r"^has ended \(the planner has no plan within .* 0 goals open", state="ended"
    )


def test_a_replay_publishes_none(terminals: Terminals) -> None:
    start(terminals, 1, [line()], '_replay:="[]"')
    terminals.latched(f"{NODE}/plan")  # the loop is at work
    assert not terminals.publishers("/diagnostics")
    assert not terminals.publishers(f"{NODE}/summary")
