"""The office of the drives."""

from __future__ import annotations

from pathlib import Path

import pytest

from rosoclingo_simulator.navigation.planner import PathPlanner
from rosoclingo_simulator.physics.occupancy import OccupancyMap, read_map

PACKAGE = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def office() -> OccupancyMap:
    """The map of the office, which the robot drives by."""
    return read_map(PACKAGE / "maps" / "office.yaml")


@pytest.fixture(scope="session")
def planner(office: OccupancyMap) -> PathPlanner:
    """The planner of ways in the office."""
    return PathPlanner(office)
