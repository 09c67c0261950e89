"""Places labels on a picture so that they hide neither each other nor what else has to be seen.

>>> frame = LabelBox(0, 0, 100, 100)
>>> place([(50, 50), (50, 50)], [(20, 10), (20, 10)], [], frame)
[(50.0, 59.0), (50.0, 41.0)]
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Iterator, List, Sequence, Tuple

LabelPoint = Tuple[float, float]

_GAP = 4.0  # between a label and what it is about
_STEP = 6.0  # by which a label goes farther away if there is no room
_MOST_STEPS = 60
_DEGREES = (90, 270, 0, 180, 45, 135, 225, 315)  # in this order; 0 is to the right


@dataclass(frozen=True)
class LabelBox:
    """A rectangle; all numbers are of one unit, such as pixels."""

    left: float
    bottom: float
    right: float
    top: float

    @classmethod
    def around(cls, centre: LabelPoint, size: LabelPoint) -> LabelBox:
        """Returns the rectangle with a centre, and a width and a height."""
        (x, y), (width, height) = centre, size
        return cls(x - width / 2, y - height / 2, x + width / 2, y + height / 2)

    def overlap(self, other: LabelBox) -> float:
        """Returns the area that two rectangles share."""
        width = min(self.right, other.right) - max(self.left, other.left)
        height = min(self.top, other.top) - max(self.bottom, other.bottom)
        return max(width, 0.0) * max(height, 0.0)

    @property
    def area(self) -> float:
        """The area, in squares of the unit."""
        return self.overlap(self)


def place(
    anchors: Sequence[LabelPoint],
    sizes: Sequence[LabelPoint],
    obstacles: Sequence[LabelBox],
    frame: LabelBox,
) -> List[LabelPoint]:
    """Places labels one after the other, each as close to its point as there is room.

    Args:
        anchors: What each is about.
        sizes: Width and height of each.
        obstacles: What no label is to hide.
        frame: What all labels are to be in.

    Returns:
        The centre of each label. If there is no room at all, it is where least is hidden.
    """
    taken = list(obstacles)
    centres: List[LabelPoint] = []
    for anchor, size in zip(anchors, sizes):
        least, best = math.inf, anchor
        for centre in _candidates(anchor, size):
            box = LabelBox.around(centre, size)
            hidden = box.area - box.overlap(frame) + sum(map(box.overlap, taken))
            if hidden < least:
                least, best = hidden, centre
            if not hidden:
                break
        centres.append(best)
        taken.append(LabelBox.around(best, size))
    return centres


def _candidates(anchor: LabelPoint, size: LabelPoint) -> Iterator[LabelPoint]:
    for step in range(_MOST_STEPS):
        away = _GAP + step * _STEP
        for degrees in _DEGREES:
            angle = math.radians(degrees)
            x = (size[0] / 2 + away) * round(math.cos(angle), 3)
            y = (size[1] / 2 + away) * round(math.sin(angle), 3)
            yield anchor[0] + x, anchor[1] + y
