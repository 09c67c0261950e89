"""A random episode over ROS: the robots, the clients and the judge of nodes that run already.

usage: task_nodes.py DOMAIN SEED NODE...

Each NODE may be killed, since roslaunch starts it again. Exit status 1 says that something was
wrong, which is printed.
"""

from __future__ import annotations

import os
import queue
import signal
import sys
import threading
import time
import xmlrpc.client
from pathlib import Path
from random import Random
from types import SimpleNamespace
from typing import Any, Callable, Dict, List, Sequence, Tuple

import rosgraph
import rospy
from actionlib_msgs.msg import GoalID

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "kit"))

from task_judge import Rules
from task_world import DOMAINS, MOST_SLOTS, TaskWorld

from rosclingo.ros.init import init_node
from rosclingo.ros.low_latency import publisher, subscriber
from rosoclingo.loop.journal import (
    ARRIVALS,
    ActionPublished,
    ActionRetried,
    AnswerArrived,
    CancelArrived,
    CommandDone,
    Event,
    GoalArrived,
    LoopWaits,
    MessageArrived,
    StatusSet,
    decode,
)
from rosoclingo.msg import (
    ROSoClingoActionGoal,
    ROSoClingoAnswer,
    ROSoClingoDispatch,
    ROSoClingoEvent,
    ROSoClingoGoal,
    ROSoClingoIn,
    ROSoClingoToken,
)

AGAIN_SECONDS = 2.0  # after which a goal, a cancel or an answer is sent again that has not come
QUIET_SECONDS, LONG_QUIET_SECONDS = 0.05, 1.0
LONGEST_SECONDS = 120.0  # no more than a bound for what never comes


class Link:
    """Connection of a world to the nodes of one run, over topics, in place of an in-process loop.

    Attributes:
        known: The goals that have arrived, by their ids.
        elapsed: How many steps have begun.
    """

    def __init__(self, requests: Dict[str, str]) -> None:
        self.known: Dict[str, Any] = {}
        self.elapsed = 0
        self.events: queue.Queue[ROSoClingoEvent] = queue.Queue()
        self.dispatch = ROSoClingoDispatch()
        self._requests = requests
        self._goals = publisher("rosoclingo/goal", ROSoClingoActionGoal)
        self._cancels = publisher("rosoclingo/cancel", GoalID)
        self._answers = publisher("rosoclingo/answer", ROSoClingoAnswer)
        self._in = publisher("rosoclingo/in", ROSoClingoIn)
        self._heard = [
            subscriber("rosoclingo/journal", ROSoClingoEvent, self.events.put),
            subscriber("rosoclingo/dispatch", ROSoClingoDispatch, self._on_dispatch),
        ]
        self.sent: List[Tuple[Callable[[Event], bool], Callable[[], None]]] = []

    def _on_dispatch(self, message: ROSoClingoDispatch) -> None:
        self.dispatch = message

    def ask(self, key: str) -> None:
        goal = ROSoClingoActionGoal(goal_id=GoalID(rospy.Time.now(), key),
                                    goal=ROSoClingoGoal(self._requests[key], []))  # fmt: skip
        self._send(lambda e: isinstance(e, GoalArrived) and e.goal == key,
                   lambda: self._goals.publish(goal))  # fmt: skip

    def cancel(self, goal: Any) -> None:
        self._send(lambda e: isinstance(e, CancelArrived) and e.goal == goal.id,
                   lambda: self._cancels.publish(GoalID(id=goal.id)))  # fmt: skip

    def put(self, item: Any) -> None:
        if isinstance(item, AnswerArrived):
            message = ROSoClingoAnswer(item.run, item.number, item.value)
            actuator = next(o.id for o in self.dispatch.actions if o.number == item.number)
            self._send(lambda e: isinstance(e, MessageArrived) and e.source == actuator,
                       lambda: self._answers.publish(message))  # fmt: skip
        else:
            assert isinstance(item, MessageArrived)
            self.message = item
            # Lost if the node is being started again, and said twice if that takes long.
            self._send(
                lambda e: isinstance(e, MessageArrived) and e.value == item.value,
                lambda: self._in.publish(item.source, item.value),
            )

    def _send(self, has_come: Callable[[Event], bool], send: Callable[[], None]) -> None:
        send()
        self.sent.append((has_come, send))

    # What a world looks at in a process.

    @property
    def _items(self) -> List[Any]:
        return [one for one, _ in self.sent]

    @property
    def store(self) -> Any:
        return SimpleNamespace(inputs=lambda _: [(0, self.message)])

    message: Any = None


class Nodes(TaskWorld):
    """A world whose nodes are killed now and then."""

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self._retried: Dict[str, ActionRetried] = {}  # actions before their next try

    @property
    def _pausing(self) -> Sequence[Any]:
        return list(self._retried.values())

    def run(self, nodes: List[str]) -> None:
        """Goes on until all goals have ended, or nothing comes any more."""
        link = Link(self._requests)
        self._life = link  # type: ignore[assignment]
        number, last = 0, time.monotonic()
        again, waits = last, False
        while time.monotonic() - last < LONGEST_SECONDS:
            try:
                message = link.events.get(timeout=QUIET_SECONDS)
            except queue.Empty:
                now = time.monotonic()
                if link.sent and now - again > AGAIN_SECONDS:
                    again = now
                    for _, send in link.sent:
                        send()
                if link.sent or not self._is_dispatched(link):
                    continue
                if not (self._is_quiet or (waits and now - last > LONG_QUIET_SECONDS)):
                    continue  # what ends no wait is followed by no event
                if all(client.end() for client in self.clients.values()) and not self._open:
                    return
                link.message = None
                self.turn(link)  # type: ignore[arg-type]
                self._is_quiet &= not link.sent
                if link.message is None:  # which would be lost
                    self._kill(nodes)
                continue
            if message.number <= number:
                continue
            number, last, again = message.number, time.monotonic(), time.monotonic()
            link.elapsed += 1
            event = decode(message)
            self._is_quiet = isinstance(event, LoopWaits) or self._is_quiet
            waits = not isinstance(event, CommandDone) and (waits or self._is_quiet)
            self._is_quiet &= not isinstance(event, (*ARRIVALS, CommandDone))
            link.sent = [(has_come, send) for has_come, send in link.sent if not has_come(event)]
            self._hear(link, event)
        self.violations.append(f"nothing comes any more: {link.sent}, {self.physics.describe()}")

    def _hear(self, link: Link, event: Event) -> None:
        if isinstance(event, GoalArrived):
            link.known[event.goal] = SimpleNamespace(id=event.goal, slot=None)
        elif isinstance(event, StatusSet):
            if event.slot and event.goal in link.known and not event.status.is_terminal:
                link.known[event.goal].slot = event.slot
                self._put(event.goal, event.slot)
            self._see(event)
            self.clients[event.goal].words.append(event.status.value)
        elif isinstance(event, ActionRetried):
            self._retried[event.actuator] = event
            if event.action.startswith("go("):
                self.physics.try_again(event.actuator, event.action)
        elif isinstance(event, ActionPublished) and event.actuator != "solver":
            self._retried.pop(event.actuator, None)
            self.effects.append((event.actuator, event.action))
            self.physics.begin(event.actuator, event.action)

    def _is_dispatched(self, link: Link) -> bool:
        """Takes the tokens of dispatched actions; tells whether they are those of the journal."""
        message = link.dispatch
        todo = [one for one in message.actions if one.state != ROSoClingoToken.ANSWERED]
        self._open = [(message.run, one.number) for one in todo]
        self._acts = {(message.run, one.number): one.id for one in todo}
        running = {actuator: action for actuator, (action, _) in self.physics.running.items()}
        return running == {one.id: one.action for one in todo}

    def _news(self) -> List[Tuple[str, str, str]]:
        """Returns nothing while the loop may be about to publish what the news prevents."""
        return super()._news() if self._is_quiet else []

    def _kill(self, nodes: List[str]) -> None:
        if self.kills_left and self.chance.random() < 0.25:
            self.kills_left -= 1
            name = self.chance.choice(nodes)
            delay = self.chance.choice([0.0, self.chance.uniform(0.0, 0.05)])
            try:
                node = xmlrpc.client.ServerProxy(rosgraph.Master("/judge").lookupNode(name))
                number = node.getPid("/judge")[2]  # type: ignore[index]
            except (OSError, rosgraph.MasterException, xmlrpc.client.Error):
                return  # it is being started
            self._count(f"kills of {name}")
            threading.Timer(delay, os.kill, (number, signal.SIGKILL)).start()

    comes_alone = 1.0  # else it might be planned for before the news are there
    kills_left = 3
    _is_quiet = False  # the last thing that the loop has done is to wait


def main() -> int:
    """Runs the episode, and returns the exit status."""
    name, seed, *nodes = sys.argv[1:]
    init_node("judge")
    domain = DOMAINS[name]
    world = Nodes(Rules(domain.files, MOST_SLOTS), domain, Random(f"nodes {seed}"))
    world.run(nodes)
    wrong = world.judge()
    print("\n".join([*wrong, f"{name} {seed}: {world.counts}, {len(wrong)} violations"]))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
