"""Operators approve, reject, hold and pause by the services, while rosoclingo is killed.

Robots and operators live on, and judge. ``OPERATORS_OVER_ROS=20`` in the environment makes so many
runs. Needs a sourced workspace, in devel or install space.
"""

from __future__ import annotations

import os
import signal
from pathlib import Path
from random import Random

import pytest
from draws import draws
from terminals import Terminals, terminals, wait_for

pytestmark = pytest.mark.costly

__all__ = ["terminals"]

FLEET = str(Path(__file__).resolve().parents[1] / "unit" / "fleet.lp")
PATTERNS = ("do(*)", "go(*)", "clean(*)", "do(r1,*)", "nothing")
KILLS = 3

# Robots with a log, clients with three goals, and two operators; it ends when all goals have ended.
WORLD = """
import random
import sys
import threading
from collections import Counter

import actionlib  # which gives GoalStatus its to_string
import rospy
from actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from rosclingo.ros.init import init_node
from rosoclingo.loop.execution.interlock import Interlock
from rosoclingo.msg import (ROSoClingoActionGoal, ROSoClingoActionResult, ROSoClingoAnswer,
                            ROSoClingoDispatch, ROSoClingoGoal, ROSoClingoHeld)
from rosoclingo.srv import ControlActuator
from std_srvs.srv import Trigger

chance = random.Random(int(sys.argv[1]))
changed = threading.Condition()
held, ended, known = ROSoClingoHeld(), {}, set()
begun = []  # actuator and action, in order
needing = Counter()  # of those, what needed an approval
asked, refused = Counter(), Counter()  # approvals of these
decided = {}  # by token and action: what has become of it, as services have said
answers = {}
WORDS = ["approve", "reject"] * 4 + ["pause", "resume", "step", "hold", "release"]
left = [chance.randrange(5, 25)]  # acts of operators

def needs(actuator, action):
    # What has been let go before, may be heard after a kill.
    names = ("ask_before", "before")
    patterns = [rospy.get_param("/rosoclingo/" + name, "").split() for name in names]
    return all(Interlock(some).reason(actuator, action) is not None for some in patterns)

def on_dispatch(message):
    for one in message.actions:
        key = message.run, one.number
        with changed:
            if one.state != one.ANSWERED and key not in answers:
                answers[key] = "failure" if chance.random() < 0.1 else "success"
                named = one.id, one.action
                begun.append(named)
                needing[named] += needs(*named)
                if needing[named] > asked[named] - refused[named]:
                    print("WRONG: no operator has let go", named, flush=True)
                print("begins", *named, flush=True)
        if one.state != one.ANSWERED:
            out.publish(message.run, one.number, answers[key])

def on_held(message):
    global held
    with changed:
        held = message
        changed.notify_all()

def on_status(message):
    known.update(status.goal_id.id for status in message.status_list)

def on_result(message):
    with changed:
        ended[message.status.goal_id.id] = GoalStatus.to_string(message.status.status)
        changed.notify_all()

def call(word, *arguments):
    kind = ControlActuator if arguments else Trigger
    try:
        rospy.wait_for_service("/rosoclingo/" + word, 60.0)
        return rospy.ServiceProxy("/rosoclingo/" + word, kind)(*arguments)
    except (rospy.ServiceException, rospy.ROSException, OSError):
        return None  # it was killed; what was asked may hold or not

def decide(one, word):
    named = one[0], one[1]
    if word == "approve":
        with changed:
            asked[named] += 1
    reply = call(word, *one)
    with changed:
        if reply is not None and not reply.success and word == "approve":
            refused[named] += 1
        is_final = word == "reject" or (reply is not None and "has begun" in reply.message)
        if reply is not None and reply.success and is_final:
            said = decided.setdefault(one, set())
            said.add(word)
            if len(said) > 1:
                print("WRONG: it has begun, and is rejected", one, flush=True)

def split(atom):
    actuator, action = atom[len("do("):-1].split(",", 1)
    return actuator, action

def operate():
    while len(ended) < len(goals):
        with changed:
            changed.wait(0.3 * chance.random())
            now, last = held, left[0] <= 0
            left[0] -= 1
            rows = [(*split(atom), token) for atom, token in zip(now.held, now.tokens)]
        if last:
            if now.paused:
                call("resume")
            for actuator in now.on_hold:
                call("release", actuator, "", 0)
            for one, reason in zip(rows, now.reasons):
                if reason in ("approval", "rejected"):
                    decide(one, "approve")
            continue
        word = chance.choice(WORDS)
        if word in ("pause", "resume", "step"):
            call(word)
        elif word in ("hold", "release"):
            call(word, chance.choice(("r1", "r2")), "", 0)
        elif rows:
            decide(chance.choice(rows), word)

init_node("world")
REQUESTS = [f"clean({robot},{place})" for robot in ("r1", "r2") for place in (1, 2, 3)]
goals = {f"goal {n}": request for n, request in enumerate(chance.sample(REQUESTS, 3))}
out = rospy.Publisher("/rosoclingo/answer", ROSoClingoAnswer, queue_size=100)
to = rospy.Publisher("/rosoclingo/goal", ROSoClingoActionGoal, queue_size=100)
no = rospy.Publisher("/rosoclingo/cancel", GoalID, queue_size=100)
rospy.Subscriber("/rosoclingo/status", GoalStatusArray, on_status)
rospy.Subscriber("/rosoclingo/result", ROSoClingoActionResult, on_result)
rospy.Subscriber("/rosoclingo/held", ROSoClingoHeld, on_held)
rospy.Subscriber("/rosoclingo/dispatch", ROSoClingoDispatch, on_dispatch)
for _ in range(2):
    threading.Thread(target=operate, daemon=True).start()
cancelled = {key for key in goals if chance.random() < 0.3}
while len(ended) < len(goals) and not rospy.is_shutdown():
    for key, request in goals.items():
        if key not in known and key not in ended:
            to.publish(ROSoClingoActionGoal(goal_id=GoalID(rospy.Time.now(), key),
                                            goal=ROSoClingoGoal(request, [])))
        elif key in cancelled and key not in ended:
            no.publish(GoalID(id=key))
    with changed:
        changed.wait(0.3)
print("all have ended", sorted(ended.values()), flush=True)
"""


class Lives:
    """The lives of a run, one after the other, each with patterns of its own."""

    def __init__(self, terminals: Terminals, store: Path, chance: Random) -> None:
        self._terminals = terminals
        self._store = store
        self._chance = chance
        self._patterns = "nothing"
        self.begin()

    def begin(self) -> None:
        """Begins a life, and waits until it is registered."""
        before, self._patterns = self._patterns, self._chance.choice(PATTERNS)
        self.node = self._terminals.start(
            "rosrun", "rosoclingo", "run-1.0.py", "-f", FLEET, f"_store:={self._store}",
            f"_ask_before:={self._patterns}", f"_before:={before}", "_ask_again:=5",
        )  # fmt: skip
        wait_for(self._is_there, lambda: self.node.output)

    def _is_there(self) -> bool:
        try:
            names = self._terminals.names()
            here = self.node.process.pid
            return "/rosoclingo" in names and self._terminals.pid("/rosoclingo") == here
        except OSError:
            return False  # it is the one that was killed

    def end(self, *, politely: bool) -> None:
        """Ends it."""
        if politely:
            self.node.interrupt()
        else:
            os.kill(self.node.process.pid, signal.SIGKILL)
        self.node.wait()


@pytest.mark.parametrize("seed", draws(range(2), 20, "OPERATORS_OVER_ROS"))
def test_operators_while_it_is_killed(seed: int, terminals: Terminals, tmp_path: Path) -> None:
    chance = Random(seed)
    lives = Lives(terminals, tmp_path / "run.store", chance)
    world = terminals.start("python", "-c", WORLD, str(seed))
    for number in range(KILLS):
        before, count = world.output.count("begins"), chance.randrange(3)

        def is_time(before: int = before, count: int = count) -> bool:
            is_over = "all have ended" in world.output or world.process.poll() is not None
            return is_over or world.output.count("begins") >= before + count

        wait_for(is_time, lambda: world.output)
        lives.end(politely=number == KILLS - 1)
        lives.begin()
    assert world.wait() == 0, world.output
    assert "all have ended" in world.output
    assert "WRONG" not in world.output, world.output
    assert "ABORTED" not in world.output, world.output
    assert "Traceback" not in lives.node.output, lives.node.output
