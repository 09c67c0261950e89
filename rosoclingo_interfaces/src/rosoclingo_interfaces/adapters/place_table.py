"""The table of places of an adapter's file, which templates look up. Needs no ROS."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Collection, Dict, Mapping

from rosclingo.errors import TermError, shorten
from rosclingo.solver.terms import parse_term
from rosoclingo_interfaces.adapters.term_pattern import term_text
from rosoclingo_interfaces.errors import ActionError, WaypointError
from rosoclingo_interfaces.navigation.waypoints import read_waypoints
from rosoclingo_interfaces.observation.yaml_entry import YamlEntry

POSE, ORIENTATION = "pose", "orientation"
COMPUTED: Mapping[str, str] = {
    POSE: "geometry_msgs/Pose",
    ORIENTATION: "geometry_msgs/Quaternion",
}
"""The columns that follow from x, y, z and theta, with the types of the fields that they fit."""

_COORDINATES = {"x", "y"}
_NUMBERS = ("x", "y", "z", "theta")


@dataclass(frozen=True)
class PlaceTable:
    """Rows of texts, by the names of places, as they are written into messages.

    Attributes:
        where: The file, for errors.
        rows: For each place, its columns.
    """

    where: str
    rows: Mapping[str, Mapping[str, str]]

    @property
    def columns(self) -> Collection[str]:
        """The names of all columns, with the computed ones."""
        return list(dict.fromkeys([*(key for row in self.rows.values() for key in row), *COMPUTED]))

    def values_of(self, column: str) -> Dict[str, str]:
        """Returns the values of a column, by the places that have it; empty texts if computed."""
        needed = _COORDINATES if column in COMPUTED else {column}
        return {name: row.get(column, "") for name, row in self.rows.items() if needed <= set(row)}

    def find(self, name: str, column: str) -> Any:
        """Returns the value of a place.

        Returns:
            A text; of computed columns the fields of a message.

        Raises:
            ActionError: There is no such place, or it has no such value.
        """
        try:
            row = self.rows[name]
        except KeyError:
            known = shorten(", ".join(self.rows) or "none", 1000)
            raise ActionError(
                f"there is no place {shorten(name)} in {self.where}; there are {known}"
            ) from None
        if name not in self.values_of(column):
            what = "x and y" if column in COMPUTED else column
            raise ActionError(f"the place {shorten(name)} in {self.where} has no {what}")
        if column in COMPUTED:
            x, y, z, theta = (float(row.get(key, "0")) for key in _NUMBERS)
            turned = {"z": math.sin(theta / 2), "w": math.cos(theta / 2)}
            if column == ORIENTATION:
                return turned
            return {"position": {"x": x, "y": y, "z": z}, "orientation": turned}
        return row[column]


def read_places(whole: YamlEntry, key: str) -> PlaceTable:
    """Reads the table, or the waypoint file that the entry names.

    Args:
        whole: The file's mapping.
        key: The key of the table, which need not be there.

    Raises:
        EntryError: It is wrong; the message names the line.
    """
    where = str(whole.file)
    if key not in whole:
        return PlaceTable(where, {})
    if whole.is_scalar(key):
        path = whole.path(key)
        try:
            waypoints = read_waypoints(path)
        except WaypointError as err:
            raise whole.wrong(f"{key}: {err}", key) from err
        return PlaceTable(
            str(path),
            {
                name: {
                    "x": str(one.x), "y": str(one.y), "theta": str(one.theta),
                    "frame": waypoints.frame,
                }
                for name, one in waypoints.places.items()
            },
        )  # fmt: skip
    table = whole.inner(key)
    rows: Dict[str, Mapping[str, str]] = {}
    for name in table.keys:
        row = table.inner(name)
        columns = {column: row.literal(column) for column in row.keys}
        _check_row(row, columns)
        try:
            place = term_text(parse_term(name))
        except TermError as err:
            raise table.wrong(f"{key}: a name has to be a term such as c3: {err}", name) from err
        if place in rows:
            raise table.wrong(f"{key}: {shorten(place)} is there twice; remove one", name)
        rows[place] = columns
    return PlaceTable(where, rows)


def _check_row(row: YamlEntry, columns: Mapping[str, str]) -> None:
    for column in columns:
        if column in COMPUTED:
            raise row.wrong(f"{column} follows from x, y and theta; give this another name", column)
    for column in _NUMBERS:
        row.number(column)
