"""A room with walls for several tests, as a map and as a world for MuJoCo, and geometry for it."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Iterable, Sequence, Tuple

import numpy as np

from rosoclingo_simulator.physics.occupancy import FREE, OCCUPIED, OccupancyMap
from rosoclingo_simulator.physics.physics import Box

RADIUS = 0.18  # m, of the robot
RESOLUTION = 0.05  # m
WEST, SOUTH, EAST, NORTH = -1.0, -2.0, 7.0, 4.0  # m, the edges of the map

Wall = Tuple[float, float, float, float]  # west, south, east, north

# Around the room, a wall with a door of 1 m from y = 0 to y = 1, and a pillar.
WALLS: Sequence[Wall] = (
    (-1.0, -2.0, 7.0, -1.8),
    (-1.0, 3.8, 7.0, 4.0),
    (-1.0, -2.0, -0.8, 4.0),
    (6.8, -2.0, 7.0, 4.0),
    (3.0, -2.0, 3.2, 0.0),
    (3.0, 1.0, 3.2, 4.0),
    (5.0, 2.0, 5.3, 2.3),
)


def room(walls: Iterable[Wall] = WALLS) -> OccupancyMap:
    rows, columns = round((NORTH - SOUTH) / RESOLUTION), round((EAST - WEST) / RESOLUTION)
    cells = np.full((rows, columns), FREE, np.int8)
    for west, south, east, north in walls:
        left, right = (round((x - WEST) / RESOLUTION) for x in (west, east))
        low, high = (round((y - SOUTH) / RESOLUTION) for y in (south, north))
        cells[low:high, left:right] = OCCUPIED
    return OccupancyMap(cells, RESOLUTION, WEST, SOUTH)


def write_world(file: Path, walls: Iterable[Wall] = WALLS) -> Path:
    geoms = "".join(
        f'<geom type="box" pos="{(west + east) / 2} {(south + north) / 2} 0.5" '
        f'size="{(east - west) / 2} {(north - south) / 2} 0.5"/>'
        for west, south, east, north in walls
    )
    floor = '<geom type="plane" size="20 20 1"/>'
    file.write_text(f"<mujoco><worldbody>{floor}{geoms}</worldbody></mujoco>")
    return file


def box_of(wall: Wall) -> Box:
    west, south, east, north = wall
    return Box((west + east) / 2, (south + north) / 2, 0.0, east - west, north - south)


def gap(x: float, y: float, boxes: Iterable[Box]) -> float:
    """Returns how far a point is from the nearest box, in metres; 0 inside of one."""
    gaps = []
    for box in boxes:
        turned = complex(x - box.x, y - box.y) * complex(math.cos(box.theta), -math.sin(box.theta))
        along = max(abs(turned.real) - box.length / 2, 0.0)
        across = max(abs(turned.imag) - box.width / 2, 0.0)
        gaps.append(math.hypot(along, across))
    return min(gaps)


def beam(x: float, y: float, angle: float, boxes: Iterable[Box], longest: float) -> float:
    """Returns how far a beam gets in metres, found by cutting it with each side of each box."""
    best = math.inf
    dx, dy = math.cos(angle), math.sin(angle)
    for box in boxes:
        corners = []
        for along, across in ((1, 1), (1, -1), (-1, -1), (-1, 1)):
            offset = complex(along * box.length / 2, across * box.width / 2)
            turned = offset * complex(math.cos(box.theta), math.sin(box.theta))
            corners.append((box.x + turned.real, box.y + turned.imag))
        for (ax, ay), (bx, by) in zip(corners, corners[1:] + corners[:1]):
            sx, sy = bx - ax, by - ay
            across = dx * sy - dy * sx
            if abs(across) < 1e-12:
                continue
            far = ((ax - x) * sy - (ay - y) * sx) / across
            part = ((ax - x) * dy - (ay - y) * dx) / across
            if far >= 0 and 0 <= part <= 1:
                best = min(best, far)
    return best if best <= longest else math.inf
