"""Reads the observers of a file. Needs no ROS.

The package's README has the keys, section "observe.py".
"""

from __future__ import annotations

import math
from functools import partial
from pathlib import Path
from typing import Callable, Dict, Iterator, List, Optional, Tuple

from rosclingo.errors import TermError
from rosclingo.solver.terms import parse_term
from rosoclingo.loop.values.ids import RESERVED
from rosoclingo.loop.words import INFO
from rosoclingo_interfaces.errors import EntryError, WaypointError
from rosoclingo_interfaces.navigation.waypoints import Waypoints, read_waypoints
from rosoclingo_interfaces.observation.closed_way import ClosedWay
from rosoclingo_interfaces.observation.condition_reader import FIELD_CONDITIONS, read_field
from rosoclingo_interfaces.observation.conditions import (
    CovarianceCondition,
    SilenceCondition,
    ValueCondition,
)
from rosoclingo_interfaces.observation.observer import Condition, Observer
from rosoclingo_interfaces.observation.places import NearestWaypoint
from rosoclingo_interfaces.observation.teller import Teller
from rosoclingo_interfaces.observation.term_template import (
    PLACE_VARIABLE,
    VALUE_VARIABLE,
    TermTemplate,
)
from rosoclingo_interfaces.observation.transforms import TransformTree
from rosoclingo_interfaces.observation.yaml_entry import YamlEntry, read_entry

_COVARIANCE = "pose.covariance"
_KEYS = ("topic", "tf", "type", "field", "tell", "else", "id", "debounce", "rate")
_RATE = 1.0  # terms in a second
_LONGEST, _WIDEST = 1000.0, 100.0  # metres of a way that is looked at, which takes memory


def read_observers(file: Path, transforms: TransformTree) -> List[Observer]:
    """Reads a file of observers.

    Args:
        file: Where it is.
        transforms: By which the observers take poses to the waypoints' frame.

    Raises:
        EntryError: Something in it is wrong; the message names the line.
    """
    whole = read_entry(file, "the file of observers", "observers")
    whole.check_keys(("observers",), ("observers",))
    return observers_of(whole, "observers", transforms)


def observers_of(whole: YamlEntry, key: str, transforms: TransformTree) -> List[Observer]:
    """Returns the observers of a list in a file.

    Args:
        whole: The mapping with the list.
        key: The list's key.
        transforms: By which the observers take poses to the waypoints' frame.

    Raises:
        EntryError: Something in it is wrong; the message names the line.
    """
    return [_Builder(entry, transforms).observer() for entry in whole.entries(key)]


class _Builder:
    """Makes an observer of an entry."""

    def __init__(self, entry: YamlEntry, transforms: TransformTree) -> None:
        self._entry = entry
        self._transforms = transforms
        self._makers: Dict[str, Callable[[], Condition]] = {
            **{key: partial(read, entry) for key, read in FIELD_CONDITIONS.items()},
            "value": self._value,
            "covariance": self._covariance,
            "nearest_waypoint": self._nearest_waypoint,
            "closed": self._closed,
            "silent": self._silent,
        }

    def observer(self) -> Observer:
        entry = self._entry
        entry.check_keys((*_KEYS, *self._makers), ("tell",))
        kinds = [key for key in self._makers if key in entry]
        if len(kinds) != 1:
            raise entry.wrong(
                f"expected one condition of {', '.join(self._makers)}, not "
                f"{' and '.join(kinds) or 'none'}",
                kinds[1] if kinds else "",
            )
        (kind,) = kinds
        if ("topic" in entry) == ("tf" in entry):
            raise entry.wrong("expected a topic or tf, and not both", "tf")
        with_field = tuple(key for key in self._makers if key not in ("closed", "silent"))
        for key, users in (("tf", ("nearest_waypoint",)), ("field", with_field)):
            if key in entry and kind not in users:
                raise entry.wrong(f"{key} is for {', '.join(users)} only", key)
        if "tf" in entry and "field" in entry:
            raise entry.wrong("field is for topics only", "field")
        condition = self._makers[kind]()
        teller, terms = self._teller(condition)
        return Observer(
            entry, entry.text("topic"), entry.text("type"), self._source(), condition, teller, terms
        )

    def _teller(self, condition: Condition) -> Tuple[Teller, Tuple[str, ...]]:
        entry = self._entry
        places: Optional[Waypoints] = getattr(condition, "waypoints", None)
        variable = "" if places is None else PLACE_VARIABLE
        names = ("",) if places is None else tuple(places.places)
        if isinstance(condition, ValueCondition):
            variable, names = VALUE_VARIABLE, ()
            if "else" in entry:
                raise entry.wrong("else: a value does not end; remove this", "else")
        tell = self._template("tell", variable)
        terms = [tell.fill(name) for name in names]
        otherwise = self._template("else") if "else" in entry else None
        if otherwise is not None:
            terms.append(otherwise.fill(""))
            if otherwise.fill("") in terms[:-1]:
                raise entry.wrong("else: expected another term than that of tell", "else")
        debounce = entry.number("debounce", unit="seconds")
        rate = entry.number("rate", _RATE, "terms in a second")
        return Teller(tell, otherwise, debounce, rate), tuple(terms)

    def _template(self, key: str, variable: str = "") -> TermTemplate:
        try:
            return TermTemplate.parse(self._entry.text(key), variable)
        except EntryError as err:
            raise self._entry.wrong(f"{key}: {err}", key) from err

    def _source(self) -> str:
        try:
            source = str(parse_term(self._entry.text("id", INFO)))
        except TermError as err:
            raise self._entry.wrong(f"id: {err}", "id") from err
        if source in RESERVED and source != INFO:
            raise self._entry.wrong(f"id: {source} {RESERVED[source]}; give another id", "id")
        return source

    def _value(self) -> ValueCondition:
        inner = self._entry.inner("value")
        inner.check_keys(("times", "step", "hysteresis"))
        step = inner.number("step", 1.0, "the told value")
        if step < 1 or step != int(step):
            raise inner.wrong("step: expected an integer from 1 on", "step")
        return ValueCondition(
            read_field(self._entry, "data"),
            inner.number("times", 1.0),
            int(step),
            inner.number("hysteresis", unit="the told value"),
            is_number=any(key in inner for key in ("times", "step", "hysteresis")),
        )

    def _covariance(self) -> CovarianceCondition:
        inner = self._entry.inner("covariance")
        inner.check_keys(("above", "hysteresis"), ("above",))
        above = inner.number("above", unit="square metres")
        hysteresis = inner.number("hysteresis", unit="square metres")
        return CovarianceCondition(read_field(self._entry, _COVARIANCE), above, hysteresis)

    def _silent(self) -> SilenceCondition:
        seconds = self._entry.number("silent", unit="seconds")
        if not seconds:
            raise self._entry.wrong("silent: expected more than 0 seconds", "silent")
        return SilenceCondition(seconds)

    def _nearest_waypoint(self) -> NearestWaypoint:
        inner = self._entry.inner("nearest_waypoint")
        inner.check_keys(("waypoints", "within", "hysteresis"), ("waypoints", "within"))
        return NearestWaypoint(
            self._waypoints(inner),
            inner.number("within", unit="metres"),
            inner.number("hysteresis", unit="metres"),
            self._transforms,
            read_field(self._entry, "") if "field" in self._entry else None,
            self._child() if "tf" in self._entry else "",
        )

    def _child(self) -> str:
        inner = self._entry.inner("tf")
        inner.check_keys(("child",), ("child",))
        return inner.text("child")

    def _closed(self) -> ClosedWay:
        inner = self._entry.inner("closed")
        inner.check_keys(
            ("waypoints", "from", "to", "width", "radius", "occupied"), ("waypoints", "from", "to")
        )
        waypoints = self._waypoints(inner)
        ends: List[Tuple[float, float]] = list(self._ends(inner, waypoints))
        if ends[0] == ends[1]:
            raise inner.wrong("closed: from and to are at the same place", "to")
        if math.dist(*ends) > _LONGEST:
            raise inner.wrong(f"closed: from and to are more than {_LONGEST:g} m apart", "to")
        width = inner.number("width", 1.0, "metres")
        if not 0 < width <= _WIDEST:
            raise inner.wrong(
                f"width: expected more than 0 metres, and {_WIDEST:g} at most", "width"
            )
        radius = inner.number("radius", 0.2, "metres")
        if radius > _WIDEST:
            raise inner.wrong(f"radius: expected {_WIDEST:g} metres at most", "radius")
        occupied = inner.number("occupied", 65.0, "percent")
        if not 0 < occupied <= 100:
            raise inner.wrong("occupied: expected more than 0 percent, and 100 at most", "occupied")
        return ClosedWay(
            ends[0], ends[1], waypoints.frame, width, radius, occupied, self._transforms
        )

    def _ends(self, inner: YamlEntry, waypoints: Waypoints) -> Iterator[Tuple[float, float]]:
        for key in ("from", "to"):
            try:
                place = waypoints.find(str(parse_term(inner.text(key))))
            except (TermError, WaypointError) as err:
                raise inner.wrong(f"{key}: {err}", key) from err
            yield place.x, place.y

    def _waypoints(self, inner: YamlEntry) -> Waypoints:
        """Reads a waypoint file, whose path begins in the folder of the file of observers."""
        try:
            return read_waypoints(inner.path("waypoints"))
        except WaypointError as err:
            raise inner.wrong(f"waypoints: {err}", "waypoints") from err
