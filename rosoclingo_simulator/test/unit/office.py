"""The committed files of the office, for several tests."""

from __future__ import annotations

from pathlib import Path
from typing import Tuple

import numpy as np
import yaml
from skimage import io

PACKAGE = Path(__file__).parents[2]
DESCRIPTION = PACKAGE / "office.yaml"
INSTANCE = PACKAGE.parent / "rosoclingo_aspprograms" / "mailbot" / "instances" / "graph_wg.lp"
WAYPOINTS = PACKAGE.parent / "rosoclingo_interfaces" / "config" / "graph_wg.yaml"
MARKERS = PACKAGE.parent / "rosoclingo_rviz" / "config" / "office_markers.yaml"

FREE, WALL = 254, 0  # grey values


class OfficeMap:
    """What map_server's two files say; nothing here knows how they were made."""

    def __init__(self) -> None:
        path = PACKAGE / "maps" / "office.yaml"
        about = yaml.safe_load(path.read_text())
        image = io.imread(path.with_name(about["image"]))
        self.resolution: float = about["resolution"]
        self.origin: Tuple[float, float] = tuple(about["origin"][:2])
        self.free: np.ndarray = image[::-1] == FREE  # row 0 is in the south, as y grows north
        self.wall: np.ndarray = image[::-1] == WALL

    def cell(self, x: float, y: float) -> Tuple[int, int]:
        """Returns row and column of a point."""
        west, south = self.origin
        return int((y - south) / self.resolution), int((x - west) / self.resolution)

    def box(self, x: float, y: float, size_x: float, size_y: float) -> Tuple[slice, slice]:
        """Returns the rows and columns of a box, given its centre and its size."""
        west, south = self.origin
        edges = (y - size_y / 2 - south, y + size_y / 2 - south)
        sides = (x - size_x / 2 - west, x + size_x / 2 - west)
        rows, columns = (
            slice(*(round(edge / self.resolution) for edge in pair)) for pair in (edges, sides)
        )
        return rows, columns
