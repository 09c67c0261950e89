"""Actions without actionlib's faults: what goes wrong with its own server and client."""

from __future__ import annotations

import copy
import io
import threading
from types import SimpleNamespace
from typing import Any, Callable, Dict, Iterator, List, Set, Tuple

import pytest
import rospy
from actionlib import CommState, msg
from actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from waiting import wait_for

from rosclingo.limits import MOST_ID
from rosclingo.ros import action_client, action_server
from rosclingo.ros.action_client import LowLatencyActionClient
from rosclingo.ros.action_server import LowLatencyActionServer

RESULT = msg.TestActionResult(status=GoalStatus(GoalID(id="g"), GoalStatus.SUCCEEDED, ""))


class Topic:
    """A topic that goes nowhere."""

    def __init__(self, on_subscriber: Any = None) -> None:
        self.sent: List[Any] = []
        self._changed = threading.Condition()
        self.connected: Set[str] = set()
        self.impl = SimpleNamespace(has_connection=self.connected.__contains__)
        self._on_subscriber = on_subscriber

    def publish(self, message: Any) -> None:
        with self._changed:
            self.sent.append(copy.deepcopy(message))
            self._changed.notify_all()

    def wait_for(self, messages: int) -> None:
        """Waits until so many messages were sent."""
        with self._changed:
            assert self._changed.wait_for(lambda: len(self.sent) >= messages, 60.0)

    def connect(self, node: str) -> List[Any]:
        """Returns what is sent to a new subscriber alone."""
        self.connected.add(node)
        heard: List[Any] = []
        self._on_subscriber(heard.append)
        return heard


@pytest.fixture
def topics(monkeypatch: pytest.MonkeyPatch) -> Iterator[Dict[str, Topic]]:
    """The topics by their names; the clock of ROS stands still."""
    made: Dict[str, Topic] = {}

    def publisher(name: str, *_: object, on_subscriber: Any = None, **__: object) -> Topic:
        made[name] = Topic(on_subscriber)
        return made[name]

    for module in (action_server, action_client):
        monkeypatch.setattr(module, "publisher", publisher)
        monkeypatch.setattr(module, "subscriber", lambda *_: None)
    parameters = {"a/status_list_timeout": 5.0, "actionlib_status_frequency": 100.0}
    monkeypatch.setattr(rospy, "get_param", lambda name, *_: parameters[name])
    monkeypatch.setattr(rospy, "search_param", lambda name: name)
    monkeypatch.setattr(rospy.rostime, "_rostime_initialized", True)
    monkeypatch.setattr(rospy.rostime, "_rostime_current", rospy.Time(1))
    hooks: List[Callable[[], object]] = []
    monkeypatch.setattr(rospy, "on_shutdown", hooks.append)
    yield made
    for end in hooks:
        end()


class Server:
    """A server, and the goals that it was sent."""

    def __init__(self) -> None:
        self.goals: List[Any] = []
        self.server = LowLatencyActionServer(
            "a", msg.TestAction, self.goals.append, lambda _: None, msg.TestResult(7)
        )
        self.server.start()

    def goal(self, identifier: str) -> Any:
        message = msg.TestActionGoal(goal_id=GoalID(id=identifier))
        message._connection_header = {"callerid": "/client"}
        self.server.internal_goal_callback(message)
        return self.goals[-1] if self.goals else None

    def end(self, identifier: str) -> None:
        goal = self.goal(identifier)
        goal.set_accepted()
        goal.set_succeeded(msg.TestResult(1))

    @property
    def listed(self) -> List[str]:
        return list(self.server._trackers)


def quiet(monkeypatch: pytest.MonkeyPatch) -> None:
    """Has a server repeat no statuses during a test."""
    monkeypatch.setattr(LowLatencyActionServer, "_repeat_statuses", lambda *_: None)


@pytest.mark.costly
def test_the_status_list_is_short(topics: object, monkeypatch: pytest.MonkeyPatch) -> None:
    quiet(monkeypatch)
    monkeypatch.setattr(action_server, "_ENDED_SECONDS", 0.0)
    server = Server()
    server.goal("open")
    for number in range(200):
        server.end(str(number))
    assert server.listed == ["open", *map(str, range(175, 200))]


def server_with_many_goals(monkeypatch: pytest.MonkeyPatch) -> Server:
    """Returns a server with 51 open goals, whose statuses wait until somebody publishes them."""
    quiet(monkeypatch)
    monkeypatch.setattr(action_server, "_PAUSE_SECONDS", 1000.0)
    server = Server()
    for number in range(51):
        server.goal(str(number))
    return server


def test_statuses_of_many_goals_are_published_together(
    topics: Dict[str, Topic], monkeypatch: pytest.MonkeyPatch
) -> None:
    server = server_with_many_goals(monkeypatch)
    before = len(topics["a/status"].sent)
    for goal in server.goals:
        goal.set_accepted()
    assert len(topics["a/status"].sent) == before
    for goal in server.goals:
        goal.set_succeeded(msg.TestResult(1))
    assert len(topics["a/status"].sent) <= before + action_server._MANY_GOALS + 1
    assert len(topics["a/result"].sent) == 51


def test_no_status_waits_while_the_node_shuts_down(
    topics: Dict[str, Topic], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The thread that would publish it has ended."""
    server = server_with_many_goals(monkeypatch)
    monkeypatch.setattr(rospy.core, "is_shutdown_requested", lambda: True)
    server.goals[0].set_accepted()
    statuses = [goal.status for goal in topics["a/status"].sent[-1].status_list]
    assert statuses == [GoalStatus.ACTIVE, *[GoalStatus.PENDING] * 50]


def test_a_status_that_has_waited_is_published(
    topics: Dict[str, Topic], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(action_server, "_PAUSE_SECONDS", 0.2)
    parameters = {"a/status_list_timeout": 5.0, "actionlib_status_frequency": 0.001}
    monkeypatch.setattr(rospy, "get_param", lambda name, *_: parameters[name])
    server = Server()
    for number in range(51):
        server.goal(str(number))
    server.goals[0].set_accepted()
    wait_for(lambda: len(topics["a/status"].sent[-1].status_list) == 51)


def test_statuses_are_repeated_while_the_clock_stands_still(topics: Dict[str, Topic]) -> None:
    Server()
    topics["a/status"].wait_for(4)


def test_what_is_said_before_its_client_is_connected(topics: Dict[str, Topic]) -> None:
    server = Server()
    goal = server.goal("early")
    goal.set_accepted()
    goal.publish_feedback(None)
    goal.set_succeeded(msg.TestResult(1))
    for name in ("a/feedback", "a/result"):
        assert not topics[name].connect("/other")
        assert [m.status.goal_id.id for m in topics[name].connect("/client")] == ["early"]
    server.end("late")
    assert not topics["a/result"].connect("/client")


def test_a_cancel_request_for_a_goal_that_has_left_the_list(
    topics: object, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(action_server, "_ENDED_GOALS", 0)
    monkeypatch.setattr(action_server, "_ENDED_SECONDS", -1.0)
    server = Server()
    server.end("gone")
    server.server.internal_cancel_callback(GoalID(id="gone"))
    server.server.internal_cancel_callback(GoalID(id="to come"))
    assert server.listed == ["to come"]


def test_a_cancel_request_that_comes_before_its_goal(topics: Dict[str, Topic]) -> None:
    server = Server()
    server.server.internal_cancel_callback(GoalID(id="early"))
    assert server.goal("early") is None
    (message,) = topics["a/result"].sent
    assert message.status.status == GoalStatus.RECALLED
    assert message.result == msg.TestResult(7)


def ended() -> Tuple[LowLatencyActionClient, action_client.GoalHandle]:
    """Returns a client and a goal of it that has ended."""
    client = LowLatencyActionClient("a", msg.TestAction)
    goal = client.send_goal(msg.TestGoal(), identifier="g")
    client._result_cb(RESULT)
    assert goal.get_comm_state() == CommState.DONE
    return client, goal


def test_a_goal_that_has_ended_is_not_canceled(topics: Dict[str, Topic]) -> None:
    _, goal = ended()
    goal.cancel()
    assert goal.get_comm_state() == CommState.DONE
    assert not topics["a/cancel"].sent


def test_a_result_that_comes_again(topics: object, monkeypatch: pytest.MonkeyPatch) -> None:
    client, goal = ended()
    errors: List[object] = []
    monkeypatch.setattr(rospy, "logerr", lambda *words: errors.append(words))
    client._result_cb(RESULT)
    assert goal.get_comm_state() == CommState.DONE
    assert not errors


class Batches:
    """A server with batches, and what its application is given."""

    def __init__(self) -> None:
        self.goals: List[List[str]] = []
        self.cancels: List[List[str]] = []
        self.blocks = threading.Lock()
        self.server = LowLatencyActionServer(
            "a", msg.TestAction, self._on_goals, self._on_cancels, msg.TestResult(7), batches=True
        )
        self.server.start()

    def send(self, *identifiers: str) -> None:
        for one in identifiers:
            message = msg.TestActionGoal(goal_id=GoalID(id=one, stamp=rospy.Time(1)))
            message._connection_header = {"callerid": "/client"}
            self.server.internal_goal_callback(message)

    def taken(self) -> List[str]:
        return [one for batch in self.goals for one in batch]

    def _on_goals(self, handles: List[Any]) -> None:
        with self.blocks:
            self.goals.append([one.get_goal_id().id for one in handles])

    def _on_cancels(self, handles: List[Any]) -> None:
        self.cancels.append([one.get_goal_id().id for one in handles])


def test_goals_that_come_together_are_taken_together(topics: Dict[str, Topic]) -> None:
    served = Batches()
    first, *others = map(str, range(200))
    with served.blocks:  # the application is busy with what has come before
        served.send(first)
        wait_for(lambda: not served.server._waiting)
        served.send(*others)
    wait_for(lambda: len(served.taken()) == 200)
    assert served.taken() == [first, *others]
    assert len(served.goals) <= 2 + 200 // action_server._BATCH
    wait_for(lambda: len(topics["a/status"].sent[-1].status_list) == 200)


@pytest.fixture
def unserved(topics: object, monkeypatch: pytest.MonkeyPatch) -> Batches:
    """A server whose thread takes no goals: they wait."""
    monkeypatch.setattr(LowLatencyActionServer, "_take_waiting", lambda _: None)
    quiet(monkeypatch)
    served = Batches()
    served.send(*map(str, range(100)))
    return served


def test_a_cancel_request_overtakes_the_goals_that_wait(unserved: Batches) -> None:
    unserved.server.internal_cancel_callback(GoalID(id="70"))
    assert (unserved.goals, unserved.cancels) == ([["70"]], [["70"]])
    unserved.server.internal_cancel_callback(GoalID(id="to come"))
    assert unserved.taken() == ["70"]
    assert list(unserved.server._trackers) == ["70", "to come"]


@pytest.mark.parametrize("stamp", [0, 1])
def test_a_cancel_request_for_all_is_for_those_that_wait(unserved: Batches, stamp: int) -> None:
    unserved.server.internal_cancel_callback(GoalID(stamp=rospy.Time(stamp)))
    assert unserved.taken() == list(map(str, range(100)))
    assert [one for batch in unserved.cancels for one in batch] == unserved.taken()
    most = action_server._BATCH
    assert max(map(len, (*unserved.goals, *unserved.cancels))) <= most  # others have their turn
    assert len(unserved.cancels) <= 1 + 100 // most


class Failing(Batches):
    """A server whose application fails once it has accepted the first goal of a batch."""

    def _on_goals(self, handles: List[Any]) -> None:
        super()._on_goals(handles)
        if "bad" in self.goals[-1]:
            handles[0].set_accepted()
            raise ValueError("a bug")

    def _on_cancels(self, handles: List[Any]) -> None:
        super()._on_cancels(handles)
        raise ValueError("a bug")

    def statuses(self) -> Dict[str, Tuple[int, str]]:
        """The status and text of each goal in the last list that was published."""
        lists = [message.status_list for message in self.server.status_pub.sent[-1:]]
        return {one.goal_id.id: (one.status, one.text) for last in lists for one in last}


@pytest.fixture
def failing(topics: object, monkeypatch: pytest.MonkeyPatch) -> Failing:
    monkeypatch.setattr(rospy, "logerr", lambda *_, **__: None)
    return Failing()


def test_goals_end_with_the_error_of_the_application(failing: Failing) -> None:
    """Goals that it has not accepted are rejected, and later ones are taken."""
    failing.server._rejected = msg.TestResult(9)
    with failing.server.lock:  # so that they come together
        failing.send("good", "bad", "other")
    results = failing.server.result_pub
    results.wait_for(2)
    internal = (GoalStatus.REJECTED, "internal error: ValueError('a bug')")
    wait_for(lambda: failing.statuses().get("other") == internal)
    assert failing.statuses()["bad"] == internal
    assert failing.statuses()["good"] == (GoalStatus.ACTIVE, "")
    assert [one.result.result for one in results.sent] == [9, 9]
    failing.send("later")
    wait_for(lambda: failing.taken() == ["good", "bad", "other", "later"])


def test_a_goal_that_cannot_be_entered_is_rejected_alone(
    failing: Failing, monkeypatch: pytest.MonkeyPatch
) -> None:
    add = failing.server._add

    def fail_once(tracker: Any) -> Any:
        if tracker.status.goal_id.id == "other":
            monkeypatch.setattr(failing.server, "_add", add)
            raise ValueError("a bug")
        return add(tracker)

    monkeypatch.setattr(failing.server, "_add", fail_once)
    with failing.server.lock:
        failing.send("good", "other", "later")
    internal = (GoalStatus.REJECTED, "internal error: ValueError('a bug')")
    wait_for(lambda: failing.statuses().get("other") == internal)
    wait_for(lambda: failing.taken() == ["good", "later"])


def test_a_cancel_request_at_which_the_application_fails_is_withdrawn(failing: Failing) -> None:
    failing.send("good")
    wait_for(lambda: failing.taken() == ["good"])
    with pytest.raises(ValueError, match="a bug"):
        failing.server.internal_cancel_callback(GoalID(id="good"))
    assert failing.statuses()["good"][0] == GoalStatus.PENDING


def test_ids_that_are_too_long_are_dropped(topics: object, monkeypatch: pytest.MonkeyPatch) -> None:
    said: List[Any] = []
    monkeypatch.setattr(rospy, "logwarn", lambda *words: said.append(words))
    server = Server()
    for _ in range(3):
        server.server.internal_cancel_callback(GoalID(id="x" * (MOST_ID + 1)))
        assert server.goal("y" * (MOST_ID + 1)) is None
    assert server.listed == []
    assert len(said) == 1
    assert f"its id has more than {MOST_ID} characters" in said[0][0] % said[0][1:]
    server.goal("z" * MOST_ID)
    assert server.listed == ["z" * MOST_ID]


def test_statuses_are_encoded_as_they_are(topics: object, monkeypatch: pytest.MonkeyPatch) -> None:
    quiet(monkeypatch)
    server = Server()
    for number in range(3):
        server.goal(str(number))
    for change in (lambda: None, server.goals[1].set_accepted, server.goals[2].set_canceled):
        change()
        written, expected = io.BytesIO(), io.BytesIO()
        message = action_server._StatusList(server.server._trackers.values())
        message.serialize(written)
        GoalStatusArray(message.header, message.status_list).serialize(expected)
        assert written.getvalue() == expected.getvalue()
