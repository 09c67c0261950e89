"""Beams that meet the walls of a map."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rosoclingo_simulator.physics.grid import CellGrid
from rosoclingo_simulator.physics.walls import Walls

SIZE, CELL, LONGEST = 12, 0.5, 5.0  # cells, metres, metres
GRID = CellGrid(-1.0, 2.0, CELL, SIZE, SIZE)
FINE = 1e-6  # metres


def is_solid(solid: np.ndarray, points: np.ndarray) -> np.ndarray:
    return solid[GRID.cells(points)]


@pytest.mark.parametrize("seed", range(20))
def test_all_is_free_up_to_the_wall(seed: int) -> None:
    dice = np.random.default_rng(seed)
    solid = np.pad(dice.random((SIZE - 2, SIZE - 2)) < seed / 40, 1, constant_values=True)
    walls = Walls(solid, GRID)
    angles = dice.uniform(-math.pi, math.pi, 50)
    directions = np.stack((np.cos(angles), np.sin(angles)))
    free = GRID.points(*np.nonzero(~solid))
    x, y = dice.choice(free) + dice.uniform(-0.49, 0.49, 2) * CELL
    ranges = walls.ranges(x, y, directions, LONGEST)
    for beam, found in zip(directions.T, ranges):
        way = np.arange(0, min(found, LONGEST) - FINE, CELL / 50)
        assert not is_solid(solid, np.array((x, y)) + way[:, None] * beam).any()
        if found <= LONGEST:
            assert is_solid(solid, np.array((x, y)) + (found + FINE) * beam)


@pytest.mark.parametrize("angle", [math.pi / 4, -3 * math.pi / 4])
def test_no_beam_gets_through_where_two_corners_touch(angle: float) -> None:
    solid = np.pad(np.zeros((SIZE - 2, SIZE - 2), bool), 1, constant_values=True)
    solid[5, 6] = solid[6, 5] = True
    x, y = (GRID.x + 6 * CELL, GRID.y + 6 * CELL) - 0.7 * np.array((np.cos(angle), np.sin(angle)))
    directions = np.array([[math.cos(angle)], [math.sin(angle)]])
    assert Walls(solid, GRID).ranges(x, y, directions, LONGEST) == pytest.approx(0.7)


@pytest.mark.parametrize(
    ("angle", "metres"), [(0, 2.25), (math.pi / 2, 3.0), (math.pi, 2.75), (-math.pi / 2, 2.0)]
)
def test_along_an_axis(angle: float, metres: float) -> None:
    solid = np.pad(np.zeros((SIZE - 2, SIZE - 2), bool), 1, constant_values=True)
    directions = np.array([[math.cos(angle)], [math.sin(angle)]])
    place = (GRID.x + CELL + 2.75, GRID.y + CELL + 2.0)
    assert Walls(solid, GRID).ranges(*place, directions, LONGEST) == pytest.approx(metres)
