"""Ray casting: the walls of a map as lines, and where laser beams meet them."""

from __future__ import annotations

from typing import List, NamedTuple

import numpy as np

from rosoclingo_simulator.physics.grid import CellGrid

_PARALLEL = 1e-12  # the part along an axis of what is across it, for who divides by it
_GAP = 1e-9  # metres; walls that are nearer to each other touch, so that no beam gets through


class _Faces(NamedTuple):
    """Edges of free cells, on lines across an axis; arrays with one entry for each.

    Attributes:
        at: Where the line is, in metres along the axis.
        begin: Where the face begins, in metres along the other axis.
        end: Where it ends, in metres along that axis.
        side: On which side of it is free: 1 or -1 along the axis.
    """

    at: np.ndarray
    begin: np.ndarray
    end: np.ndarray
    side: np.ndarray


class Walls:
    """The faces of all solid cells that look at free ones. Does not change; thread-safe.

    A face is as long as the wall is straight, so that there are few of them.
    """

    def __init__(self, solid: np.ndarray, grid: CellGrid) -> None:
        """Looks for the faces.

        Args:
            solid: Which cells are.
            grid: Where the cells are.
        """
        self._axes = [
            _faces(solid, grid.x, grid.y, grid.resolution),
            _faces(solid.T, grid.y, grid.x, grid.resolution),
        ]

    def ranges(self, x: float, y: float, directions: np.ndarray, longest: float) -> np.ndarray:
        """Returns how far it is to the first wall along beams, in metres.

        Args:
            x: Where the beams begin, in metres; that is no solid cell.
            y: The other coordinate, in metres.
            directions: Of each beam the part along x and the one along y; its length is 1.
            longest: What is farther away need not be seen.

        Returns:
            For each beam; infinity if it meets nothing.
        """
        directions = without_zeros(directions)
        ranges = np.full(directions.shape[1], np.inf)
        for axis, faces in enumerate(self._axes):
            along, across = directions[axis], directions[1 - axis]
            here, there = (x, y) if axis == 0 else (y, x)
            ahead, begin, end = faces.at - here, faces.begin - there, faces.end - there
            seen = (ahead * faces.side <= 0) & (np.abs(ahead) <= longest)
            seen &= (begin <= longest) & (end >= -longest)
            gone = ahead[seen, None] / along
            meets = gone * across
            hit = (
                (gone >= 0)
                & (meets >= begin[seen, None] - _GAP)
                & (meets <= end[seen, None] + _GAP)
            )
            ranges = np.minimum(ranges, np.where(hit, gone, np.inf).min(axis=0, initial=np.inf))
        return ranges


def without_zeros(directions: np.ndarray) -> np.ndarray:
    """Returns directions by whose parts one can divide, along and across each axis."""
    return np.where(np.abs(directions) < _PARALLEL, _PARALLEL, directions)


def _faces(solid: np.ndarray, begin: float, across: float, resolution: float) -> _Faces:
    """Returns the faces on lines across the second axis of an array.

    Args:
        solid: Which cells are.
        begin: Where the first one begins along the second axis, in metres.
        across: The same along the first axis.
        resolution: Width of a cell, in metres.
    """
    change = np.diff(solid.astype(np.int8), axis=1)
    columns: List[np.ndarray] = []
    for free in (1, -1):
        # Where it is free on that side of a line, and runs of such cells along the line.
        looks = np.pad(change == -free, ((1, 1), (0, 0))).astype(np.int8)
        ends = np.diff(looks, axis=0).T
        lines, first = np.nonzero(ends == 1)
        _, last = np.nonzero(ends == -1)
        columns.append(np.stack((lines + 1, first, last, np.full(len(lines), free))))
    at, first, last, side = np.concatenate(columns, axis=1)
    return _Faces(
        begin + at * resolution, across + first * resolution, across + last * resolution, side
    )
