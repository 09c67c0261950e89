"""Paths over the floor."""

from __future__ import annotations

import math
from typing import List, Optional, Tuple

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from office import PACKAGE, WAYPOINTS
from rooms import RADIUS, WALLS, box_of, gap, room

from rosoclingo_interfaces.navigation.waypoints import read_waypoints
from rosoclingo_simulator.navigation.planner import CLEARANCE, PathPlanner, lengths
from rosoclingo_simulator.physics.occupancy import read_map
from rosoclingo_simulator.physics.physics import Pose

PLANNER = PathPlanner(room())
SOLID = [box_of(wall) for wall in WALLS]
SLACK = 0.03  # m; a wall is somewhere in its cells

PLACES = st.tuples(st.floats(-0.5, 6.5), st.floats(-1.5, 3.5)).filter(
    lambda place: gap(*place, SOLID) > CLEARANCE + 0.1
)


def obstacles(*boxes: Tuple[float, float, float, float]) -> np.ndarray:
    """Returns the cells of a grid that are in boxes of west, south, east, north."""
    rows, columns = np.indices(PLANNER.grid.shape)
    x, y = np.moveaxis(PLANNER.grid.points(rows, columns), -1, 0)
    marked = np.zeros(PLANNER.grid.shape, bool)
    for west, south, east, north in boxes:
        marked |= (west < x) & (x < east) & (south < y) & (y < north)
    return marked


def check(path: Optional[np.ndarray], start: Pose, goal: Pose) -> np.ndarray:
    """Checks that a path leads from start to goal without jumps, and touches no wall."""
    assert path is not None
    assert math.dist(path[0], (start.x, start.y)) < 0.11
    assert tuple(path[-1]) == (goal.x, goal.y)
    assert np.diff(lengths(path)).max(initial=0) < 0.35
    points = np.concatenate([path, path[:-1] + np.diff(path, axis=0) / 2])
    assert min(gap(x, y, SOLID) for x, y in points) > RADIUS + SLACK - 0.01
    return path


@settings(max_examples=60, deadline=None)
@given(PLACES, PLACES)
@example((0.0, 0.09375), (0.0625, 0.0))  # in the same cell
def test_paths_keep_their_distance_from_walls(
    begin: Tuple[float, float], end: Tuple[float, float]
) -> None:
    start, goal = Pose(*begin, 0), Pose(*end, 0)
    path = check(PLANNER.plan(start, goal), start, goal)
    assert lengths(path)[-1] >= start.distance(goal) - 0.15
    inner = path[1:-1]
    if len(inner):
        assert min(gap(x, y, SOLID) for x, y in inner) >= CLEARANCE - SLACK


def test_a_path_goes_through_the_middle_of_a_door() -> None:
    start, goal = Pose(0, 3, 0), Pose(6, -1, 0)
    path = check(PLANNER.plan(start, goal), start, goal)
    crossing = path[np.abs(path[:, 0] - 3.1).argmin()]
    assert crossing[1] == pytest.approx(0.5, abs=0.11)


def test_it_goes_around_what_is_not_on_the_map() -> None:
    start, goal = Pose(0, 0.5, 0), Pose(2.4, 0.5, 0)
    marked = obstacles((1, 0, 1.4, 1))
    path = check(PLANNER.plan(start, goal, marked), start, goal)
    centres = PLANNER.grid.points(*np.nonzero(marked))
    away = np.hypot(*(path[:, None] - centres).transpose(2, 0, 1))
    assert away.min() >= CLEARANCE
    assert len(path) > len(check(PLANNER.plan(start, goal), start, goal))


def test_there_is_no_path_through_a_closed_door_or_into_a_wall() -> None:
    start, goal = Pose(0, 0.5, 0), Pose(5, 0.5, 0)
    assert PLANNER.plan(start, goal, obstacles((2.7, 0, 2.9, 1))) is None
    for x, y in ((5.15, 2.15), (4.9, 2.15), (9, 9), (-1e9, 0)):
        assert PLANNER.plan(start, Pose(x, y, 0)) is None
    assert PLANNER.plan(Pose(9, 9, 0), goal) is None


@pytest.mark.filterwarnings("error")
def test_far_from_the_map_is_no_path() -> None:
    far = Pose(1e300, -1e300, 0)
    assert PLANNER.plan(Pose(0, 0.5, 0), far) is None
    assert PLANNER.plan(far, Pose(0, 0.5, 0)) is None


def test_a_tolerance_lets_it_end_near_the_goal() -> None:
    start, goal = Pose(4, 0.5, 0), Pose(5.0, 2.15, 0)
    assert PLANNER.plan(start, goal, tolerance=0.1) is None
    path = PLANNER.plan(start, goal, tolerance=0.5)
    assert path is not None
    assert math.dist(path[-1], (goal.x, goal.y)) < 0.4
    assert gap(*path[-1], SOLID) >= CLEARANCE - SLACK


def test_a_robot_at_a_wall_gets_away() -> None:
    start, goal = Pose(2.81, 2, 0), Pose(0, 0, 0)
    path = PLANNER.plan(start, goal)
    assert path is not None
    assert path[0, 0] < 2.81
    assert gap(*path[0], SOLID) >= CLEARANCE - SLACK


def test_the_robot_may_stand_where_it_stands() -> None:
    path = PLANNER.plan(Pose(1, 1, 0), Pose(1, 1, 2))
    assert path is not None
    assert lengths(path)[-1] == 0


@pytest.mark.costly
def test_every_way_of_the_office_in_both_directions() -> None:
    planner = PathPlanner(read_map(PACKAGE / "maps" / "office.yaml"))
    places: List[Pose] = [
        Pose(place.x, place.y, place.theta) for place in read_waypoints(WAYPOINTS).places.values()
    ]
    for goal in places[1:]:
        there, back = planner.plan(places[0], goal), planner.plan(goal, places[0])
        assert there is not None
        assert back is not None
        assert lengths(there)[-1] == pytest.approx(lengths(back)[-1], rel=0.05)
