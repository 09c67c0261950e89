"""The watchdog: warns of silent actuators, times actions out, checks heartbeats, begins retries.

It also sends the encoding the messages that it has asked for by alarms.

What it finds goes into the inbox as what comes from outside does: so it is in the journal, and a
replay, which watches nothing, takes it from there.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Callable, Dict, Iterator, List, Optional, Set, Tuple

from rosoclingo.loop.execution.alarms import Alarms
from rosoclingo.loop.execution.durations import Durations
from rosoclingo.loop.execution.executions import Executions
from rosoclingo.loop.execution.heartbeats import Heartbeats
from rosoclingo.loop.execution.policies import ActionPolicies, ActionPolicy
from rosoclingo.loop.execution.tokens import UntakenAnswer, untaken_answers
from rosoclingo.loop.inputs.inbox import Inbox
from rosoclingo.loop.journal import Control, ControlArrived, MessageArrived
from rosoclingo.loop.values.environment import Environment
from rosoclingo.loop.values.execution import Execution
from rosoclingo.loop.words import INFO, LOST, TIMEOUT

REMINDER_SECONDS = 30.0
"""How often it is said that an actuator does not answer."""

LATE_SECONDS = 5.0
"""By how much an action may take longer than its encoding says, in seconds of ROS's time."""

RETURN_SECONDS = 10.0
"""The time that interfaces have after a restart to repeat the answers they gave before it."""

_RESUMING_SECONDS = 1.0  # that a process takes to find out what went on when it was started
_LOOK_SECONDS = 1.0  # how often it looks at least, and
_SHORTEST_SECONDS = 0.02  # at most
_BEATS = 2  # heartbeats in a row that are missing when an interface is lost
_SLEPT_SECONDS = 3.0  # since the last look, when this process slept, or was busy, itself
_GRACE_SECONDS = 0.2  # which answers have to be taken then
_PERCENT = 10  # of which progress is told
_ROUNDING = 1e-3  # of what came as a number of 32 bits


@dataclass(eq=False)
class WorldStopwatch:
    """How long an action goes on in the time of the world, as far as that was watched.

    A step back, or away from 0, counts for nothing: it is that of a simulator which starts.

    Attributes:
        last: When it was read last, in seconds of the world's time; at first, when it began.

    >>> stopwatch = WorldStopwatch(0.0)
    >>> [stopwatch.read(now) for now in (500.0, 502.0, 0.0, 1.0)]
    [0.0, 2.0, 2.0, 2.0]
    """

    last: float
    _seconds: float = 0.0

    def read(self, now: float, *, counts: bool = True) -> float:
        """Returns the seconds until now.

        Args:
            now: The time of the world, in seconds.
            counts: Whether those since the last time count.
        """
        if counts and 0 < self.last < now:
            self._seconds += now - self.last
        self.last = now
        return self._seconds


@dataclass(eq=False)
class ExecutionWatchdog:
    """Looks after the actions that are executed. Used by the loop's thread.

    Attributes:
        inbox: Where timeouts, lost interfaces and due retries go.
        executions: Who executes what.
        policies: How long that may take.
        durations: How long actions have taken.
        heartbeats: What interfaces say meanwhile.
        alarms: Which messages the encoding is to be told later.
        environment: Where the clocks are, and warnings go.
        tell: Tells a line to the goals.
        action_timeout: After how many seconds since its dispatch an action without a policy times
            out; 0 for never.
    """

    inbox: Inbox
    executions: Executions
    policies: ActionPolicies
    durations: Durations
    heartbeats: Heartbeats
    alarms: Alarms
    environment: Environment
    tell: Callable[[str], object]
    action_timeout: float

    def __post_init__(self) -> None:
        self._begin = self._looked_at = self.environment.now()
        self._is_late = False
        self._spent: Dict[int, WorldStopwatch] = {}  # by numbers of actions
        self._answered: Set[UntakenAnswer] = set()
        self._look_at = 0.0
        self._asked: Set[Tuple[Tuple[str, str], float]] = set()  # what the inbox has been told of
        self._progress: Dict[int, int] = {}  # in percent, as it was told, by numbers of actions

    @property
    def seconds(self) -> float:
        """Seconds until the next check is due; 0 if one is due now."""
        return max(0.0, self._look_at - self.environment.now())

    def look_soon(self) -> None:
        """Makes a check due, since an action was dispatched, or is to be tried again."""
        self._look_at = 0.0

    def look(self) -> None:
        """Looks, if it is time."""
        now = self.environment.now()
        if now < self._look_at:
            return
        self._answered = untaken_answers(self.inbox.waiting(), self.executions.run)
        for actuator, seconds in self.executions.late(REMINDER_SECONDS):
            if self._is_in_time(self.executions.last[actuator], now):
                continue
            self.environment.warn(
                f"{actuator} has not answered for {seconds:.0f} s; does an interface of it "
                "run, and does its terminal say why it waits?"
            )
        rest = [_LOOK_SECONDS]
        self._is_late = now - self._looked_at > _SLEPT_SECONDS  # then answers are taken first
        if not self.inbox.recorded.knows_inputs:
            self._tell_progress()
            rest += [*self._begin_retries(now), *self._time_out(now), *self._miss_heartbeats(now)]
            rest += [*self._ask_again(now), *self._send_alarms()]
        self._looked_at = now
        self._look_at = now + max(_SHORTEST_SECONDS, min(rest))

    def _has_answered(self, one: Execution) -> bool:
        """Tells if an answer has come that the loop has not taken yet, as in a search."""
        return one.actuator in self._answered or one.number in self._answered

    def _is_in_time(self, one: Execution, now: float) -> bool:
        """Tells if nothing is wrong with an action that goes on for long, as diagnostics have it.

        It has as long as the encoding says, and if that says nothing, as its interface is there.
        """
        if self._has_answered(one) or is_returning(one, self._begin, now):
            return True
        if one.kind:
            return self.environment.world_now() - one.world_began <= one.seconds + LATE_SECONDS
        last = self.heartbeats.last(one.number)
        return last is not None and now - last.seconds < REMINDER_SECONDS

    def _begin_retries(self, now: float) -> Iterator[float]:
        """Lets retries begin whose pause is over; yields the seconds until others are due."""
        for one in self.executions.retrying:
            if now >= one.retry_at:
                self.executions.mark_enqueued(one.actuator)
                self.inbox.put(ControlArrived(Control.RETRY, one.actuator))
            else:
                yield one.retry_at - now

    def _ask_again(self, now: float) -> Iterator[float]:
        """Has what was rejected long ago be asked for again; yields the seconds until it is so."""
        rejected = self.executions.rejected
        self._asked &= set(rejected.items())
        for key, ask_at in rejected.items():
            if now < ask_at:
                yield ask_at - now
            elif (key, ask_at) not in self._asked:
                self._asked.add((key, ask_at))
                self.inbox.put(ControlArrived(Control.ASK, key[0], action=key[1]))

    def _send_alarms(self) -> Iterator[float]:
        """Sends the messages whose time has come; yields the seconds until the next one."""
        now = self.environment.world_now()
        for message in self.alarms.take_due(now):
            self.inbox.put(MessageArrived(INFO, message))
        yield self.alarms.next() - now

    def _time_out(self, now: float) -> Iterator[float]:
        """Times out late executions; yields the seconds that are left to the others."""
        before, self._spent = self._spent, {}
        for one in self.executions.silent:
            policy = self.policies.of(one.actuator, one.action)
            world_now = self.environment.world_now()
            self._spent[one.number] = before.get(one.number) or WorldStopwatch(world_now)
            spent = self._spent[one.number].read(world_now, counts=not self._is_late)
            for left, limit in self._limits(one, policy, spent, now):
                if left > 0 or self._is_late or self._has_answered(one):
                    yield max(left, _GRACE_SECONDS)
                    continue
                why = f"{one.actuator} has not answered for {limit}: {one.action} has timed out"
                self._give_up(one, TIMEOUT, why)
                break

    def _limits(
        self, one: Execution, policy: ActionPolicy, spent: float, now: float
    ) -> Iterator[Tuple[float, str]]:
        """Yields how many seconds an action may still take, and what says so."""
        expected = self.durations.means.get(one.kind, one.seconds) if one.kind else one.seconds
        by_factor = policy.factor * expected
        if by_factor:
            why = f"{policy.factor:g} times the {expected:g} s that {one.action} takes (~policies)"
            yield by_factor - spent, why
        timeout, name = policy.timeout, "policies"
        if not timeout:
            timeout, name = self.action_timeout, "action_timeout"
        if timeout:
            yield one.began + timeout - now, f"{timeout:g} s (~{name})"

    def _miss_heartbeats(self, now: float) -> Iterator[float]:
        """Finds interfaces that are gone; yields the seconds until others may be."""
        for one in self.executions.silent:
            seconds = self.policies.of(one.actuator, one.action).heartbeat
            if not seconds:
                continue
            last = self.heartbeats.last(one.number)
            heard = max(one.began, self._begin, last.seconds if last is not None else 0.0)
            left = heard + _BEATS * seconds - now
            if left > 0 or self._is_late or self._has_answered(one):
                yield max(left, _GRACE_SECONDS)
                continue
            why = (
                f"the interface of {one.actuator} is lost: no heartbeat for {now - heard:.1f} s "
                f"(~policies), while {one.action} is executed; start it again"
            )
            self._give_up(one, LOST, why)

    def _give_up(self, one: Execution, answer: str, why: str) -> None:
        """Has an answer in the place of one that does not come, and warns of it."""
        self.executions.mark_enqueued(one.actuator)
        self.environment.warn(why)
        self.inbox.put(MessageArrived(one.actuator, answer))

    def _tell_progress(self) -> None:
        executed: List[Execution] = self.executions.silent
        self.heartbeats.keep([one.number for one in executed])
        told, self._progress = self._progress, {}
        for one in executed:
            percent = _percent(self.heartbeats, one)
            before = told.get(one.number)
            if percent is not None:
                self._progress[one.number] = percent
                if before is None or percent > before:
                    self.tell(f"{one.actuator} {one.action}: {percent} %")


def is_returning(one: Execution, begin: float, now: float) -> bool:
    """Tells if the answer to an action may still come that an earlier process has missed.

    Args:
        one: The execution.
        begin: When this process was started, in seconds of the environment's clock.
        now: The time, by the same clock.
    """
    return one.began < begin + _RESUMING_SECONDS and now - begin < RETURN_SECONDS


def _percent(heartbeats: Heartbeats, one: Execution) -> Optional[int]:
    last = heartbeats.last(one.number)
    if last is None or last.progress is None:
        return None
    return _PERCENT * int(100 * last.progress / _PERCENT + _ROUNDING)
