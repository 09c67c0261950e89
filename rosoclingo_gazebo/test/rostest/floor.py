"""The office as its map and its waypoint file show it, read without the simulator's code."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Iterable, List, Tuple

import numpy as np
import yaml
from scipy.spatial import cKDTree

_NEAR = 0.5  # m: a robot that is so near to a waypoint visits it
_NEIGHBOURS = 16  # cells whose centres are the nearest: the nearest cell is among them

Point = Tuple[float, float]


class Floor:
    def __init__(self, map_file: Path, waypoint_file: Path) -> None:
        about = yaml.safe_load(map_file.read_text(encoding="utf-8"))
        self._resolution: float = about["resolution"]
        occupied = _occupied(map_file.parent / about["image"], about["occupied_thresh"])
        rows, columns = np.nonzero(np.flipud(occupied))
        origin = about["origin"][:2]
        self._cells = (np.column_stack((columns, rows)) + 0.5) * self._resolution + origin
        self._tree = cKDTree(self._cells)
        places = yaml.safe_load(waypoint_file.read_text(encoding="utf-8"))["waypoints"]
        self.waypoints = {name: (at["x"], at["y"]) for name, at in places.items()}

    def clearance(self, path: Iterable[Point]) -> float:
        """Returns how near a path comes to the edge of an occupied cell, in metres."""
        points = np.array(list(path))
        _, nearest = self._tree.query(points, k=_NEIGHBOURS)
        gaps = np.abs(self._cells[nearest] - points[:, None, :]) - self._resolution / 2
        return float(np.hypot(*np.moveaxis(np.maximum(gaps, 0.0), 2, 0)).min())

    def visited(self, path: Iterable[Point]) -> List[str]:
        """Returns the waypoints that a path visits, each once for each time that it comes there."""
        names: List[str] = []
        for point in path:
            for name, place in self.waypoints.items():
                if math.dist(point, place) < _NEAR and names[-1:] != [name]:
                    names.append(name)
        return names


def _occupied(image: Path, threshold: float) -> np.ndarray:
    """Reads a PGM file: which of its pixels are occupied, from the top."""
    kind, size, brightest, pixels = image.read_bytes().split(b"\n", 3)
    assert (kind, brightest) == (b"P5", b"255"), image
    columns, rows = (int(word) for word in size.split())
    grey = np.frombuffer(pixels, np.uint8).reshape(rows, columns)
    return (255 - grey) / 255.0 > threshold
