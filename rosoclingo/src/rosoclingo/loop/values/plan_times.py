"""The times of a plan, from the terms of ``~plan``: when its actions begin and end, and deadlines.

>>> times = PlanTimes.read(["do(r,go(a),2)", "timed(do(r,go(a),2),5,25)", "expected(1,25)",
...                         "due(1,20)", "now(3)"])
>>> times.actions
(TimedAction(step=2, actuator='r', name='go(a)', begins=5.0, ends=25.0),)
>>> times.expected, times.due, times.now
({'1': 25.0}, {'1': 20.0}, 3.0)
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Dict, Iterable, List, Mapping, NamedTuple, Optional, Sequence, Tuple

from rosclingo.wire.term_text import number, split_term
from rosoclingo.loop.words import DUE, EXPECTED, NOW, TIMED


class TimedAction(NamedTuple):
    """An action that is planned or under way, with its times in seconds of ROS's time.

    Attributes:
        step: Its first step, from the current one on.
        actuator: Who does it.
        name: The action.
        begins: When it begins or has begun.
        ends: When it is expected to end.
    """

    step: int
    actuator: str
    name: str
    begins: float
    ends: float


@dataclass(frozen=True)
class PlanTimes:
    """The times of a plan, in seconds of ROS's time.

    Attributes:
        now: When they were said; None if the plan says no times, or in a bag of an older version.
        actions: The actions whose duration is known.
        expected: When goals will be served, by their slots.
        due: When goals are due, by their slots.
    """

    now: Optional[float] = None
    actions: Tuple[TimedAction, ...] = ()
    expected: Mapping[str, float] = field(default_factory=dict)
    due: Mapping[str, float] = field(default_factory=dict)

    @classmethod
    def read(cls, terms: Iterable[str]) -> PlanTimes:
        """Reads the terms of ``~plan``; skips all others."""
        now: Optional[float] = None
        actions: List[TimedAction] = []
        seconds: Dict[str, Dict[str, float]] = {EXPECTED: {}, DUE: {}}
        for term in terms:
            name, arguments = split_term(term)
            last = number(arguments[-1]) if arguments else None
            if last is None:
                continue
            if name in seconds and len(arguments) == 2:
                seconds[name][arguments[0]] = float(last)
            elif name == NOW and len(arguments) == 1:
                now = float(last)
            elif name == TIMED and len(arguments) == 3:
                functor, action = split_term(arguments[0])
                step = number(action[-1]) if (functor, len(action)) == ("do", 3) else None
                begins = number(arguments[1])
                if step is not None and begins is not None:
                    actions.append(
                        TimedAction(step, action[0], action[1], float(begins), float(last))
                    )
        return cls(now, tuple(actions), seconds[EXPECTED], seconds[DUE])

    def moved(self, now: float, to: float, rate: float) -> PlanTimes:
        """Returns the same times by another clock.

        Args:
            now: A time of ROS.
            to: The time that the other clock shows then.
            rate: How many seconds of that clock go by in a second of ROS's time.
        """

        def by_it(seconds: float) -> float:
            return to + (seconds - now) * rate

        return PlanTimes(
            to,
            tuple(
                one._replace(begins=by_it(one.begins), ends=by_it(one.ends)) for one in self.actions
            ),
            {slot: by_it(time) for slot, time in self.expected.items()},
            {slot: by_it(time) for slot, time in self.due.items()},
        )


TimedPlans = Sequence[Tuple[float, PlanTimes]]
"""The times that ``~plan`` has said, in order, each with when, by another clock."""
