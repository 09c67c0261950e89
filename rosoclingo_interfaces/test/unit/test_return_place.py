"""Where a robot goes that has looked around."""

from __future__ import annotations

from pathlib import Path
from typing import Optional, Tuple

import pytest

from rosoclingo_interfaces.navigation.cross_track import PathPoint
from rosoclingo_interfaces.navigation.return_place import choose
from rosoclingo_interfaces.navigation.waypoints import read_waypoints

OFFICE = Path(__file__).resolve().parents[2] / "config" / "graph_wg.yaml"


@pytest.mark.parametrize(
    ("poses", "before", "place"),
    [
        # On its way, or before an obstacle on a detour: it goes back.
        (((26, -8), (26.3, -8.1)), ("c2", "c3"), ("c2", "c3")),
        (((26, -11), (26, -11.5)), ("c2", "c3"), ("c2", "c3")),
        (((23, -8), (23, -8)), ("c2", None), ("c2", None)),
        # Carried, whatever is near.
        (((26, -8), (24, -17)), ("c2", "c3"), ("c5", None)),
        # It was carried, or is another process, and its localisation has found that before.
        (((32, -17), (32, -17)), ("open1", None), ("c4", None)),
        (((24, -17), (24, -17)), ("c2", "c3"), ("c5", None)),
        (((32, -17), (32, -17)), (None, "c3"), ("c4", None)),
        # A drive to where it was.
        (((16.7, -8), (16.7, -8)), ("c1", "c1"), ("c1", None)),
    ],
)
def test_where_it_goes(
    poses: Tuple[PathPoint, PathPoint],
    before: Tuple[Optional[str], Optional[str]],
    place: Tuple[str, Optional[str]],
) -> None:
    """By where it was believed to be and is, the last waypoint, and the one that it has missed."""
    assert choose(read_waypoints(OFFICE).places, *poses, *before) == place
