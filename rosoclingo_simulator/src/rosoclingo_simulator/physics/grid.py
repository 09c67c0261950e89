"""Cells of a floor and the points in them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Tuple

import numpy as np


@dataclass(frozen=True)
class CellGrid:
    """Square cells; row 0 and column 0 are at the least y and x.

    Attributes:
        x: The left edge, in metres.
        y: The lower edge, in metres.
        resolution: Width of a cell, in metres.
        rows: How many there are.
        columns: How many there are.
    """

    x: float
    y: float
    resolution: float
    rows: int
    columns: int

    @property
    def shape(self) -> Tuple[int, int]:
        """Of an array with a value for each cell."""
        return self.rows, self.columns

    def cells(self, points: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
        """Returns the rows and columns of points; of those outside, the nearest.

        Args:
            points: An array whose last axis is x and y, in metres.
        """
        columns = np.floor((points[..., 0] - self.x) / self.resolution)
        rows = np.floor((points[..., 1] - self.y) / self.resolution)
        # First to the nearest: an integer may be too small for what is far outside.
        return (
            np.clip(rows, 0, self.rows - 1).astype(np.intp),
            np.clip(columns, 0, self.columns - 1).astype(np.intp),
        )

    def points(self, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """Returns the centres of cells, as an array whose last axis is x and y, in metres."""
        return np.stack(
            (self.x + (columns + 0.5) * self.resolution, self.y + (rows + 0.5) * self.resolution),
            axis=-1,
        )
