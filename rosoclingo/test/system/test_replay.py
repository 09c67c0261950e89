"""Recording runs and replaying them, as processes.

Needs a sourced workspace, in devel or install space.
"""

from __future__ import annotations

import shutil
import signal
import struct
import time
from itertools import permutations
from operator import itemgetter
from pathlib import Path
from typing import Any, Callable, Dict, List, Mapping, Optional, Sequence
from xml.etree import ElementTree

import pytest
from readmes import ROOT, check_output
from rosbags.rosbag1 import Reader, Writer
from terminals import Terminal, Terminals, package, terminals, wait_for

from rosoclingo.bags.read.reader import read_recording
from rosoclingo.bags.topics import LOOP_TYPES
from rosoclingo.errors import BagError
from rosoclingo.loop.journal import (
    ActionPublished,
    ActionRetried,
    CommandDone,
    Control,
    ControlArrived,
    Ended,
    GoalArrived,
    LoopWaits,
    MessageArrived,
    SearchEnded,
    Status,
    StatusSet,
)

__all__ = ["terminals"]

BAGS = ROOT / "test" / "bags"
RECORDING = "dynamic.incremental.recording"
HEARD = ("goal", "cancel", "in", "answer")  # by the loop; it publishes the others
TOPICS = {ActionPublished: "out", GoalArrived: "goal", MessageArrived: "in"}
KIND = b"\x07\0\0\0message"  # of a journal's event, as it is on the wire
EVENT = struct.Struct("<III")  # how it begins: the time and the number

# A robot and its client. Each has a part of its own: how the robot acts, and which goals are sent.
DRIVER = """
import os, random, signal, sys, threading, time, rospy
from actionlib import CommState
from rosclingo.ros.init import init_node
from rosclingo.ros.action_client import LowLatencyActionClient
from rosoclingo.msg import (
    ROSoClingoAction, ROSoClingoEvent, ROSoClingoGoal, ROSoClingoIn, ROSoClingoOut
)

init_node("driver")
answers = rospy.Publisher("rosoclingo/in", ROSoClingoIn, tcp_nodelay=True, queue_size=100)
waits = threading.Event()
rospy.Subscriber(
    "rosoclingo/journal", ROSoClingoEvent, lambda event: event.kind == "waiting" and waits.set()
)
{robot}
actions = rospy.Subscriber("rosoclingo/out", ROSoClingoOut, act, tcp_nodelay=True)
client = LowLatencyActionClient("rosoclingo", ROSoClingoAction)
client.wait_for_server()
heard = [answers, client.pub_goal, client.pub_cancel]  # by the node and the recorder
while min(topic.get_num_connections() for topic in heard) < 2 or not actions.get_num_connections():
    rospy.sleep(0.01)

def send(request):
    ended = threading.Event()
    def watch(handle):
        if handle.get_comm_state() == CommState.DONE:
            ended.set()
    return client.send_goal(ROSoClingoGoal(request, []), watch), ended

{client}
"""

# The robot answers each action; the answers that are named by their number are failures. The first
# goals are sent when the loop waits for some, so that none is in step 0. The goals of an argument
# are sent together, when the ones before have ended: no planner, if there is one, goes on before
# all have come.
IN_ORDER = {
    "robot": """
failures, groups = eval(sys.argv[1]), sys.argv[2:]
count = 0
def act(message):
    global count
    count += 1
    answers.publish(message.id, "failure" if count in failures else "success")
""",
    "client": """
assert waits.wait(50.0)
planner = rospy.get_param("/test_planner", 0)
for group in groups:
    if planner:
        os.kill(planner, signal.SIGSTOP)
    goals = [send(request) for request in group.split()]
    while any(handle.get_comm_state() == CommState.WAITING_FOR_GOAL_ACK for handle, _ in goals):
        rospy.sleep(0.01)
    if planner:
        os.kill(planner, signal.SIGCONT)
    assert all(ended.wait(50.0) for handle, ended in goals)
""",
}

# The same with time in between, as a robot needs it, so that a recorder has all in order.
SLOWLY = {
    "robot": IN_ORDER["robot"]
    .replace("answers.publish(", "threading.Timer(0.3, answers.publish, (")
    .replace('"success")', '"success")).start()'),
    "client": IN_ORDER["client"] + "    time.sleep(0.3)\n",
}

# Time passes when the loop has taken all answers, and waits: ten jobs take 1 s, and one takes 10 s.
AT_THEIR_PACE = {
    "robot": """
import heapq

clock, sent, taken, due = 0.0, 0, 0, []
def hear(event):
    global clock, sent, taken
    if event.kind == "action":
        heapq.heappush(due, (clock + (10.0 if "bake" in event.text else 1.0), event.id))
    elif event.kind == "message":
        taken += 1
    elif event.kind == "waiting" and taken == sent and due:
        clock = due[0][0]
        while due and due[0][0] == clock:
            sent += 1
            answers.publish(heapq.heappop(due)[1], "success")
def act(message):
    pass
heard_all = rospy.Subscriber("rosoclingo/journal", ROSoClingoEvent, hear, tcp_nodelay=True)
groups = sys.argv[2:]
""",
    "client": IN_ORDER["client"] + "assert sent == 11 and clock <= 10.5, (sent, clock)\n",
}

# Everything comes at random, while the loop works or not.
AT_RANDOM = {
    "robot": """
chance = random.Random(sys.argv[1])
def later(action):
    threading.Timer(chance.choice([0.0, 0.0, 0.02]) * chance.random(), action).start()
def act(message):
    later(lambda: answers.publish(message.id, chance.choice(["success"] * 9 + ["failure"])))
""",
    "client": """
goals = []
for number in range(15):
    goals.append(send(chance.choice(["visit(1)", "visit(3)", "visit(6)", "visit(99)", "visit("])))
    if chance.random() < 0.3:
        later(goals[-1][0].cancel)
    if chance.random() < 0.3:
        answers.publish(*chance.choice([("info", "hello"), ("robot", "success"), ("robot", "b(")]))
    time.sleep(chance.choice([0.0, 0.02, 0.1]) * chance.random())
assert all(ended.wait(50.0) for handle, ended in goals)
""",
}


# An operator is at work as well, at random; in the end, all that waits is let go.
OPERATED = {
    "robot": AT_RANDOM["robot"],
    "client": """
from std_srvs.srv import Trigger
from rosoclingo.srv import ControlActuator
words = ["pause", "step", "resume", "halt"]
call = {word: rospy.ServiceProxy("rosoclingo/" + word, Trigger) for word in words}
ask = {word: rospy.ServiceProxy("rosoclingo/" + word, ControlActuator)
       for word in ("hold", "release", "approve", "reject")}
goals = []
for number in range(12):
    goals.append(send(chance.choice(["visit(1)", "visit(3)", "visit(6)", "visit(99)"])))
    said = call[chance.choice(["pause", "pause", "step", "resume"])]()
    assert said.success and said.message.startswith(("paused", "running")), said
    word = chance.choice(["hold", "release", "approve", "reject"])
    said = ask[word](actuator="robot")
    assert said.success or "no action of robot is held" in said.message, said
    time.sleep(chance.choice([0.0, 0.02, 0.1]) * chance.random())
assert call["halt"]().success
assert not ask["hold"]().success and not ask["release"](actuator="no term(").success
assert not ask["approve"](actuator="robot", action="dance").success
assert ask["release"](actuator="robot").message.startswith("paused")
assert call["resume"]().message.startswith("running")
end = time.time() + 50.0
while not all(ended.wait(0.02) for handle, ended in goals):
    assert time.time() < end
    ask["approve"]()
""",
}

# The paper's third scenario, and an operator: pauses at random moments, and resumes; or approves
# each action, and sees that nothing is published before.
SCENARIO_3 = {
    "robot": """
done = []
def act(message):
    done.append(message.action)
    if len(done) == 1:
        goals.append(send("bring(o2,o3)"))
        while goals[-1][0].get_comm_state() == CommState.WAITING_FOR_GOAL_ACK:
            rospy.sleep(0.01)
    answers.publish(message.id, "failure" if len(done) == 3 else "success")
""",
    "client": """
from std_srvs.srv import Trigger
from rosoclingo.msg import ROSoClingoHeld
from rosoclingo.srv import ControlActuator
assert waits.wait(50.0)
chance = random.Random(int(sys.argv[2]))
approved = []
def approve(message):
    if "approval" in message.reasons and message.held not in approved[-1:]:  # said once more
        assert len(done) == len(approved), (done, approved)
        approved.append(message.held)
        threading.Thread(target=ask).start()
ask = rospy.ServiceProxy("rosoclingo/approve", ControlActuator)
rospy.Subscriber("rosoclingo/held", ROSoClingoHeld, approve, tcp_nodelay=True)
pause, resume = (rospy.ServiceProxy("rosoclingo/" + word, Trigger) for word in ("pause", "resume"))
goals = []
goals.append(send("bring(o7,o11)"))
for number in range(10):
    time.sleep(0.1 * chance.random())
    assert pause().message.startswith("paused")
    rospy.sleep(0.05 * chance.random())
    assert resume().message.startswith("running")
wait_for_end = [ended.wait(50.0) for handle, ended in goals]
assert len(goals) == 2 and all(wait_for_end)
assert done == sys.argv[3].split(), done
""",
}


def line() -> str:
    return str(package("rosoclingo") / "example" / "line.lp")


class Recorder:
    """Runs systems and records them."""

    def __init__(self, terminals: Terminals, folder: Path) -> None:
        self._terminals = terminals
        self._folder = folder

    def record(
        self,
        groups: Sequence[str],
        encodings: Sequence[str] = (),
        mode: str = RECORDING,
        failures: Sequence[int] = (),
        single: Sequence[str] = (),
        *,
        name: str = "run.bag",
        driver: Mapping[str, str] = IN_ORDER,
        planner: Sequence[str] = (),
        parameters: Sequence[str] = (),
        steps: int = 20,
    ) -> Path:
        """Runs a system until its goals have ended, or until it has published its plan."""
        start, bag = self._terminals.start, self._folder / name
        if single:
            nodes = [start("rosrun", "rosoclingo", "run-1.0.py", *single)]
        else:
            path = str(package("rosoclingo") / "modes" / f"{mode}.lp")
            nodes = [
                start("rosrun", "rosclingo", "run.py", "__name:=controller", "-f", path,
                      "-c", f"steps={steps}"),
                start("rosrun", "rosclingo", "run.py", "__name:=planner", *planner,
                      *(part for file in encodings for part in ("-f", file))),
                start("rosrun", "rosoclingo", "run.py", *parameters),
            ]  # fmt: skip
        recorder = start("rosrun", "rosoclingo", "record.py", "-o", str(bag), "__name:=recorder")
        recorder.wait_for("recording /rosoclingo")
        published = [f"/rosoclingo/{topic}" for topic in LOOP_TYPES if topic not in HEARD]
        self._terminals.wait_until_hears("/recorder", *published)
        if groups:
            if not single:
                pid = self._terminals.pid("/planner")
                self._terminals.master.setParam("/test", "/test_planner", pid)
            script = DRIVER.format(**driver)
            ended = start("python", "-c", script, repr(list(failures)), *groups)
            assert ended.wait() == 0, ended.output
        else:
            nodes[-1].wait_for("solver: [do(")
        # What the bag holds is older than the file by up to half a second.
        end = time.time() + 1.0
        wait_for(lambda: bag.stat().st_mtime > end and is_through(bag))
        for node in (recorder, *reversed(nodes)):
            node.interrupt()
            assert node.wait() == 0, node.output
        return bag


def is_through(bag: Path) -> bool:
    """Whether a bag that is being written says what all nodes are, and that the loop rests."""
    try:
        recording = read_recording(bag)
    except BagError:
        return False
    loop = recording.programs.get("/rosoclingo")
    events = [entry.event for entry in recording.entries]
    last = [event for event in events if isinstance(event, (CommandDone, LoopWaits))][-1]
    rests = isinstance(last, LoopWaits) or last.publishes
    statuses = [event for event in events if isinstance(event, StatusSet)]
    ended = {event.goal for event in statuses if event.status is not Status.ACCEPTED}
    all_ended = all(event.goal in ended for event in events if isinstance(event, GoalArrived))
    knows_nodes = loop is not None and {*loop.solvers.values()} <= set(recording.programs)
    return rests and all_ended and knows_nodes


@pytest.fixture
def recorder(terminals: Terminals, tmp_path: Path) -> Recorder:
    return Recorder(terminals, tmp_path)


def replay(terminals: Terminals, bag: Path, *options: str) -> Terminal:
    ended = terminals.run("rosrun", "rosoclingo", "replay.py", str(bag), *options)
    assert "Traceback" not in ended.output, ended.output
    return ended


def replays_exactly(terminals: Terminals, bag: Path, *options: str, said: str) -> None:
    """Replays a bag without a difference."""
    ended = replay(terminals, bag, *options)
    assert ended.wait() == 0, ended.output
    assert f"no difference at level exact{said}" in ended.output


def copy(bag: Path, name: str, change: Callable[[str, bytes], Optional[bytes]]) -> Path:
    """Copies messages, changed by their topic and bytes; None leaves one out."""
    changed = bag.with_name(name)
    connections: Dict[int, Any] = {}
    with Reader(bag) as reader, Writer(changed) as writer:
        for one, time, data in reader.messages():
            new = change(one.topic, bytes(data))
            if new is not None:
                if one.id not in connections:
                    connections[one.id] = writer.add_connection(
                        one.topic, one.msgtype, msgdef=one.msgdef.data, md5sum=one.digest
                    )
                writer.write(connections[one.id], time, new)
    return changed


def of_an_old_system(bag: Path) -> Path:
    """Copies what a system without a journal has, as if no recorder could be late.

    On a busy machine, a message may reach the recorder after what the loop has made of it: each has
    the time at which the loop has taken or sent it.
    """
    times: Dict[str, List[int]] = {"goal": [], "in": [], "out": [], "result": []}
    for entry in read_recording(bag).entries:
        event, nanoseconds = entry.event, round(entry.seconds * 1e9)
        if isinstance(event, StatusSet) and event.status is not Status.ACCEPTED:
            times["result"].append(nanoseconds)
        elif type(event) in TOPICS:
            times[TOPICS[type(event)]].append(nanoseconds)
    old = bag.with_name("old.bag")
    with Reader(bag) as reader, Writer(old) as writer:
        connections, messages = {}, []
        for one, time_of_arrival, data in reader.messages():
            topic = one.topic.rpartition("/")[2]
            if topic in ("journal", "about"):
                continue
            if one.id not in connections:
                connections[one.id] = writer.add_connection(
                    one.topic, one.msgtype, msgdef=one.msgdef.data, md5sum=one.digest
                )
            is_of_loop = one.topic.startswith("/rosoclingo/") and topic in times
            sent = reader.start_time + times[topic].pop(0) if is_of_loop else time_of_arrival
            messages.append((sent, connections[one.id], bytes(data)))
        for sent, connection, data in sorted(messages, key=itemgetter(0)):
            writer.write(connection, sent, data)
    assert not any(times.values()), times
    return old


def without(bag: Path, dropped: int, gap: int = 0) -> Path:
    """Copies a bag without one of the answers of the journal, counted from 1.

    The events after it have the next numbers, or those that leave a gap.
    """
    answers = 0

    def change(topic: str, data: bytes) -> Optional[bytes]:
        nonlocal answers
        if topic != "/rosoclingo/journal":
            return data
        is_answer = KIND in data
        answers += is_answer
        if answers < dropped:
            return data
        if is_answer and answers == dropped:
            return None
        seconds, nanoseconds, number = EVENT.unpack_from(data)
        return EVENT.pack(seconds, nanoseconds, number - 1 + gap) + data[EVENT.size :]

    changed = copy(bag, f"without_{dropped}_{gap}.bag", change)
    assert answers >= dropped
    return changed


@pytest.mark.install_space
def test_a_bag_of_the_repository(terminals: Terminals, tmp_path: Path) -> None:
    """It is the same as itself when it is replayed, and when it is compared."""
    bag = BAGS / "line_single_2.0.bag"
    ended = replay(terminals, bag)
    assert ended.wait() == 0, ended.output
    for other, status, text in (
        (bag, 0, "no difference at level exact: "),
        (tmp_path / "none.bag", 2, "No such file"),
    ):
        ended = terminals.run("rosrun", "rosoclingo", "compare.py", str(bag), str(other))
        assert ended.wait() == status, ended.output
        assert text in ended.output
        assert "Traceback" not in ended.output


@pytest.mark.costly
def test_compares_what_was_recorded(
    terminals: Terminals, recorder: Recorder, tmp_path: Path
) -> None:
    """In one node. The goals have other ids in each run."""
    goals = ["visit(3)", "visit(5)", "visit(1)"]  # one after the other: two would race
    names = ("a.bag", "b.bag", "c.bag")
    for name, failures in zip(names, ([2], [2], [])):
        recorder.record(goals, single=["-f", line()], failures=failures, name=name)
    for name, status, texts in (
        ("b.bag", 0, ["no difference at level exact: 3 goals"]),
        ("c.bag", 1, ["<- first divergence",
                      "message robot: failure: expected in step 2, not seen"]),
    ):  # fmt: skip
        files = (str(tmp_path / "a.bag"), str(tmp_path / name))
        ended = terminals.run("rosrun", "rosoclingo", "compare.py", *files)
        assert ended.wait() == status, ended.output
        assert all(text in ended.output for text in texts), ended.output
        assert "Traceback" not in ended.output


@pytest.mark.costly
def test_a_mode_that_resets(terminals: Terminals, recorder: Recorder, tmp_path: Path) -> None:
    """The two other incremental modes are those of the tests around this one.

    A goal that cannot be reached ends alone, in the replay, too, as the bag has the parameter.
    """
    mode = "dynamic.incremental.reset"
    island = tmp_path / "island.lp"
    island.write_text("#program transition(t). :- do(robot,go(5),t).")
    bag = recorder.record(
        ["visit(3) visit(2)", "visit(5)", "visit(1)"], [line(), str(island)], mode,
        failures=[1, 4], parameters=["_abort_unreachable:=true"],
    )  # fmt: skip
    replays_exactly(terminals, bag, said=": 4 goals")
    program = read_recording(bag).programs["/rosoclingo"]
    assert program.parameters == {
        "abort_unreachable": True, "patience": -1.0, "one_by_one_seconds": 2.0,
        "ask_before": [], "ask_again": 60.0, "policies": {},
    }  # fmt: skip


@pytest.mark.costly
def test_steps_without_a_barrier(terminals: Terminals, recorder: Recorder) -> None:
    """Nobody waits for the slowest, and each answer is in the replay in the step it was in."""
    workshop = package("rosoclingo_aspprograms") / "workshop"
    files = [str(workshop / "instances" / "furniture.lp"), str(workshop / "workshop.lp")]
    bag = recorder.record(["make(box)"], files, driver=AT_THEIR_PACE)
    actions = [e.event for e in read_recording(bag).entries if isinstance(e.event, ActionPublished)]
    assert [action.action for action in actions].count("work(1,bake)") == 1
    replays_exactly(terminals, bag, said=": 1 goal")


# Each action lasts until the loop waits, and the first ones a while more, in which it looks for a
# better plan.
DRIVING = {
    "robot": """

acting = []
seconds = [0.3, 0.3, 0.3]
def hear(event):
    if event.kind == "action":
        acting.append(event.id)
    elif event.kind == "waiting" and acting:
        last = seconds.pop() if seconds else 0.0
        threading.Timer(last, answers.publish, (acting.pop(0), "success")).start()
def act(message):
    pass
heard_all = rospy.Subscriber("rosoclingo/journal", ROSoClingoEvent, hear, tcp_nodelay=True)
groups = sys.argv[2:]
""",
    "client": IN_ORDER["client"],
}


@pytest.mark.costly
@pytest.mark.parametrize("nodes", ["three", "one"])
def test_a_better_plan(terminals: Terminals, recorder: Recorder, nodes: str) -> None:
    """What was found in time, and what was found later, is in the replay what it was."""
    mailbot = package("rosoclingo_aspprograms") / "mailbot"
    files = [str(mailbot / "instances" / "graph_hall.lp"), str(mailbot / "mailbot.lp")]
    patience, slots = "_patience:=0.001", ["-c", "slots=12"]
    single = [patience, *(part for file in files for part in ("-f", file)), *slots]
    requests = " ".join(f"bring({a},{b})" for a, b in permutations("abcd", 2))
    bag = recorder.record(
        [requests], files, steps=99, single=single if nodes == "one" else (), driver=DRIVING,
        planner=slots, parameters=[patience],
    )  # fmt: skip
    recorded = [entry.event for entry in read_recording(bag).entries]
    ways = {event.how for event in recorded if isinstance(event, SearchEnded)}
    assert ways & {Ended.BETTER, Ended.AS_BEFORE, Ended.CHOSEN}
    replays_exactly(terminals, bag, said=": 12 goals")


@pytest.mark.costly
def test_an_operator(terminals: Terminals, recorder: Recorder) -> None:
    """No action begins in a pause, and what was held is in the replay held as long."""
    ask = "_ask_before:=go(3) nothing(*)"
    bag = recorder.record(
        ["1"],
        [line()],
        driver=OPERATED,
        parameters=[ask, "_ask_again:=0.1"],
        failures=[7],
        steps=60,
    )
    recording = read_recording(bag)
    assert any(one.paused for _, one in recording.held)
    assert "approval" in {reason for _, one in recording.held for _, _, reason in one.held}
    is_paused = steps = False
    for event in (entry.event for entry in recording.entries):
        if isinstance(event, ControlArrived):
            is_paused |= event.control in (Control.PAUSE, Control.HALT, Control.STEP)
            is_paused &= event.control is not Control.RESUME
            steps = event.control is Control.STEP or (steps and bool(event.actuator))
        elif isinstance(event, ActionPublished):
            assert steps or not is_paused, event
            steps = False
    replays_exactly(terminals, bag, said=": 12 goals")


OFFICE = "c6 c5 c4 c6 open1 c1 c2 o2 + c2 c1 o3 - c1 c2 c3 c4 o7 + c4 o11 -"
THERE = {"+": ["pickup(2)", "pickup(1)"], "-": ["deliver(2)", "deliver(1)"]}


@pytest.mark.costly
@pytest.mark.parametrize(("nodes", "ask"), [("one", " "), ("three", "do(mailbot,*)")])
def test_pauses_in_the_third_scenario(
    terminals: Terminals, recorder: Recorder, nodes: str, ask: str
) -> None:
    """No action begins in a pause, or without approval; the route is that without an operator."""
    mailbot = package("rosoclingo_aspprograms") / "mailbot"
    files = [str(mailbot / "instances" / "graph_wg.lp"), str(mailbot / "mailbot.lp")]
    parameters = [f"_ask_before:={ask}"] if ask.strip() else []
    there = {word: iter(actions) for word, actions in THERE.items()}
    route = [next(there[one]) if one in there else f"go({one})" for one in OFFICE.split()]
    single = [*parameters, *(part for file in files for part in ("-f", file))]
    bag = recorder.record(
        [str(len(nodes)), " ".join(route)], files, steps=99, driver=SCENARIO_3,
        single=single if nodes == "one" else (), parameters=parameters,
    )  # fmt: skip
    is_paused = False
    pauses = 0
    for event in (entry.event for entry in read_recording(bag).entries):
        if isinstance(event, ControlArrived):
            pauses += event.control is Control.PAUSE
            is_paused |= event.control is Control.PAUSE
            is_paused &= event.control is not Control.RESUME
        assert not (is_paused and isinstance(event, ActionPublished)), event
    assert pauses == 10
    replays_exactly(terminals, bag, said=": 2 goals")


@pytest.mark.costly
def test_retries(terminals: Terminals, recorder: Recorder) -> None:
    """Two failures are one success for the planner, and pauses end where they have ended."""
    policies = "_policies:={'go(*)': {retries: 2, pause: 0.2}}"
    failures = [1, 2, 4]
    bag = recorder.record(["visit(3)"], [line()], parameters=[policies], failures=failures)
    events = [entry.event for entry in read_recording(bag).entries]
    assert [one.retry for one in events if isinstance(one, ActionRetried)] == [1, 2, 1]
    replays_exactly(terminals, bag, said=": 1 goal, 2 steps")


@pytest.mark.costly
def test_a_static_mode(terminals: Terminals, recorder: Recorder) -> None:
    example = package("rosoclingo") / "example"
    blocks = [str(example / file) for file in ("instance.lp", "itoh.lp")]
    bag = recorder.record([], blocks, "static.fixed.recording")
    assert replay(terminals, bag).wait() == 0
    instance = package("rosclingo") / "example" / "instance.lp"
    other = bag.with_name("other.lp")
    other.write_text(instance.read_text().replace("goal(on(1,c)).", "goal(on(1,b))."))
    ended = replay(terminals, bag, "--planner", f"-f {other} -f {blocks[1]}")
    assert ended.wait() == 1, ended.output
    assert "published: [do(arm,pickup(4)," in ended.output
    assert "<- first divergence" in ended.output


def divergence(ended: Terminal) -> List[str]:
    """Returns the words of the line at which a replay went another way."""
    assert ended.wait() == 1, ended.output
    (first,) = (text for text in ended.output.splitlines() if "<- first divergence" in text)
    mark, *words = first.partition("<-")[0].split()
    assert mark == ">>"
    return words


@pytest.mark.costly
def test_a_goal_that_is_out_of_reach(terminals: Terminals, tmp_path: Path) -> None:
    """The loop looks for a plan with one horizon after the other, without end: that is said."""
    encoding = tmp_path / "line.lp"
    tail = "#program transition(t). :- do(robot,_,t), t>1.\n"
    encoding.write_text(Path(line()).read_text() + tail)
    bag = BAGS / "line_single_2.0.bag"
    ended = replay(terminals, bag, "--single", f"-f {encoding}", "--timeout", "5")
    assert ended.wait() == 1, ended.output
    assert "there was nothing but searches for 5 s (--timeout)" in ended.output
    assert "Traceback" not in ended.output


@pytest.mark.costly
def test_differences(terminals: Terminals, recorder: Recorder, tmp_path: Path) -> None:
    """There are none without a change; each change is found, in the step where it shows."""
    bag, results = recorder.record(["visit(3) visit(2)"], [line()]), tmp_path / "results.xml"
    launch = f"rosoclingo rosoclingo.launch mode:={RECORDING} steps:=20 encoding:={line()}"
    for options in (
        ("--files", "disk", "--junit", str(results)),
        ("--level", "equivalent", "--system", launch),
    ):
        ended = replay(terminals, bag, *options)
        assert ended.wait() == 0, ended.output
        assert "no difference" in ended.output
    suite = ElementTree.parse(results).getroot()
    assert (suite.get("tests"), suite.get("failures")) == ("3", "0")

    changed = tmp_path / "line.lp"
    changed.write_text(Path(line()).read_text() + "#program transition(t). :- do(robot,_,t), t=3.")
    ended = replay(terminals, bag, "--planner", f"-f {changed}")
    assert divergence(ended) == ["3/4", "robot:", "go(3)", "robot:", "go(3)"]  # a step later
    check_output("docs/bags.md", "replay.py", ended.output)

    mode = package("rosoclingo") / "modes" / "dynamic.incremental.dyn_reset.lp"
    ended = replay(terminals, bag, "--controller", f"-f {mode} -c steps=20")
    # The end of the second goal begins with step 0 anew.
    assert divergence(ended) == ["3/1", "robot:", "go(3)", "robot:", "go(3)"]

    ended = replay(terminals, bag, "--planner", f"-f {line()} -c slots=1")
    assert divergence(ended) == ["1", "goal", "2", "visit(2):", "accepted", "-"]
    assert "steps with actions: expected 2, seen 3" in ended.output

    ended = replay(terminals, without(bag, dropped=1))
    waits = "! the replay waits for an answer of robot, and nothing is to be sent"
    succeeded = ["goal", "2", "visit(2):", "succeeded"]
    assert divergence(ended) == ["2", *succeeded, *succeeded]
    lines = ended.output.splitlines()
    (place,) = (number for number, text in enumerate(lines) if "<- first divergence" in text)
    assert lines[place - 1].strip() == waits


@pytest.mark.costly
@pytest.mark.parametrize("system", ["single", "dyn_reset"])
def test_what_comes_while_the_loop_works(
    terminals: Terminals, recorder: Recorder, system: str
) -> None:
    """With one slot, plans are unique, so that it does not show how far a cut off search was."""
    slot = ("-c", "slots=1")
    if system == "single":
        bag = recorder.record(["goals"], single=["-f", line(), *slot], driver=AT_RANDOM)
    else:
        mode = f"dynamic.incremental.{system}"
        bag = recorder.record(["goals"], [line()], mode, driver=AT_RANDOM, planner=slot, steps=200)
    replays_exactly(terminals, bag, said="")


PACKAGE = "<package format='3'><name>robots</name><version>1.0.0</version></package>"
LAUNCH = """
<launch>
  <test test-name="run" pkg="rosoclingo" type="replay.py"
        args="$(find robots)/test/run.bag {options}"/>
</launch>
"""


@pytest.mark.costly
def test_a_line_in_a_rostest(terminals: Terminals, tmp_path: Path) -> None:
    """A user's package has a bag, and what has to be the same is not, as it is in the READMEs."""
    robots = tmp_path / "robots"
    (robots / "test").mkdir(parents=True)
    (robots / "package.xml").write_text(PACKAGE)
    shutil.copy(BAGS / "line_single_2.0.bag", robots / "test" / "run.bag")
    paths = terminals.environment["ROS_PACKAGE_PATH"]
    terminals.environment["ROS_PACKAGE_PATH"] = f"{robots}:{paths}"
    terminals.environment["ROS_TEST_RESULTS_DIR"] = str(tmp_path / "results")
    small = f"--single '-f {line()} -c cells=2' --level outcome"
    for options, failures in (("--single '-f nothing.lp'", None), (small, "2")):
        (robots / "test" / "run.test").write_text(LAUNCH.format(options=options))
        ended = terminals.run("rostest", "robots", "run.test")
        assert ended.wait() != 0, ended.output
        (file,) = (tmp_path / "results").rglob("rosunit-run.xml")
        suite = ElementTree.parse(file).getroot()
        assert suite.get("failures") == (failures or "0")
        assert suite.get("errors") == ("1" if failures is None else "0")


@pytest.mark.costly
def test_a_bag_of_an_old_system(terminals: Terminals, recorder: Recorder) -> None:
    """It has no journal, and does not say what was started."""
    # Whichever goal the loop hears of first, the way is the same: the bag does not say when it did.
    groups = ["visit(3)", "visit(5) visit(4)"]
    bag = recorder.record(groups, [line()], failures=[2], driver=SLOWLY)
    old = of_an_old_system(bag)
    ended = replay(terminals, old)
    assert ended.wait() == 2
    assert "--planner" in ended.output
    mode = package("rosoclingo") / "modes" / f"{RECORDING}.lp"
    system = ("--controller", f"-f {mode} -c steps=20", "--planner", f"-f {line()}")
    replays_exactly(terminals, old, *system, said=": 3 goals")
    assert replay(terminals, old, *system[:3], f"-f {line()} -c slots=1").wait() == 1


def children(pid: int) -> List[int]:
    tasks = Path(f"/proc/{pid}/task").glob("*/children")
    direct = [int(child) for task in tasks for child in task.read_text().split()]
    return direct + [other for child in direct for other in children(child)]


@pytest.mark.costly
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_nothing_is_left_when_it_is_interrupted(
    terminals: Terminals, number: signal.Signals
) -> None:
    bag = BAGS / "mailbot_dynamic_recording.bag"
    started = terminals.start("rosrun", "rosoclingo", "replay.py", str(bag), "--rate", "0.001")
    wait_for(lambda: len(children(started.process.pid)) >= 3)
    pids = children(started.process.pid)
    started.process.send_signal(number)
    assert started.wait() == 130
    assert "Traceback" not in started.output
    wait_for(lambda: not [pid for pid in pids if Path(f"/proc/{pid}").exists()])


def is_late(topic: str, data: bytes) -> bool:
    return topic == "/rosoclingo/journal" and EVENT.unpack_from(data)[2] > 1


@pytest.mark.costly
def test_what_cannot_be_replayed(terminals: Terminals, tmp_path: Path) -> None:
    bag = Path(shutil.copy(BAGS / "mailbot_dynamic_recording.bag", tmp_path))
    empty = tmp_path / "empty.bag"
    empty.touch()
    idle = copy(bag, "idle.bag", lambda topic, data: None if is_late(topic, data) else data)
    for arguments, text in (
        ([str(without(bag, dropped=1, gap=1))], "events are missing: "),
        ([str(idle)], "nothing can be compared: no goal has got a status"),
        ([str(empty)], "the file is empty"),
        ([str(bag), "--planner", "-f nowhere.lp"], "there is no file 'nowhere.lp'"),
        ([str(bag), "--planner", "-f 'nowhere.lp"], "cannot be split into words"),
        ([str(bag), "--single", "-f a.lp", "--planner", "-f a.lp"], "--single is one node"),
        ([str(bag), "--system", "rosoclingo no_such.launch"], "no_such.launch"),
        ([str(bag), "--rate", "0"], "a positive number is needed"),
        ([str(bag), "--name", "/other"], "/other"),
    ):
        ended = terminals.run("rosrun", "rosoclingo", "replay.py", *arguments)
        assert ended.wait() == 2, ended.output
        assert text in ended.output
        assert "Traceback" not in ended.output
