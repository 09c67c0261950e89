"""Learns the duration of each kind of action, as an exponential moving average. Needs no ROS.

Kinds are named by the encoding. In the average of a kind, the last action has the weight three
tenths, and the average before, at first the encoding's estimate, the rest.

>>> durations = Durations()
>>> durations.learn("go(a,b)", 10, 30.0)
>>> durations.means, durations.news()
({'go(a,b)': 16.0}, [('go(a,b)', 16)])
>>> durations.told["go(a,b)"] = 16
>>> durations.learn("go(a,b)", 16, 17.0)
>>> durations.news()
[]
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Dict, List, Set, Tuple

_WEIGHT = 0.3  # of the last action
_LEAST_SECONDS = 1.0  # that a mean differs from what was told, before it is told again
_LEAST_PART = 0.1  # the same, as a part of that


@dataclass
class Durations:
    """Learns how long actions take; all of it is saved. Only the loop's thread uses it.

    Attributes:
        means: How long actions take, in seconds, by their kinds.
        told: The durations that the planner believes, in seconds, by kinds.
        unknown: The kinds that its encoding does not want to know of.
    """

    means: Dict[str, float] = field(default_factory=dict)
    told: Dict[str, int] = field(default_factory=dict)
    unknown: Set[str] = field(default_factory=set)

    def learn(self, kind: str, believed: int, seconds: float) -> None:
        """Updates a kind's mean with a measured duration.

        Args:
            kind: What the encoding calls such actions.
            believed: How long it has taken by the plan, in seconds.
            seconds: How long it has taken, in seconds.
        """
        self.told.setdefault(kind, believed)
        mean = self.means.get(kind, float(believed))
        self.means[kind] = mean + _WEIGHT * (seconds - mean)

    def news(self) -> List[Tuple[str, int]]:
        """Returns which kinds take so much longer or shorter that the planner is to know it.

        Returns:
            Pairs of the kind and the seconds, from 1 on.
        """
        found = []
        for kind, mean in self.means.items():
            told = self.told.get(kind)
            is_new = told is None or abs(mean - told) >= max(_LEAST_SECONDS, _LEAST_PART * told)
            if is_new and kind not in self.unknown:
                found.append((kind, max(1, round(mean))))
        return found
