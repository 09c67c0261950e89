"""Reads the observers of a file. Needs no ROS.

The package's README has the keys, section "observe.py".
"""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Callable, Dict, Iterator, List, Optional, Tuple

import numpy as np

from rosclingo.errors import TermError
from rosclingo.solver.terms import parse_term, quote
from rosoclingo.loop.values.ids import RESERVED
from rosoclingo.loop.words import INFO
from rosoclingo_interfaces.errors import EntryError, WaypointError
from rosoclingo_interfaces.navigation.waypoints import Waypoints, read_waypoints
from rosoclingo_interfaces.observation.closed_way import ClosedWay
from rosoclingo_interfaces.observation.conditions import (
    CovarianceCondition,
    EqualsCondition,
    PatternCondition,
    RangeCondition,
    SilenceCondition,
)
from rosoclingo_interfaces.observation.fields import FieldPath
from rosoclingo_interfaces.observation.observer import Condition, Observer
from rosoclingo_interfaces.observation.places import NearestWaypoint
from rosoclingo_interfaces.observation.teller import Teller
from rosoclingo_interfaces.observation.term_template import TermTemplate
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
    whole = read_entry(file)
    whole.check_keys(("observers",), ("observers",))
    return [_Builder(entry, transforms).observer() for entry in whole.entries("observers")]


class _Builder:
    """Makes an observer of an entry."""

    def __init__(self, entry: YamlEntry, transforms: TransformTree) -> None:
        self._entry = entry
        self._transforms = transforms
        self._makers: Dict[str, Callable[[], Condition]] = {
            "range": self._range,
            "pattern": self._pattern,
            "equals": self._equals,
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
        tell = self._template("tell", places is not None)
        names = ("",) if places is None else tuple(places.places)
        terms = [tell.fill(name) for name in names]
        otherwise = self._template("else", False) if "else" in entry else None
        if otherwise is not None:
            terms.append(otherwise.fill(""))
            if otherwise.fill("") in terms[:-1]:
                raise entry.wrong("else: expected another term than that of tell", "else")
        debounce = entry.number("debounce", unit="seconds")
        rate = entry.number("rate", _RATE, "terms in a second")
        return Teller(tell, otherwise, debounce, rate), tuple(terms)

    def _template(self, key: str, has_waypoint: bool) -> TermTemplate:
        try:
            return TermTemplate.parse(self._entry.text(key), has_waypoint)
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

    def _field(self, default: str) -> FieldPath:
        try:
            return FieldPath.parse(self._entry.text("field", default))
        except EntryError as err:
            raise self._entry.wrong(err, "field") from err

    def _range(self) -> RangeCondition:
        inner = self._entry.inner("range")
        inner.check_keys(("below", "above", "from", "to", "hysteresis"))
        given = {key for key in ("below", "above", "from", "to") if key in inner}
        if given not in ({"below"}, {"above"}, {"from", "to"}):
            raise inner.wrong("range: expected below, or above, or from and to")
        low, high = inner.number("from", -math.inf), inner.number("to", math.inf)
        # A bound itself is outside, as the words say it.
        if "above" in inner:
            low = float(np.nextafter(inner.number("above"), math.inf))
        if "below" in inner:
            high = float(np.nextafter(inner.number("below"), -math.inf))
        if low > high:
            raise inner.wrong("range: from is greater than to", "from")
        hysteresis = inner.number("hysteresis", unit="the field's unit")
        return RangeCondition(self._field("data"), low, high, hysteresis)

    def _pattern(self) -> PatternCondition:
        text = self._entry.text("pattern")
        try:
            return PatternCondition(self._field("data"), re.compile(text))
        except re.error as err:
            raise self._entry.wrong(
                f"pattern: expected a regular expression: {quote(text)}: {err}", "pattern"
            ) from err

    def _equals(self) -> EqualsCondition:
        return EqualsCondition(self._field("data"), self._entry.scalar("equals"))

    def _covariance(self) -> CovarianceCondition:
        inner = self._entry.inner("covariance")
        inner.check_keys(("above", "hysteresis"), ("above",))
        above = inner.number("above", unit="square metres")
        hysteresis = inner.number("hysteresis", unit="square metres")
        return CovarianceCondition(self._field(_COVARIANCE), above, hysteresis)

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
            self._field("") if "field" in self._entry else None,
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
            return read_waypoints(inner.file.parent / Path(inner.text("waypoints")).expanduser())
        except WaypointError as err:
            raise inner.wrong(f"waypoints: {err}", "waypoints") from err
