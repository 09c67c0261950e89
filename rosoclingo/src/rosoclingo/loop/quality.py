"""A plan's cost, and the lower bound of all plans.

>>> quality = Quality((3, 17), (3, 12))
>>> quality.is_best, str(quality)
(False, '3 17/3 12')
>>> Quality.read("3 17/3 17").is_best
True
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Dict, Tuple


@dataclass(frozen=True)
class Quality:
    """A plan's cost and the proven lower bound, as its encoding minimises it. Immutable.

    Attributes:
        cost: What it costs: one number for each priority, the highest one first; empty if the plan
            was not searched for, so that it was not computed.
        bound: The lower bound of the cost, in the same form; empty if unknown.
    """

    cost: Tuple[int, ...]
    bound: Tuple[int, ...] = ()

    @property
    def is_best(self) -> bool:
        """True if the plan is proven optimal."""
        return bool(self.cost) and self.cost == self.bound

    def as_json(self) -> Dict[str, Any]:
        """Returns the content of ``~plan_quality``."""
        return {"cost": list(self.cost), "bound": list(self.bound), "optimal": self.is_best}

    def __str__(self) -> str:
        """Encodes it as text, for :meth:`read`."""
        return "/".join(" ".join(map(str, numbers)) for numbers in (self.cost, self.bound))

    @classmethod
    def read(cls, text: str) -> Quality:
        """Decodes the text of ``str``.

        Raises:
            ValueError: It is something else.
        """
        cost, _, bound = text.partition("/")
        return cls(tuple(map(int, cost.split())), tuple(map(int, bound.split())))
