"""The manual's commands as a user types them: processes of their own, on a master of their own.

Needs a sourced workspace, in devel or install space.
"""

from __future__ import annotations

import ast
import os
import signal
import subprocess
from pathlib import Path
from typing import List

import pytest
from terminals import TIMEOUT, Terminal, Terminals, executable, package, terminals, wait_for

__all__ = ["terminals"]

# A client that has sent a request, and sends another one when its node was started again.
CLIENT = """
import threading

from rosclingo.errors import ServiceError
from rosclingo.ros.client import Client
from rosclingo.ros.init import init_node
from rosclingo.wire.commands import GetPrograms

init_node("client")
client = Client()
client.wait()
client.control(GetPrograms())
print("is there", flush=True)
pause = threading.Event()
try:
    while not pause.wait(0.01):
        client.check()
except ServiceError as err:
    print(err, flush=True)
client.wait()
client.control(GetPrograms())
print("is there again", flush=True)
"""

# A client in whose search the node is told to end, and that needs another one then.
SEARCHING = """
from rosclingo.errors import ServiceError
from rosclingo.ros.client import Client
from rosclingo.ros.init import init_node
from rosclingo.wire.commands import Add, GetPrograms, Ground, Part

HARD = "{ in(P,H) : H = 1..12 } = 1 :- P = 1..13. :- in(P,H), in(Q,H), P < Q."

def begins():
    print("searches", flush=True)
    return False

init_node("client")
client = Client()
client.wait()
client.control(Add("hard", (), HARD), Ground((Part("hard"),)))
for call in (lambda: client.solve(stopped=begins), lambda: client.run([GetPrograms()])):
    try:
        print("result:", call(), flush=True)
    except ServiceError as err:
        print("error:", err, flush=True)
client.wait()
client.control(GetPrograms())
print("is there again", flush=True)
"""

# A node that gets a control request after it was told to end.
ENDING = """
import rospy
from rosclingo.ros.init import init_node
from rosclingo.ros.node import SolverNode
from rosclingo.solver.engine import Engine
from rosclingo.solver.options import parse_options
from rosclingo.srv import ROSClingoControl
from rosclingo.wire.commands import GetPrograms
from rosclingo.wire.xml_codec import encode_commands

init_node("solver")
node = SolverNode(Engine(parse_options([])), "about")
node.worker.close()
control = rospy.ServiceProxy("~control", ROSClingoControl)
print(control(encode_commands([GetPrograms()])), flush=True)
"""

MANUAL = {
    "do(arm,pickup(4),1)", "do(arm,putdown(b),2)", "do(arm,pickup(3),3)", "do(arm,putdown(4),4)",
    "do(arm,pickup(2),5)", "do(arm,putdown(3),6)", "do(arm,pickup(1),7)", "do(arm,putdown(c),8)",
    "do(arm,pickup(2),9)", "do(arm,putdown(1),10)", "do(arm,pickup(3),11)",
    "do(arm,putdown(2),12)", "do(arm,pickup(4),13)", "do(arm,putdown(3),14)",
}  # fmt: skip


def example() -> str:
    return str(package("rosclingo") / "example")


def answer_set(output: str) -> List[str]:
    (line,) = [line for line in output.splitlines() if line.startswith("answerset: ")]
    atoms = ast.literal_eval(line[len("answerset: ") :])
    assert isinstance(atoms, list)
    return atoms


@pytest.mark.install_space
def test_one_shot(terminals: Terminals) -> None:
    folder = example()
    terminals.start(
        "rosrun", "rosclingo", "run.py", "-f", f"{folder}/instance.lp", "-f", f"{folder}/toh.lp"
    )
    wait_for(lambda: "/rosclingo/control" in terminals.names())
    for _ in range(2):  # the second run finds the solver as the first one left it
        ended = terminals.run("python", f"{folder}/start.py")
        # On a busy machine, it says that it waits; it says nothing else before the result.
        waits = "waiting for the solver /rosclingo: it runs, and is not ready yet"
        lines = [line for line in ended.output.splitlines() if waits not in line]
        assert lines[:3] == ["##### result", "result: sat", "interrupted: False"]
        assert lines[4:] == ["#####"]
        atoms = answer_set(ended.output)
        assert set(atoms) == MANUAL
        assert [int(atom.rstrip(")").rsplit(",")[-1]) for atom in atoms] == list(range(1, 15))
        assert ended.wait() == 0


def test_one_shot_with_too_few_actions(terminals: Terminals) -> None:
    folder = example()
    terminals.start(
        "rosrun", "rosclingo", "run.py", "-c", "max=13",
        "-f", f"{folder}/instance", "-f", f"{folder}/toh",
    )  # fmt: skip
    ended = terminals.run("python", f"{folder}/start.py")
    assert "result: unsat" in ended.output.splitlines()
    assert answer_set(ended.output) == []


@pytest.mark.install_space
def test_incremental(terminals: Terminals) -> None:
    folder = example()
    terminals.start(
        "rosrun", "rosclingo", "run.py", "-f", f"{folder}/instance.lp", "-f", f"{folder}/itoh.lp"
    )
    wait_for(lambda: "/rosclingo/control" in terminals.names())
    for _ in range(2):
        ended = terminals.run("python", f"{folder}/istart.py")
        horizons = [f"solving with horizon {horizon}" for horizon in range(15)]
        lines = ended.output.splitlines()
        assert lines[:18] == [*horizons, "##### result", "result: sat", "interrupted: False"]
        assert lines[19:] == ["#####"]
        assert set(answer_set(ended.output)) == MANUAL


def test_names_move(terminals: Terminals) -> None:
    terminals.environment["ROS_NAMESPACE"] = "robot1"
    terminals.start("rosrun", "rosclingo", "run.py", "__name:=controller")
    words = ("goal", "cancel", "status", "result", "control")
    names = {f"/robot1/controller/{word}" for word in words}
    wait_for(lambda: names <= terminals.names())


@pytest.mark.install_space
def test_launch_file(terminals: Terminals) -> None:
    folder = example()
    terminals.start(
        "roslaunch", "rosclingo", "rosclingo.launch",
        f"files:={folder}/instance.lp {folder}/toh.lp", "options:=-c max=14",
    )  # fmt: skip
    ended = terminals.run("python", f"{folder}/start.py")
    assert set(answer_set(ended.output)) == MANUAL


@pytest.mark.costly
def test_launch_file_that_records(terminals: Terminals, tmp_path: Path) -> None:
    folder, bag = example(), tmp_path / "a.bag"
    launch = terminals.start(
        "roslaunch", "rosclingo", "rosclingo.launch", f"record:={bag}",
        f"files:={folder}/instance.lp {folder}/toh.lp", "options:=-c max=14",
    )  # fmt: skip
    heard = [f"rosclingo/{topic}" for topic in ("about", "control_log", "result")]
    wait_for(
        lambda: all(
            "/rosclingo_recorder" in terminals.receivers("/rosclingo", f"/{topic}")
            for topic in heard
        )
    )
    assert terminals.run("python", f"{folder}/start.py").wait() == 0
    launch.interrupt()
    assert launch.wait() == 0, launch.output
    info = terminals.run("rosbag", "info", str(bag)).output
    for topic in heard:  # a goal may be too early for who has just heard of its client
        assert f" {topic} " in info


def test_a_client_without_a_solver_says_what_it_waits_for(
    terminals: Terminals, tmp_path: Path
) -> None:
    """It says so on stderr: its output stays as the manual shows it."""
    output = tmp_path / "output"
    client = terminals.start("bash", "-c", f"exec python {example()}/start.py >{output}")
    client.wait_for("waiting for the solver /rosclingo: no node of that name runs: it was not ")
    assert "start one with: rosrun rosclingo run.py __name:=rosclingo -f FILE" in client.output
    client.interrupt()
    assert client.wait() == 1
    assert output.read_text() == ""


def test_a_solver_that_was_killed_is_known_to_have_ended(terminals: Terminals) -> None:
    node = terminals.start("rosrun", "rosclingo", "run.py")
    wait_for(lambda: "/rosclingo/control" in terminals.names())
    node.process.kill()
    node.wait()
    client = terminals.start("python", f"{example()}/start.py")
    client.wait_for("waiting for the solver /rosclingo: it has ended without a word")
    client.interrupt()
    assert client.wait() == 1


@pytest.mark.costly
@pytest.mark.parametrize("threads", [1, 2])
def test_interrupt_of_a_search(terminals: Terminals, tmp_path: Path, threads: int) -> None:
    program = "1 {at(P,H) : H=1..11} 1 :- P=1..12. :- at(P,H), at(Q,H), P<Q. "
    (tmp_path / "hard.lp").write_text(program)
    node = terminals.start(
        "rosrun", "rosclingo", "run.py", "-f", str(tmp_path / "hard.lp"), f"_threads:={threads}"
    )
    client = terminals.start("python", f"{example()}/start.py")
    terminals.listen("/rosclingo", "/rosclingo/status").wait_for("status: 1")
    interrupt(node, client)


def interrupt(node: Terminal, client: Terminal) -> None:
    """Presses Ctrl-C at a node, which ends, and its client says that it went away."""
    node.interrupt()
    assert node.wait() == 0
    assert client.wait() == 1, client.output
    assert "Traceback" not in client.output


def test_interrupt_of_a_grounding(terminals: Terminals, tmp_path: Path) -> None:
    """Of a client that waits for it, and of the node, which clingo does not interrupt."""
    (tmp_path / "slow.lp").write_text("n(1..100000). p(X,Y,Z) :- n(X), n(Y), n(Z), X+Y+Z=7.")
    node = terminals.start("rosrun", "rosclingo", "run.py", "-f", str(tmp_path / "slow.lp"))
    clients = [terminals.start("python", f"{example()}/start.py") for _ in range(2)]
    wait_for(lambda: seconds_computed(node) > 1)
    clients[0].interrupt()
    assert clients[0].wait() == 1
    assert "Traceback" not in clients[0].output
    assert node.process.poll() is None
    interrupt(node, clients[1])


def seconds_computed(node: Terminal) -> float:
    """Returns the processor time of a node; rosrun replaces itself by it."""
    fields = Path(f"/proc/{node.process.pid}/stat").read_text().split()
    return int(fields[13]) / os.sysconf("SC_CLK_TCK")


@pytest.mark.costly
@pytest.mark.parametrize(
    ("arguments", "pieces"),
    [
        (["-f", "missing"], ["'missing'", "missing.lp"]),
        (["-f"], ["-f needs a value"]),
        (["-c", "max"], ["NAME=TERM"]),
        (["--no-such-option"], ["--no-such-option", "unknown option"]),
        (["-f", "wrong.lp"], ["wrong.lp:2:3-4: error: syntax error"]),
        (["-f", "unsafe.lp"], ["unsafe.lp:1:3-4", "unsafe"]),
        (["--theory", "lp"], ["--theory does not know 'lp'", "it knows dl"]),
        (["--theory", "dl"], ["--theory dl", "python -m pip install 'clingo-dl>="]),
    ],
)
def test_bad_start(tmp_path: Path, arguments: List[str], pieces: List[str]) -> None:
    """Needs no master: what is wrong is said at once."""
    (tmp_path / "wrong.lp").write_text("a.\nb c.\n")
    (tmp_path / "unsafe.lp").write_text("a(X).\n")
    (tmp_path / "clingodl.py").write_text("raise ImportError\n")  # as if it were not installed
    ended = subprocess.run(
        [executable("rosclingo", "run.py"), *arguments],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": f"{tmp_path}:{os.environ['PYTHONPATH']}"},
        capture_output=True,
        text=True,
        timeout=TIMEOUT,
        check=False,
    )
    assert ended.returncode == 2
    for piece in pieces:
        assert piece in ended.stderr
    assert "Traceback" not in ended.stderr


@pytest.mark.install_space
def test_wrong_parameters(terminals: Terminals) -> None:
    wrong = {
        "_max_request_bytes:=0": "parameter /n0/max_request_bytes: expected an integer from 1: 0",
        "_allow_scripts:=7": "parameter /n1/allow_scripts: expected true or false: 7",
        "_load_path:=7": "parameter /n2/load_path: expected a list of words: 7",
        "_threads:=0": "parameter /n3/threads: expected a number of threads from 1 to 64, or auto",
    }
    run = ("rosrun", "rosclingo", "run.py")
    nodes = [terminals.start(*run, f"__name:=n{n}", text) for n, text in enumerate(wrong)]
    nowhere = terminals.start(*run, '_load_path:=""')
    for node, text in zip(nodes, wrong.values()):
        assert node.wait() == 2
        assert text in node.output
        assert "Traceback" not in node.output
    nowhere.wait_for("clients may load from: nowhere")


@pytest.mark.parametrize(
    ("argument", "pieces"),
    [
        (
            "_load_path:=*",
            ["the parameter _load_path of the command line, '*', is wrong as YAML: "],
        ),
        (
            "_load_path:=[a",
            ["'[a', is wrong as YAML: line 1: ", "in quotes", "_load_path:=\"'*'\""],
        ),
        ('_load_path:="\\UFFFFFFFF"', ["_load_path", "is wrong as YAML: line 1: "]),
        ("_threads:=3000000000", ["_threads", "'3000000000', cannot be a parameter of ROS", "int"]),
        (
            "_threads:=2026-11-28",
            ["_threads", "'2026-11-28', cannot be a parameter of ROS", "date"],
        ),
        ("_threads:=null", ["_threads", "'null', cannot be a parameter of ROS", "None"]),
        ('_threads:="\\x01"', ["_threads", "cannot be a parameter of ROS", "in quotes"]),
        ('_threads:="\\ud800"', ["_threads", "cannot be a parameter of ROS", "in quotes"]),
        ("in:=a:=b", ["the word 'in:=a:=b' of the command line: expected := once"]),
        ("__master:=nowhere", ["the address of the ROS master", "nowhere", "http://localhost"]),
        ("__master:=ftp://nowhere", ["the address of the ROS master", "http://localhost"]),
    ],
)
def test_a_command_line_that_rospy_refuses(argument: str, pieces: List[str]) -> None:
    """Needs no master: what is wrong is said at once."""
    ended = subprocess.run(
        [executable("rosclingo", "run.py"), argument],
        capture_output=True, text=True, timeout=TIMEOUT, check=False,
    )  # fmt: skip
    assert ended.returncode == 2
    assert "rosclingo: the " in ended.stderr
    for piece in pieces:
        assert piece in ended.stderr
    assert "Traceback" not in ended.stderr


def test_parameters_without_a_master(tmp_path: Path) -> None:
    """A node waits for the master before it gives it those of the command line."""
    terminals = Terminals(tmp_path)
    try:
        node = terminals.start("rosrun", "rosclingo", "run.py", "_allow_scripts:=true")
        node.wait_for("waiting for the ROS master at")
        terminals.start_master()
        node.wait_for("parameter /rosclingo/allow_scripts is True")
        assert "Traceback" not in node.output
    finally:
        terminals.close()


def test_help() -> None:
    output = subprocess.check_output([executable("rosclingo", "run.py"), "--help"], text=True)
    assert output.startswith("usage: run.py [-f FILE]")


def test_a_node_that_is_started_again(terminals: Terminals) -> None:
    """The first request to it succeeds."""
    node = ("rosrun", "rosclingo", "run.py", "-f", f"{example()}/instance.lp")
    first = terminals.start(*node)
    client = terminals.start("python", "-c", CLIENT)
    client.wait_for("is there")
    os.killpg(first.process.pid, signal.SIGKILL)
    client.wait_for("went away")
    terminals.start(*node)
    client.wait_for("is there again")
    assert client.wait() == 0


def test_a_node_that_shuts_down_is_lost(terminals: Terminals) -> None:
    """It still answers meanwhile; the client waits for another one, and not for its word."""
    node = ("rosrun", "rosclingo", "run.py")
    first = terminals.start(*node)
    client = terminals.start("python", "-c", SEARCHING)
    client.wait_for("searches")
    os.killpg(first.process.pid, signal.SIGTERM)
    assert first.wait() == 0
    terminals.start(*node)
    client.wait_for("is there again")
    assert client.wait() == 0
    assert "error: the solver /rosclingo has ended: the node is shutting down" in client.output
    assert client.output.count("error: ") == 2


def test_a_node_that_shuts_down_refuses_without_a_warning(terminals: Terminals) -> None:
    """The client is told, and no operator is needed."""
    node = terminals.start("python", "-c", ENDING)
    assert node.wait() == 0
    assert "the node is shutting down" in node.output
    assert "control request refused" not in node.output
