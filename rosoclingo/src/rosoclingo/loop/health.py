"""Health of the loop and of its store: levels, messages and numbers, without ROS.

See docs/protocol.md, section "Diagnostics". What is said depends on the time and on values that any
thread may read, such as a :class:`.LoopSummary`.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import List, Optional

from rosclingo.errors import shorten
from rosclingo.health import Health, HealthLevel, number, resident_megabytes, since
from rosoclingo.loop.monitor import CurrentActivity, Doing, LoopMonitor, LoopSummary
from rosoclingo.loop.values.execution import HoldReason

START_SECONDS = 5.0
"""How long the nodes may take to start."""

_SLOW = (Doing.DECIDES, Doing.RUNS, Doing.SEARCHES)
_OK, _WARN, _ERROR = HealthLevel.OK, HealthLevel.WARN, HealthLevel.ERROR
_MOST_HELD = 3  # actions that wait for an operator which are named in a message


# The loop.


def loop_health(monitor: LoopMonitor, now: float, *, queue: int, slow_seconds: float) -> Health:
    """Returns the health of the loop.

    Args:
        monitor: What the loop's thread does.
        now: The time, in seconds of the monotonic clock.
        queue: How many inputs wait until the loop takes them.
        slow_seconds: After how long a decision, a command or a search is slow; 0 for never.
    """
    summary, activity = monitor.summary, monitor.activity
    seconds = max(0.0, now - activity.since)
    does = _describe(activity, summary, seconds)
    planning = since(monitor.planning_since, now) or 0.0
    warnings = _loop_warnings(summary, activity, seconds, does, slow_seconds)
    if 0 < slow_seconds < planning and not any(one.startswith(does) for one in warnings):
        warnings.insert(0, f"{does}; without a plan for {planning:.1f} s{_longer(slow_seconds)}")
    level, message = (_WARN, "; ".join(warnings)) if warnings else (_OK, does)
    if monitor.end:
        level, message = _ERROR, f"has ended: {monitor.end}"
    is_searching = activity.doing is Doing.SEARCHES
    held = ", ".join(f"{one.actuator} {one.action} ({one.reason})" for one in summary.held)
    values = (
        ("state", str(activity.doing)),
        ("in this state (s)", number(seconds)),
        ("step", str(summary.step)),
        ("horizon", str(summary.horizon)),
        ("since the last decision (s)", number(since(monitor.decided, now))),
        ("search under way (s)", number(seconds if is_searching else 0.0)),
        ("last search (s)", number(monitor.searched)),
        ("without a plan (s)", number(planning)),
        ("goals with a slot", str(summary.goals_open)),
        ("goals that wait for a slot", str(summary.goals_waiting)),
        ("inputs in the queue", str(queue)),
        ("inputs that the planner does not know", str(summary.untold)),
        ("paused", "yes" if summary.is_paused else "no"),
        ("on hold", ", ".join(summary.on_hold) or "none"),
        ("held", shorten(held) or "none"),
        ("memory (MB)", number(resident_megabytes())),
        ("age of what is known (s)", number(since(summary.time, now))),
    )
    return Health("loop", level, message, values)


def _longer(slow_seconds: float) -> str:
    return f", longer than ~slow_seconds ({slow_seconds:g} s)"


def _describe(activity: CurrentActivity, summary: LoopSummary, seconds: float) -> str:
    """Returns what the loop does, in a line."""
    doing, what, _ = activity
    place = f"step {summary.step} of {max(summary.step, summary.horizon)}"
    if summary.is_through:
        return "has published its plan, and the mode is through"
    if doing is Doing.STARTS:
        return f"starts, for {seconds:.1f} s: waits for its solvers, or has them begin"
    if doing is Doing.LACKS:
        return f"waits for a solver that was lost, for {seconds:.1f} s: {what}"
    if doing is Doing.DECIDES:
        return f"takes inputs and asks the controller what to do next, for {seconds:.1f} s"
    if doing is Doing.SEARCHES:
        return f"searches for a plan, for {seconds:.1f} s, {what}"
    if doing is Doing.IMPROVES:
        return f"searches for a better plan while actuators act, {place}"
    if doing is Doing.WAITS:
        acts = any(one.acts and one.is_open for one in summary.executions)
        return f"waits for actuators, {place}" if acts else f"waits for inputs, {place}"
    if doing is Doing.ENDED:
        return "has ended, because the node is shutting down"
    return f"carries out {shorten(what) or 'a command'}, for {seconds:.1f} s"


def _loop_warnings(
    summary: LoopSummary, activity: CurrentActivity, seconds: float, does: str, slow_seconds: float
) -> List[str]:
    """Returns warnings for the operator, if the loop has not ended."""
    warnings = []
    if activity.doing is Doing.LACKS:
        warnings.append(does)
    if activity.doing is Doing.STARTS and seconds > START_SECONDS:
        warnings.append(does)
    if activity.doing in _SLOW and 0 < slow_seconds < seconds:
        warnings.append(f"{does}{_longer(slow_seconds)}")
    if summary.is_paused:
        warnings.append("paused by an operator")
    asked = [one for one in summary.held if one.reason is not HoldReason.RETRY]
    if asked:
        named = [f"{one.actuator} {one.action} ({one.reason})" for one in asked]
        more = len(named) - _MOST_HELD
        said = [*map(shorten, named[:_MOST_HELD]), *([f"{more} more"] if more > 0 else [])]
        warnings.append(f"waits for an operator: {', '.join(said)}")
    return warnings


# The store.


@dataclass(frozen=True)
class StoreSummary:
    """Size and condition of a store.

    Attributes:
        path: Its folder.
        bytes: The size of its database and of the log; None if that is unknown.
        committed: When it was written last, in seconds of the monotonic clock; None if it was not.
        failure: Why nothing can be written any more; empty if it can.
        is_unsure: Whether it is still unconfirmed that the run in it goes on.
    """

    path: Path
    bytes: Optional[int]
    committed: Optional[float]
    failure: str
    is_unsure: bool


def store_health(store: StoreSummary, end: str, now: float) -> Health:
    """Returns the health of a store.

    Args:
        store: What is known of it.
        end: Why the loop has ended; empty if it has not.
        now: The time, in seconds of the monotonic clock.
    """
    size = None if store.bytes is None else store.bytes / 1e6
    level, message = _OK, "each step is written"
    if store.failure:
        level, message = _ERROR, store.failure
    elif store.is_unsure and end:
        level, message = _ERROR, f"refused: {end}"
    elif store.is_unsure:
        message = "is compared with what the nodes were started with"
    values = (
        ("path", str(store.path)),
        ("size (MB)", number(size)),
        ("since the last commit (s)", number(since(store.committed, now))),
    )
    return Health("store", level, message, values)
