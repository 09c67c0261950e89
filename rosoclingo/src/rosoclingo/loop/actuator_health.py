"""Health of actuators: levels, messages and numbers, without ROS.

See docs/protocol.md, section "Diagnostics".
"""

from __future__ import annotations

import math
from typing import Collection, List, NamedTuple, Optional, Tuple

from rosclingo.errors import shorten
from rosclingo.health import Health, HealthLevel, number, since
from rosoclingo.loop.execution.heartbeats import Heartbeat
from rosoclingo.loop.execution.tokens import UntakenAnswer
from rosoclingo.loop.execution.watchdog import (
    LATE_SECONDS,
    REMINDER_SECONDS,
    is_returning,
)
from rosoclingo.loop.monitor import LoopSummary
from rosoclingo.loop.values.execution import Execution
from rosoclingo.loop.words import LOST

_STALE_SECONDS = 3.0  # after which an answer may be taken that the summary does not have
_OK, _WARN, _ERROR = HealthLevel.OK, HealthLevel.WARN, HealthLevel.ERROR
_TIMED_OUT = "has not answered in time"


class HealthClocks(NamedTuple):
    """The time of a report.

    Attributes:
        now: In seconds of the monotonic clock, which the loop's environment has, too.
        world: In seconds of ROS's time.
        began: When the node was started, in seconds of the monotonic clock.
    """

    now: float
    world: float
    began: float = -math.inf


def actuators_of(summary: LoopSummary) -> List[str]:
    """Returns the actuators that have acted, or are on hold, in the order of their ids."""
    return sorted({*(one.actuator for one in summary.executions), *summary.on_hold})


def actuator_health(
    actuator: str,
    summary: LoopSummary,
    clocks: HealthClocks,
    answers: Collection[UntakenAnswer] = (),
    heartbeat: Optional[Heartbeat] = None,
) -> Health:
    """Returns the health of an actuator.

    Args:
        actuator: Its id.
        summary: What is known of the loop.
        clocks: The time.
        answers: Those of :func:`.untaken_answers`.
        heartbeat: The last one of its action; None if there was none.
    """
    is_on_hold = actuator in summary.on_hold
    one = next((each for each in summary.executions if each.actuator == actuator), None)
    name = f"actuator {shorten(actuator)}"
    level, message, state = _OK, "has no action", "idle"
    values: Tuple[Tuple[str, str], ...] = ()
    if one is not None:
        level, message, state = _execution_health(one, summary, clocks, answers, heartbeat)
        values = _execution_values(one, clocks, heartbeat)
    if actuator in summary.timed_out and level is not _ERROR:
        level, message = _ERROR, f"{_TIMED_OUT} and has said nothing since; {message}"
    if is_on_hold:
        level, message = max(level, _WARN), f"on hold by an operator; {message}"
    held = ("on hold", "yes" if is_on_hold else "no")
    return Health(name, level, message, (("state", state), held, *values))


def _execution_health(
    one: Execution,
    summary: LoopSummary,
    clocks: HealthClocks,
    answers: Collection[UntakenAnswer],
    heartbeat: Optional[Heartbeat],
) -> Tuple[HealthLevel, str, str]:
    """Returns level, message and state of an actuator by what it was told last."""
    action, seconds = shorten(one.action), max(0.0, clocks.now - one.began)
    if one.is_enqueued and one.answer == LOST:
        return _ERROR, f"its interface was lost, while {action} was executed", "lost"
    if one.is_enqueued and not one.is_held:
        return _ERROR, f"{_TIMED_OUT}: {action} has timed out", "timed out"
    if not one.is_open:
        return _OK, f"has answered {shorten(str(one.answer))} to {action}", "idle"
    if one.is_held:
        reasons = [str(held.reason) for held in summary.held if held.actuator == one.actuator]
        if one.pauses:
            return _WARN, f"{action} has failed, and is tried again ({one.attempt})", "retries"
        return _WARN, f"{action} waits for an operator ({', '.join(reasons)})", "held"
    if not one.acts:
        return _OK, f"its answer to {action} is not awaited", "idle"
    if one.actuator in answers or one.number in answers:
        return _OK, f"has answered {action}, and the loop has not taken that yet", "has answered"
    state = "is to stop" if one.aborted else "acts"
    is_known = summary.time is None or clocks.now - summary.time < _STALE_SECONDS
    reason = _why_late(one, seconds, clocks, heartbeat) if is_known else None
    if reason is not None:
        return _WARN, f"{reason}; does an interface of it run?", state
    return _OK, f"{action}{' is to stop' if one.aborted else ''}, for {seconds:.1f} s", state


def _why_late(
    one: Execution, seconds: float, clocks: HealthClocks, heartbeat: Optional[Heartbeat]
) -> Optional[str]:
    """Returns why an action should be over; None if it may go on."""
    action = shorten(one.action)
    if is_returning(one, clocks.began, clocks.now):
        return None
    if one.kind:
        acted = clocks.world - one.world_began
        if acted <= one.seconds + LATE_SECONDS:
            return None
        return f"{action} takes {acted:.0f} s, and {one.seconds} s were expected"
    silent = seconds if heartbeat is None else clocks.now - heartbeat.seconds
    if min(seconds, silent) < REMINDER_SECONDS:
        return None
    return f"has not answered {action} for {seconds:.0f} s"


def _execution_values(
    one: Execution, clocks: HealthClocks, heartbeat: Optional[Heartbeat]
) -> Tuple[Tuple[str, str], ...]:
    last = heartbeat or Heartbeat(clocks.now)
    beat = None if heartbeat is None else heartbeat.seconds
    progress = "unknown" if last.progress is None else f"{100 * last.progress:.0f}"
    acted = max(0.0, clocks.now - one.began) if one.is_open and not one.is_held else 0.0
    return (
        ("action", one.action),
        ("step", str(one.step)),
        ("token", str(one.number)),
        ("acts (s)", number(acted)),
        ("expected (s)", str(one.seconds) if one.kind else "unknown"),
        ("attempt", str(one.attempt)),
        ("since the last heartbeat (s)", number(since(beat, clocks.now))),
        ("done (%)", progress),
        ("busy over steps", "yes" if one.is_busy or one.goes_on else "no"),
        ("answer", "none" if one.answer is None else one.answer),
    )
