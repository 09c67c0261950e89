"""Summary of a run for humans and scripts: a line, and what each actuator does; without ROS.

See docs/protocol.md, section "Summary". :mod:`rosoclingo.loop.health` and
:mod:`.actuator_health` say more.

>>> doing = CurrentActivity(Doing.WAITS, "", since=0.0)
>>> summary = LoopSummary(step=3, horizon=7, goals_open=2, goals_waiting=1, is_paused=True)
>>> summary_text(doing, summary, [ActuatorActivity("robot", "acts", "go(c4)", 12.0)])
'paused at step 3 of 7: 2 goals open, 1 waits; robot does go(c4) for 12 s'
"""

from __future__ import annotations

from typing import NamedTuple, Sequence

from rosclingo.errors import shorten
from rosclingo.health import Health
from rosoclingo.loop.monitor import CurrentActivity, Doing, LoopSummary

_MOST_NAMED = 5  # actuators that are named in a line

_QUICK = (Doing.DECIDES, Doing.RUNS, Doing.WAITS)  # is not said of a run that is paused

_DOING = {
    Doing.STARTS: "starts",
    Doing.DECIDES: "decides what to do",
    Doing.SEARCHES: "searches for a plan",
    Doing.IMPROVES: "searches for a better plan",
    Doing.LACKS: "waits for a solver that was lost",
    Doing.ENDED: "has ended",
}

_PHRASES = {
    "acts": "does {action} for {seconds:.0f} s",
    "is to stop": "is to stop {action} since {seconds:.0f} s",
    "has answered": "has answered {action}",
    "held": "waits for an operator to begin {action}",
    "retries": "tries {action} again",
    "timed out": "has not answered {action} in time",
    "lost": "was lost in {action}",
}  # none for idle


class ActuatorActivity(NamedTuple):
    """The activity of an actuator.

    Attributes:
        actuator: Its id.
        state: A word, as in diagnostics.
        action: Its action; empty if it is idle.
        seconds: For how long it has been doing that; 0 if it does nothing.
        is_on_hold: Whether an operator has put it on hold.
    """

    actuator: str
    state: str
    action: str = ""
    seconds: float = 0.0
    is_on_hold: bool = False


def actuator_activity(
    actuator: str, health: Health, summary: LoopSummary, now: float
) -> ActuatorActivity:
    """Returns the activity of an actuator.

    Args:
        actuator: Its id.
        health: Its health, which has its state.
        summary: What is known of the loop.
        now: The time, in seconds of the environment's clock.
    """
    state, is_on_hold = dict(health.values)["state"], actuator in summary.on_hold
    one = next((each for each in summary.executions if each.actuator == actuator), None)
    if one is None or state == "idle":
        return ActuatorActivity(actuator, state, is_on_hold=is_on_hold)
    acts = one.is_open and not one.is_held
    seconds = max(0.0, now - one.began) if acts else 0.0
    return ActuatorActivity(actuator, state, one.action, seconds, is_on_hold)


def summary_text(
    doing: CurrentActivity,
    summary: LoopSummary,
    activities: Sequence[ActuatorActivity],
    end: str = "",
) -> str:
    """Returns what a run does, in a line: the loop, the goals, and the actuators that are not idle.

    Args:
        doing: What the loop's thread does.
        summary: What is known of the loop.
        activities: Those of all actuators.
        end: Why the loop has ended; empty if it has not.
    """
    loop = f"has ended ({shorten(end)})" if end else _loop_text(doing, summary)
    step, goals, waiting = summary.step, summary.goals_open, summary.all_waiting
    place = f"step {step} of {max(step, summary.horizon)}"
    slots = f"{goals} goal{'' if goals == 1 else 's'} open"
    queue = f"{waiting} wait{'s' if waiting == 1 else ''}"
    acting = list(filter(None, map(_actuator_text, activities)))
    more = len(acting) - _MOST_NAMED
    named = [*acting[:_MOST_NAMED], *([f"{more} more"] if more > 0 else [])]
    return "; ".join((f"{loop} at {place}: {slots}, {queue}", *named))


def _loop_text(activity: CurrentActivity, summary: LoopSummary) -> str:
    doing, what, _ = activity
    if summary.is_paused and doing in _QUICK:
        return "paused"
    text = _DOING.get(doing, "")
    if summary.is_through and doing is not Doing.ENDED:
        text = "has published its plan"
    elif doing is Doing.RUNS:
        text = f"carries out {shorten(what) or 'a command'}"
    elif doing is Doing.WAITS:
        acts = any(one.acts and one.is_open for one in summary.executions)
        text = f"waits for {'actuators' if acts else 'inputs'}"
    return f"paused, {text}" if summary.is_paused else text


def _actuator_text(activity: ActuatorActivity) -> str:
    """Returns what an actuator does; empty if it is idle."""
    actuator, state, action, seconds, is_on_hold = activity
    phrase = _PHRASES.get(state, "").format(action=shorten(action), seconds=seconds)
    said = [*([phrase] if phrase else []), *(["is on hold"] if is_on_hold else [])]
    return f"{shorten(actuator)} {' and '.join(said)}" if said else ""
