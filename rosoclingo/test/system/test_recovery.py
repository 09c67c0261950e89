"""rosoclingo is killed, and another one goes on with what is in the store.

Needs a sourced workspace, in devel or install space.
"""

from __future__ import annotations

import os
import re
import signal
import subprocess
from functools import partial
from pathlib import Path
from typing import List

import pytest
from terminals import Terminal, Terminals, package, terminals, wait_for

from rosoclingo.bags.read.reader import read_recording
from rosoclingo.errors import StoreError
from rosoclingo.loop.durability import KnownGoal
from rosoclingo.loop.journal import MessageArrived, NodeResumed
from rosoclingo.ros.goal_statuses import sender_of, status_of

pytestmark = pytest.mark.costly

__all__ = ["terminals"]

# A stock client, which also counts what it is told of its goals.
CLIENT = """
import sys
import threading

import rospy
from actionlib import SimpleActionClient
from actionlib_msgs.msg import GoalStatus
from rosoclingo.msg import ROSoClingoAction, ROSoClingoActionResult, ROSoClingoGoal

heard = set()
both_are_heard = threading.Event()

def on_result(message):
    heard.add(message.status.goal_id.id)
    print("result", GoalStatus.to_string(message.status.status), flush=True)
    if len(heard) == 2:
        both_are_heard.set()

rospy.init_node("client")
rospy.on_shutdown(both_are_heard.set)
rospy.Subscriber("rosoclingo/result", ROSoClingoActionResult, on_result)
client = SimpleActionClient("rosoclingo", ROSoClingoAction)
client.wait_for_server()
client.send_goal(ROSoClingoGoal(sys.argv[1], ["of the client"]))
client.wait_for_result()
print("end", GoalStatus.to_string(client.get_state()), flush=True)
# Another goal, which is reached already: what was sent of the first one comes before its result.
client.send_goal(ROSoClingoGoal(sys.argv[1], []))
if not both_are_heard.wait(60.0) or rospy.is_shutdown():
    sys.exit("the second goal has no result")
"""

# A client that sends one goal after the other until its server has gone, and then those without an
# end again, with their ids, until all have one.
SENDER = """
import time

import rospy
from actionlib_msgs.msg import GoalID
from rosclingo.ros.init import init_node
from rosoclingo.msg import ROSoClingoActionGoal, ROSoClingoActionResult, ROSoClingoGoal

ends = {}

def on_result(message):
    ends.setdefault(message.status.goal_id.id, set()).add(message.result.result)

def send(number):
    identifier = GoalID(rospy.Time.now(), f"goal {number}")
    goals.publish(ROSoClingoActionGoal(goal_id=identifier, goal=ROSoClingoGoal("visit(1)", [])))

init_node("sender")
goals = rospy.Publisher("rosoclingo/goal", ROSoClingoActionGoal, queue_size=1000)
rospy.Subscriber("rosoclingo/result", ROSoClingoActionResult, on_result)
while not goals.get_num_connections():
    time.sleep(0.01)
count = 0
while goals.get_num_connections():
    send(count)
    count += 1
    if count == 10:
        print("sends", flush=True)
    time.sleep(0.03)
before = len(ends)
while len(ends) < count:
    time.sleep(0.3)
    for number in range(count):
        if f"goal {number}" not in ends:
            send(number)
print("went on:", before < count, set().union(*ends.values()), flush=True)
"""

# A robot that takes so many seconds for an action.
ROBOT = """
import sys

from rosoclingo_interfaces.interface import ActionInterface
from rosoclingo_interfaces.node import run

class Robot(ActionInterface):
    actuators = ("robot",)

    def go(self, cell: str) -> bool:
        print("does", cell, flush=True)
        self.sleep(float(sys.argv[1]))
        return True

run(Robot, "robot")
"""


# A client that sends goals, again and again those that have not been acknowledged.
INSISTENT = """
import actionlib  # which gives GoalStatus its to_string
import rospy
from actionlib_msgs.msg import GoalStatus, GoalStatusArray
from rosoclingo.msg import ROSoClingoActionGoal, ROSoClingoActionResult, ROSoClingoGoal

known, ended = set(), {}

def on_status(message):
    known.update(status.goal_id.id for status in message.status_list)

def on_result(message):
    word = GoalStatus.to_string(message.status.status)
    if ended.setdefault(message.status.goal_id.id, word) != word:
        print("another end", word, flush=True)

rospy.init_node("client")
rospy.Subscriber("rosoclingo/status", GoalStatusArray, on_status)
rospy.Subscriber("rosoclingo/result", ROSoClingoActionResult, on_result)
goals = rospy.Publisher("rosoclingo/goal", ROSoClingoActionGoal, queue_size=100)
while len(ended) < 40 and not rospy.is_shutdown():
    for number in range(40):
        if str(number) not in known:
            goal = ROSoClingoGoal("visit(%d)" % (2 + number % 4), ["x" * 999])
            message = ROSoClingoActionGoal(goal=goal)
            message.goal_id.id = str(number)
            goals.publish(message)
    rospy.sleep(0.5)
print("ends", sorted(set(ended.values())), flush=True)
"""


def system(terminals: Terminals, store: Path, form: str, *arguments: str) -> Terminal:
    file = package("rosoclingo") / "example" / "line.lp"
    mode = ["mode:=dynamic.incremental.dyn_reset", "steps:=30"] if form == "rosoclingo" else []
    arguments = (f"encoding:={file}", f"store:={store}/", *mode, *arguments)
    return terminals.start("roslaunch", "rosoclingo", f"{form}.launch", *arguments)


def test_solvers_are_killed_and_restarted(terminals: Terminals, tmp_path: Path) -> None:
    """Also by a request of somebody else's, after which they know nothing, and answer."""
    launch = system(terminals, tmp_path / "my run.store", "rosoclingo")
    robot = terminals.start("python", "-c", ROBOT, "0.5")
    client = terminals.start("python", "-c", CLIENT, "visit(6)")
    for cell, solver in ((2, "planner"), (3, "controller")):
        robot.wait_for(f"does {cell}")
        os.kill(terminals.pid(f"/{solver}"), signal.SIGKILL)
    robot.wait_for("does 4")
    os.kill(robot.process.pid, signal.SIGSTOP)  # so that it still acts when both are restarted
    for solver in ("planner", "controller"):
        terminals.run("rosservice", "call", f"/{solver}/control", "<commands><restart/></commands>")
    os.kill(robot.process.pid, signal.SIGCONT)
    for cell, solver in ((5, "planner"), (6, "controller")):  # which still answer
        robot.wait_for(f"does {cell}")
        os.kill(terminals.pid(f"/{solver}"), signal.SIGTERM)
    client.wait_for("end SUCCEEDED")
    for solver in ("planner", "controller"):
        noticed = rf"/{solver} .*: /rosservice\S+ has restarted it.*gives it its commands again"
        assert re.search(noticed, launch.output)
    assert launch.output.count("gives it its commands again") >= 6
    assert "[rosoclingo-3] process has died" not in launch.output


def cpp_client(folder: Path) -> str:
    """Compiles the client in C++, with what the distribution has for that."""
    file, packages = str(folder / "client"), ("actionlib", "roscpp", "rosoclingo")
    flags = subprocess.check_output(("pkg-config", "--cflags", "--libs", *packages), text=True)
    source = str(Path(__file__).with_name("client.cpp"))
    subprocess.check_call(("g++", source, "-o", file, *flags.split()))
    return file


def test_a_client_in_cpp_waits_through_kills(terminals: Terminals, tmp_path: Path) -> None:
    """Of rosoclingo in one node; one in Python waits in the next test."""
    client_program = cpp_client(tmp_path)
    launch = system(terminals, tmp_path / "my run.store", "single")
    robot = terminals.start("python", "-c", ROBOT, "0.3")
    client = terminals.start(client_program, "visit(5)")
    for cell in (2, 3, 4):
        robot.wait_for(f"does {cell}")
        kill(terminals, "rosoclingo")
    client.wait_for("end SUCCEEDED")
    assert client.wait() == 0
    assert done(robot) == [2, 3, 4, 5]
    assert "Traceback" not in launch.output
    assert (tmp_path / "my run.store").exists()


def done(robot: Terminal) -> List[int]:
    """Returns the cells to which a robot has gone."""
    lines = (line.split() for line in robot.output.splitlines())
    return [int(words[1]) for words in lines if words[:1] == ["does"]]


def kill(terminals: Terminals, node: str) -> None:
    """Kills a node, and waits until there is another one in its place."""
    killed = terminals.pid(f"/{node}")
    os.kill(killed, signal.SIGKILL)
    wait_for(lambda: terminals.names() and _pid(terminals, node) not in (killed, 0))


def _pid(terminals: Terminals, node: str) -> int:
    try:
        return terminals.pid(f"/{node}")
    except OSError:
        return 0


def test_a_run_with_kills_is_recorded_shown_and_replayed(
    terminals: Terminals, tmp_path: Path
) -> None:
    bag, page = tmp_path / "run.bag", tmp_path / "run.html"
    launch = system(terminals, tmp_path / "my run.store", "rosoclingo", f"record:={bag}")
    launch.wait_for("recording /rosoclingo in")
    robot = terminals.start("python", "-c", ROBOT, "0.3")
    client = terminals.start("python", "-c", CLIENT, "visit(6)")
    killed = ["rosoclingo", "planner", "rosoclingo", "controller"]
    for cell, node in enumerate(killed, 2):
        robot.wait_for(f"does {cell}")
        kill(terminals, node)
    assert client.wait() == 0, client.output
    assert "end SUCCEEDED" in client.output
    assert client.output.count("result") == 2  # one for each goal
    assert done(robot) == [2, 3, 4, 5, 6]
    launch.interrupt()
    launch.wait()
    assert "Traceback" not in launch.output

    recording = read_recording(bag)
    events = [entry.event for entry in recording.entries]
    assert [event.node for event in events if isinstance(event, NodeResumed)] == killed
    assert recording.remarks == ()
    answers = [event for event in events if isinstance(event, MessageArrived)]
    assert len(answers) == 5
    shown = terminals.run("rosrun", "rosoclingo", "report.py", str(bag), "-o", str(page))
    assert shown.wait() == 0, shown.output
    assert '["restarts","4"' in page.read_text(encoding="utf-8")
    for options, said in (
        ((), ""),
        (("--kill",), "killed and started again, as in the recording: 4"),
    ):
        replay = terminals.run("rosrun", "rosoclingo", "replay.py", str(bag), *options)
        assert replay.wait() == 0, replay.output
        assert "no difference at level exact: 2 goals, 5 steps" in replay.output
        assert said in replay.output
        assert "Traceback" not in replay.output


def test_an_answer_given_while_a_killed_loop_resumes_is_taken_once(
    terminals: Terminals, tmp_path: Path
) -> None:
    """The robot sends it with its token and without, before the solvers answer again."""
    system(terminals, tmp_path / "my run.store", "rosoclingo")
    robot = terminals.start("python", "-c", ROBOT, "0.3")
    client = terminals.start("python", "-c", CLIENT, "visit(3)")
    robot.wait_for("does 2")
    solvers = [terminals.pid(f"/{name}") for name in ("planner", "controller")]
    sent = [terminals.listen("/robot", f"/rosoclingo/{topic}") for topic in ("in", "answer")]
    os.kill(robot.process.pid, signal.SIGSTOP)
    for pid in solvers:
        os.kill(pid, signal.SIGSTOP)
    try:
        kill(terminals, "rosoclingo")
        os.kill(robot.process.pid, signal.SIGCONT)
        for listener in sent:
            listener.wait_for("success")
    finally:
        for pid in solvers:
            os.kill(pid, signal.SIGCONT)
    assert client.wait() == 0, client.output
    journal = terminals.listen("/rosoclingo", "/rosoclingo/journal")  # its history has all events
    wait_for(lambda: journal.output.count('text: "succeeded"') == 2, lambda: journal.output)
    assert journal.output.count('kind: "message"') == 2  # one for each cell


def test_deaths_after_an_operator_has_let_go_are_replayed(
    terminals: Terminals, tmp_path: Path
) -> None:
    """Nodes die while a robot does what was approved; the controller also as rosoclingo is back."""
    bag = tmp_path / "run.bag"
    launch = system(
        terminals, tmp_path / "my run.store", "rosoclingo", f"record:={bag}", "ask_before:=go(*)"
    )
    launch.wait_for("recording /rosoclingo in")
    robot = terminals.start("python", "-c", ROBOT, "1")
    client = terminals.start("python", "-c", CLIENT, "visit(4)")

    def approves(cell: int) -> bool:
        request = f"{{actuator: robot, action: 'go({cell})', token: 0}}"
        call = terminals.run("rosservice", "call", "/rosoclingo/approve", request)
        return call.wait() == 0 and "success: True" in call.output

    for cell, nodes in (
        (2, ["rosoclingo"]),
        (3, ["controller", "rosoclingo", "controller"]),
        (4, ["rosoclingo", "rosoclingo", "planner"]),
    ):
        wait_for(partial(approves, cell))
        robot.wait_for(f"does {cell}")
        for node in nodes:
            kill(terminals, node)
    assert client.wait() == 0, client.output
    launch.interrupt()
    launch.wait()
    assert done(robot) == [2, 3, 4]
    lives = [one.event for one in read_recording(bag).entries if isinstance(one.event, NodeResumed)]
    assert len([event for event in lives if event.node == "rosoclingo"]) >= 3
    for options in ((), ("--kill",)):
        replay = terminals.run("rosrun", "rosoclingo", "replay.py", str(bag), *options)
        assert replay.wait() == 0, replay.output
        assert "no difference at level exact: 2 goals, 3 steps" in replay.output
        assert "Traceback" not in replay.output


def test_goals_that_come_while_a_launch_is_ended(terminals: Terminals, tmp_path: Path) -> None:
    """They are kept, or were never there: no goal has another end than the one of its work."""
    launch = system(terminals, tmp_path / "my run.store", "single")
    sender = terminals.start("python", "-c", SENDER)
    sender.wait_for("sends")
    launch.interrupt()
    assert launch.wait() == 0
    again = system(terminals, tmp_path / "my run.store", "single")
    sender.wait_for("went on: True {'succeeded'}")
    assert "Traceback" not in launch.output + again.output


def test_another_master(terminals: Terminals, tmp_path: Path) -> None:
    """All nodes notice, are started again with the parameters that they had, and go on.

    But for ``~resume``: the run that was to begin anew has begun.
    """
    launch = system(terminals, tmp_path / "my run.store", "rosoclingo", "resume:=fresh")
    # An interface of another robot, which has its store by a parameter.
    store = tmp_path / "hand.store"
    interface = terminals.start(
        "roslaunch", "rosoclingo_interfaces", "mailbot_interfaces.launch", "navigation:=none",
        f"store:={store}/",
    )  # fmt: skip
    robot = terminals.start("python", "-c", ROBOT, "60")
    terminals.start("python", "-c", CLIENT, "visit(3)")
    robot.wait_for("does 2")
    said = f"parameter /pickup_deliver/store is {store}.pickup_deliver"
    wait_for(lambda: said in interface.output)
    terminals.restart_master()
    assert robot.wait() == 3
    assert "does not know /robot any more" in robot.output
    launch.wait_for("goes on with the run in the store")
    echo = terminals.listen("/rosoclingo", "/rosoclingo/result")
    terminals.start("python", "-c", ROBOT, "0.1")
    echo.wait_for("succeeded")
    wait_for(lambda: interface.output.count(said) == 2)
    assert "Traceback" not in launch.output + interface.output


def test_what_cannot_begin_is_not_started_again_and_again(
    terminals: Terminals, tmp_path: Path
) -> None:
    task, store = tmp_path / "task.lp", tmp_path / "my run.store"
    task.write_text("a(X).")
    words = ("roslaunch", "rosoclingo", "rosoclingo.launch", f"encoding:={task}",
             f"store:={store}", "mode:=dynamic.incremental.dyn_reset")  # fmt: skip
    launch = terminals.start(*words)
    launch.wait_for("this node is started again in 30 s")
    (process,) = re.findall(r"at once by: kill (\d+)", launch.output)
    task.write_text((package("rosoclingo") / "example" / "line.lp").read_text())
    os.kill(int(process), signal.SIGTERM)
    launch.wait_for("/planner is ready with")
    robot = terminals.start("python", "-c", ROBOT, "0")
    terminals.start("python", "-c", CLIENT, "visit(2)").wait_for("end SUCCEEDED")
    launch.interrupt()
    launch.wait()
    assert launch.output.count("this node is started again") == 1
    # A store of something else is no reason to start again and again, either.
    launch = terminals.start(*words, "steps:=30")
    launch.wait_for("this node is started again in 30 s")
    assert "is of a run with something else" in launch.output
    launch.interrupt()
    assert launch.wait() == 0
    assert launch.output.count("this node is started again") == 1
    assert "Traceback" not in launch.output + robot.output


def test_a_full_disk(terminals: Terminals, tmp_path: Path) -> None:
    """A goal that cannot be written is not acknowledged, and has no end, until there is room.

    What a file of the process may have stands for what the disk has.
    """
    file, store = package("rosoclingo") / "example" / "line_1.0.lp", tmp_path / "my run.store"
    node = ("rosrun", "rosoclingo", "run-1.0.py", "-f", str(file), f"_store:={store}",
            "__name:=rosoclingo")  # fmt: skip
    terminals.start("python", "-c", ROBOT, "0")
    client = terminals.start("python", "-c", INSISTENT)
    limited = ("bash", "-c", 'ulimit -f 150 && exec "$@"', "bash", *terminals.without_rosrun(node))
    full = terminals.start(*limited)
    assert full.wait() == 1
    assert "cannot be written: disk I/O error; the disk fails, or a quota or limit" in full.output
    assert "Traceback" not in full.output
    assert "ends" not in client.output
    terminals.start(*node)
    assert client.wait() == 0
    assert client.output.splitlines()[-1] == "ends ['SUCCEEDED']"
    assert "another end" not in client.output


@pytest.mark.parametrize("address", ["[", "7", "[1,2]", '["a",-5,0]', '["a",1e999,0]', "[" * 9999])
def test_an_address_that_this_version_does_not_write(address: str) -> None:
    known = KnownGoal("g", "visit(1)", address=address)
    for read in (sender_of, status_of):
        with pytest.raises(StoreError, match=r"the goal g with an address .*resume:=fresh"):
            read(known)
