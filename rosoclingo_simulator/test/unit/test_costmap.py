"""What the laser sees that is not on the map."""

from __future__ import annotations

import numpy as np
import pytest
from rooms import room

from rosoclingo_simulator.navigation.costmap import Costmap
from rosoclingo_simulator.navigation.planner import PathPlanner
from rosoclingo_simulator.physics.kinematic import KinematicPhysics
from rosoclingo_simulator.physics.laser import look
from rosoclingo_simulator.physics.physics import Box, Pose

FLOOR = room()
GRID = PathPlanner(FLOOR).grid


@pytest.fixture
def physics() -> KinematicPhysics:
    return KinematicPhysics(FLOOR, Pose(0, 0.5, 0))


@pytest.fixture
def costmap() -> Costmap:
    return Costmap(FLOOR, GRID)


def marks(costmap: Costmap) -> np.ndarray:
    return GRID.points(*np.nonzero(costmap.marked))


def test_walls_of_the_map_are_not_marked(physics: KinematicPhysics, costmap: Costmap) -> None:
    for x, y, theta in ((0, 0.5, 0), (3.1, 0.5, 1), (5.5, 2.6, 2), (-0.6, 3.6, 3)):
        physics.reset(Pose(x, y, theta))
        costmap.update(look(physics, 0.0))
    assert len(marks(costmap)) == 0
    assert costmap.changes == 0


def test_a_box_is_marked_where_it_is_seen(physics: KinematicPhysics, costmap: Costmap) -> None:
    physics.put("box", Box(1.5, 0.5, 0, 0.4, 0.6))
    costmap.update(look(physics, 0.0))
    found = marks(costmap)
    assert costmap.changes == 1
    assert found[:, 0] == pytest.approx(np.full(len(found), 1.3), abs=0.06)  # its front only
    assert np.ptp(found[:, 1]) == pytest.approx(0.6, abs=0.11)
    costmap.update(look(physics, 0.2))
    assert costmap.changes == 1


def test_a_box_that_is_gone_is_cleared_where_the_laser_looks(
    physics: KinematicPhysics, costmap: Costmap
) -> None:
    physics.put("box", Box(1.5, 0.5, 0, 0.4, 0.6))
    costmap.update(look(physics, 0.0))
    physics.remove("box")
    physics.reset(Pose(0, -1.5, 0))
    physics.put("screen", Box(0, -1, 0, 3, 0.2))  # the robot cannot see where the box was
    costmap.update(look(physics, 0.2))
    assert (marks(costmap)[:, 1] > 0).any()
    physics.remove("screen")
    physics.reset(Pose(0, 0.5, 0))
    costmap.update(look(physics, 0.4))
    assert len(marks(costmap)) == 0


def test_what_is_far_away_is_not_marked(physics: KinematicPhysics, costmap: Costmap) -> None:
    physics.put("box", Box(5, 0.5, 0, 0.4, 0.4))
    costmap.update(look(physics, 0.0))
    assert len(marks(costmap)) == 0


def test_clearing_forgets_all(physics: KinematicPhysics, costmap: Costmap) -> None:
    physics.put("box", Box(1.5, 0.5, 0, 0.4, 0.6))
    costmap.update(look(physics, 0.0))
    before = costmap.marked
    costmap.clear()
    assert not costmap.marked.any()
    assert before.any()  # who has taken it may still use it
    assert costmap.changes == 2
