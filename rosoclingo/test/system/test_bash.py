"""Completes ``why.py`` in bash, in a terminal, with what a running system knows.

Needs a sourced workspace, in devel or install space.
"""

from __future__ import annotations

import contextlib
import json
import os
import socket
import subprocess
import sys
from pathlib import Path

import pytest
from terminals import TIMEOUT, Terminals, package, terminals, wait_for
from typist import keyboard

__all__ = ["terminals"]

# Added to the robot on a line.
REQUESTS = """
text("$(touch ran)"; "`touch ran`"; "it's").
#program state(t).
#external event(ID,say(T),t) : rslot(ID), text(T).
"""
# In the place of the program that rosrun finds, so that the arguments are seen that bash gives it.
TRIES = 24  # of TAB, 5 s each
ROSRUN = "rosrun() { printf '<%s>' \"$@\"; echo; }"


def test_a_master_that_does_not_answer() -> None:
    program = "from rosoclingo.tools.completion.ros.shell import main; main()"
    command = [sys.executable, "-c", program, "rosrun rosoclingo why.py --goal ", " "]
    with socket.create_server(("localhost", 0)) as silent:
        uri = f"http://localhost:{silent.getsockname()[1]}"
        said = subprocess.run(
            command,
            check=False,
            capture_output=True,
            timeout=TIMEOUT,
            env={**os.environ, "ROS_MASTER_URI": uri},
        )
    assert said.stdout == said.stderr == b""


@pytest.mark.costly
@pytest.mark.both_spaces
def test_why(terminals: Terminals, tmp_path: Path) -> None:
    (tmp_path / "requests.lp").write_text(REQUESTS)
    terminals.environment.update(INPUTRC="/dev/null", TERM="dumb")
    shell, typist = keyboard(terminals, tmp_path, "bash", "--norc", "-i")
    setup = Path(os.environ["CMAKE_PREFIX_PATH"].split(os.pathsep)[0]) / "setup.bash"
    typist.type(f"cd {tmp_path}; . {setup}; {ROSRUN}; echo rea''dy\n")
    shell.wait_for("ready")

    def check(begun: str, completed: str, argument: str) -> None:
        """Types a line, presses TAB until it is completed, and looks what rosrun is given.

        On a slow machine, a TAB may offer nothing.
        """
        before = len(shell.output)
        typist.type(f"rosrun rosoclingo {begun}")
        for _ in range(TRIES):
            typist.type("\t")
            with contextlib.suppress(AssertionError):
                wait_for(lambda: completed in shell.output[before:], timeout=5.0)
                break
        assert completed in shell.output[before:], shell.output
        typist.type("\n")
        wait_for(lambda: f"<{argument}>\n" in shell.output[before:], lambda: shell.output)

    check("wh", "why.py ", "why.py")  # by rosbash
    check("why.py --act", "--action ", "--action")
    typist.type("rosrun rosoclingo why.py --goal v\tx\n")  # there is no system yet
    shell.wait_for("<--goal><vx>")

    line = package("rosoclingo") / "example" / "line.lp"
    files = ("-c", "slots=4", "-f", str(line), "-f", str(tmp_path / "requests.lp"))
    terminals.start("rosrun", "rosoclingo", "run-1.0.py", *files)
    terminals.latched("/rosoclingo/about")
    for request in ("visit(3)", 'say("$(touch ran)")', 'say("`touch ran`")', 'say("it\'s")'):
        terminals.publish(
            "/rosoclingo/goal", "rosoclingo/ROSoClingoActionGoal",
            f"{{goal: {{request: {json.dumps(request)}}}}}",
        )  # fmt: skip
        terminals.listen("/rosoclingo", "/rosoclingo/journal").wait_for(json.dumps(request))
    terminals.listen("/rosoclingo", "/rosoclingo/out").wait_for("go(2)")
    check("why.py --goal v", "'visit(3)' ", "visit(3)")
    check("why.py --goal 'say(\"$", "ran)\")' ", 'say("$(touch ran)")')
    check('why.py --goal "say(\\"\\`', 'ran\\`\\")" ', 'say("`touch ran`")')
    check("why.py --goal 'say(\"i", "s\")' ", 'say("it\'s")')
    check("why.py --goal=visit\\(", "'visit(3)' ", "--goal=visit(3)")
    check("why.py --action 'do(robot,go(3", ",2)' ", "do(robot,go(3),2)")
    named = "why.py __ns:=my_robot rosoclingo:=/rosoclingo --goal v"
    check(named, "'visit(3)' ", "visit(3)")
    typist.type("rosrun rosoclingo why.py rosoclingo:=nobody --goal v\tx\n")
    shell.wait_for("<rosoclingo:=nobody><--goal><vx>")
    assert "rosoclingo_completion" not in "".join(terminals.names())
    assert not (tmp_path / "ran").exists()
    typist.type("exit\n")
    assert shell.wait() == 0
