"""A topic with a history, and subscribers in other processes that come at any time."""

from __future__ import annotations

import subprocess
import sys
import threading
import time
import unittest
from collections import defaultdict
from pathlib import Path
from typing import Any, Dict, List

import rospy
import rostest
from std_msgs.msg import String
from waiting import wait_for

from rosclingo.ros.history_publisher import HistoryPublisher

ROUNDS = 3
# With everything twice, less than a subscriber's queue holds: however slow it is, nothing is lost.
MESSAGES = 4_000
LAST = 500  # how many of them are published when all are known to listen


class Subscriber:
    """A process that subscribes when it is told to, and what it has received."""

    def __init__(self) -> None:
        script = Path(__file__).resolve().with_name("history_subscriber.py")
        self.received: Dict[str, List[int]] = defaultdict(list)
        self.ready = threading.Event()
        self._process = subprocess.Popen(
            [sys.executable, str(script)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            bufsize=1,
        )
        threading.Thread(target=self._read, daemon=True).start()

    def subscribe(self, topic: str) -> None:
        assert self._process.stdin is not None
        self._process.stdin.write(f"{topic}\n")

    def close(self) -> None:
        self._process.terminate()
        self._process.communicate()

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            topic, _, number = line.partition(" ")
            if number:
                self.received[topic].append(int(number))
            else:
                self.ready.set()


class Topic:
    """A topic on which numbers are published."""

    def __init__(self, name: str, length: int) -> None:
        self.name = rospy.resolve_name(name)
        self._publisher = HistoryPublisher(name, String, length)

    def publish(self, first: int, last: int, keep: bool = True) -> None:
        for number in range(first, last + 1):
            self._publisher.publish(String(f"{number} {'.' * (number % 300)}"), keep)

    @property
    def writes(self) -> int:
        """How often something was written to the only subscriber."""
        ((_, _, number, _),) = self._publisher._publisher.impl.get_stats()[2]
        return int(number)

    def wait_for_connections(self, number: int) -> None:
        wait_for(lambda: self._publisher._publisher.get_num_connections() == number)


def parts(numbers: List[int]) -> List[List[int]]:
    """Splits numbers where one is not the next after the one before."""
    found: List[List[int]] = []
    for number in numbers:
        if not found or number != found[-1][-1] + 1:
            found.append([])
        found[-1].append(number)
    return found


class TestHistory(unittest.TestCase):
    subscribers: List[Subscriber]

    @classmethod
    def setUpClass(cls) -> None:
        cls.subscribers = [Subscriber() for _ in range(4)]
        for subscriber in cls.subscribers:
            cls.addClassCleanup(subscriber.close)
        wait_for(lambda: all(subscriber.ready.is_set() for subscriber in cls.subscribers))

    def wait_for_numbers(self, topic: Topic, subscriber: Subscriber, last: int) -> None:
        numbers = subscriber.received[topic.name]
        try:
            wait_for(lambda: set(numbers) >= set(range(1, last + 1)))
        except AssertionError:
            missing = sorted(set(range(1, last + 1)) - set(numbers))
            self.fail(f"{len(missing)} messages were lost, such as {missing[:5]}")

    def test_late_subscribers_miss_nothing_and_disturb_nobody(self) -> None:
        early, *late = self.subscribers
        everything = list(range(1, MESSAGES + 1))
        for number in range(ROUNDS):
            topic = Topic(f"~round{number}", MESSAGES)
            topic.publish(1, 1)
            early.subscribe(topic.name)
            wait_for(lambda: early.received[topic.name])  # noqa: B023  # its history has ended
            self.publish_while_they_come(topic, late)
            self.wait_for_numbers(topic, early, MESSAGES)
            self.assertEqual(early.received[topic.name], everything)
            for subscriber in late:
                self.wait_for_numbers(topic, subscriber, MESSAGES)
                # What was published before the history was sent may come first, too.
                *before, rest = parts(subscriber.received[topic.name])
                self.assertLessEqual(len(before), 1)
                self.assertEqual(rest, everything[: len(rest)])

    def publish_while_they_come(self, topic: Topic, late: List[Subscriber]) -> None:
        first = 2
        for number, subscriber in enumerate(late, 1):
            last = (MESSAGES - LAST) * number // len(late)
            subscriber.subscribe(topic.name)
            topic.publish(first, last)
            first = last + 1
        topic.wait_for_connections(1 + len(late))
        topic.publish(first, MESSAGES)

    def test_the_history_has_a_limit(self) -> None:
        topic = Topic("~few", 20)
        topic.publish(1, 100)
        topic.publish(1_000, 1_001, keep=False)
        kept, later = list(range(81, 101)), list(range(101, 151))
        for number, subscriber in enumerate(self.subscribers):
            subscriber.subscribe(topic.name)
            numbers = subscriber.received[topic.name]
            wait_for(lambda numbers=numbers: len(numbers) >= len(kept))
            self.assertEqual(numbers, kept, f"subscriber {number}")
        topic.publish(101, 150)
        for subscriber in self.subscribers:
            numbers = subscriber.received[topic.name]
            wait_for(lambda numbers=numbers: numbers[-1] == 150)
            self.assertEqual(numbers, kept + later)

    def test_many_messages_are_sent_in_few_writes(self) -> None:
        topic, (subscriber, *_) = Topic("~many", 1_000), self.subscribers
        topic.publish(1, 1)
        subscriber.subscribe(topic.name)
        wait_for(lambda: subscriber.received[topic.name] == [1])
        begin, before = time.monotonic(), topic.writes
        topic.publish(2, 1_000)
        self.wait_for_numbers(topic, subscriber, 1_000)
        pauses = (time.monotonic() - begin) / 0.02
        self.assertEqual(subscriber.received[topic.name], list(range(1, 1_001)))
        self.assertLessEqual(topic.writes - before, pauses + 2)

    def test_who_is_new_gets_what_was_written_before_the_rest(self) -> None:
        topic, (subscriber, *_) = Topic("~rest", 100), self.subscribers
        topic.publish(1, 1)
        subscriber.subscribe(topic.name)
        wait_for(lambda: subscriber.received[topic.name] == [1])
        topic.publish(2, 50)
        sent: List[Any] = []
        topic._publisher._on_subscriber(sent.append)
        first = [int(one.data.split()[0]) for batch in sent for one in batch.messages]
        self.assertEqual(first, list(range(1, len(first) + 1)))
        self.wait_for_numbers(topic, subscriber, 50)
        self.assertEqual(subscriber.received[topic.name], list(range(1, 51)))

    def test_what_is_not_kept_reaches_those_who_listen(self) -> None:
        topic = Topic("~passing", 20)
        early, late, *_ = self.subscribers
        topic.publish(1, 1)
        early.subscribe(topic.name)
        wait_for(lambda: early.received[topic.name] == [1])
        topic.publish(2, 2, keep=False)
        wait_for(lambda: early.received[topic.name] == [1, 2])
        late.subscribe(topic.name)
        wait_for(lambda: late.received[topic.name])
        topic.publish(3, 3)
        wait_for(lambda: late.received[topic.name][-1] == 3)
        self.assertEqual(late.received[topic.name], [1, 3])


if __name__ == "__main__":
    rospy.init_node("test_history")
    rostest.rosrun("rosclingo", "test_history", TestHistory, sys.argv)
