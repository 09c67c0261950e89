"""Parses the entries of a file of faults; :mod:`.source` reads the file."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Callable, Dict, Mapping, Optional, Tuple, Union

from rosclingo.errors import TermError
from rosclingo.solver.terms import parse_term
from rosoclingo_interfaces.errors import WaypointError
from rosoclingo_interfaces.navigation.waypoints import Waypoints
from rosoclingo_simulator.faults.kinds import (
    AtPlace,
    AtTime,
    BatteryModel,
    ByChance,
    ClosedDoor,
    Fault,
    FaultEffect,
    FaultPlan,
    FaultTrigger,
    WrongPose,
)
from rosoclingo_simulator.faults.source import FaultValue, load_faults
from rosoclingo_simulator.physics.faulty import Disturbance
from rosoclingo_simulator.physics.obstacles import PassageEnd
from rosoclingo_simulator.physics.physics import Pose

_WITHIN = 1.0  # metres from a place, unless an entry says otherwise
_FARTHEST = 1e6  # metres and radians; more is a typing error, and overflows later
_AT_CHARGER = 0.5  # metres from the place where a battery is charged

_Entries = Dict[str, FaultValue]
_Reader = Callable[[FaultValue, _Entries, Waypoints], FaultEffect]


def read_faults(faults: Union[Path, Mapping[str, Any]], waypoints: Waypoints) -> FaultPlan:
    """Reads faults.

    Args:
        faults: A YAML file, or its content, such as a parameter has it.
        waypoints: The places that it may name.

    Raises:
        FaultError: The file cannot be read, or something in it is wrong; the message says where.
    """
    top = load_faults(faults) if isinstance(faults, Path) else FaultValue("~faults", dict(faults))
    entries = top.entries("seed", "faults")
    if "faults" not in entries:
        raise top.wrong("faults is missing; add a list, such as faults: [{fault: slip}]")
    seed = entries["seed"].integer(0) if "seed" in entries else 0
    items = entries["faults"].items()
    return FaultPlan(
        seed, tuple(_fault(item, number, waypoints) for number, item in enumerate(items, start=1))
    )


def _fault(item: FaultValue, number: int, waypoints: Waypoints) -> Fault:
    item = item.called(f"fault {number}")
    value = item.value
    if not isinstance(value, dict) or "fault" not in value:
        raise item.wrong("expected an entry such as {fault: slip, when: {time: 20}, lasts: 10}")
    kind = str(value["fault"])
    if kind not in _KINDS:
        raise item.wrong(f"there is no fault {kind!r:.80}; there are {', '.join(_KINDS)}")
    item = item.called(f"fault {number} ({kind})")
    keys, read = _KINDS[kind]
    # Whether a battery is empty is a matter of its charge.
    schedule = () if kind == "battery" else ("when", "lasts")
    entries = item.entries("fault", "robot", *schedule, *keys)
    effect = read(item, entries, waypoints)
    trigger: Optional[FaultTrigger] = None
    times = 1_000_000
    if schedule:
        trigger, times = _trigger(entries, waypoints)
    return Fault(
        number=number,
        kind=kind,
        where=item.where,
        robot=entries["robot"].text() if "robot" in entries else None,
        trigger=trigger,
        times=times,
        lasts=entries["lasts"].positive() if "lasts" in entries else None,
        effect=effect,
    )


def _trigger(fault: _Entries, waypoints: Waypoints) -> Tuple[FaultTrigger, int]:
    if "when" not in fault:
        return AtTime(0.0), 1
    when = fault["when"]
    entries = when.entries("time", "place", "within", "probability", "per", "times")
    given = [key for key in ("time", "place", "probability") if key in entries]
    if len(given) != 1:
        raise when.wrong(f"expected one of time, place and probability, not {len(given)}")
    for key, needs in (("within", "place"), ("per", "probability")):
        if key in entries and given != [needs]:
            raise entries[key].wrong(f"goes with {needs} only; leave it out")
    if given == ["time"]:
        if "times" in entries:
            raise entries["times"].wrong("a time comes once; leave it out, or add an entry")
        return AtTime(entries["time"].number(0.0)), 1
    times = entries["times"].integer(1) if "times" in entries else 1
    if given == ["place"]:
        return _place(entries["place"], entries.get("within"), _WITHIN, waypoints), times
    per = entries["per"].choice("second", "metre") if "per" in entries else "second"
    return ByChance(entries["probability"].number(0.0, 1.0), per == "metre"), times


def _slip(_: FaultValue, entries: _Entries, __: Waypoints) -> Disturbance:
    return Disturbance(slip=_number(entries, "loss", 0.5, 1.0))


def _stuck_wheel(item: FaultValue, entries: _Entries, _: Waypoints) -> Disturbance:
    if "wheel" not in entries:
        raise item.wrong("wheel is missing; add left, right or both")
    wheel = entries["wheel"].choice("left", "right", "both")
    return Disturbance(left_stuck=wheel != "right", right_stuck=wheel != "left")


def _laser_noise(_: FaultValue, entries: _Entries, __: Waypoints) -> Disturbance:
    return Disturbance(
        laser_sigma=_number(entries, "sigma", 0.0, _FARTHEST),
        dropout=_number(entries, "dropout", 0.0, 1.0),
    )


def _odometry_noise(_: FaultValue, entries: _Entries, __: Waypoints) -> Disturbance:
    return Disturbance(odometry_sigma=_number(entries, "sigma", 0.05, _FARTHEST))


def _wrong_pose(item: FaultValue, entries: _Entries, waypoints: Waypoints) -> WrongPose:
    if ("by" in entries) == ("carried_to" in entries):
        raise item.wrong("expected one of by, such as {x: 1}, and carried_to, such as c5")
    lost = entries["lost"].flag() if "lost" in entries else False
    if "by" in entries:
        return WrongPose(_coordinates(entries["by"]), None, lost)
    return WrongPose(None, _pose(entries["carried_to"], waypoints), lost)


def _closed_door(item: FaultValue, entries: _Entries, waypoints: Waypoints) -> ClosedDoor:
    if "between" not in entries:
        raise item.wrong("between is missing; add two places, such as [c1, o1]")
    ends = entries["between"].items()
    if len(ends) != 2:
        raise entries["between"].wrong(f"expected two places, not {len(ends)}")
    first, second = (_passage_end(end, _pose(end, waypoints)) for end in ends)
    return ClosedDoor((first, second))


def _passage_end(value: FaultValue, pose: Pose) -> PassageEnd:
    name = value.value if isinstance(value.value, str) else f"({pose.x:g}, {pose.y:g})"
    return PassageEnd(name, pose)


def _battery(_: FaultValue, entries: _Entries, waypoints: Waypoints) -> BatteryModel:
    charger = entries.get("charging_place")
    within = entries.get("within")
    if charger is None and within is not None:
        raise within.wrong("goes with charging_place only; leave it out")
    return BatteryModel(
        capacity=entries["capacity"].positive() if "capacity" in entries else 2.2,
        level=_number(entries, "level", 1.0, 1.0),
        per_second=_number(entries, "per_second", 0.0001, 1.0),
        per_metre=_number(entries, "per_metre", 0.0005, 1.0),
        charging_place=(
            None if charger is None else _place(charger, within, _AT_CHARGER, waypoints)
        ),
        charging=_number(entries, "charging", 0.005, 1.0),
    )


_KINDS: Dict[str, Tuple[Tuple[str, ...], _Reader]] = {
    "slip": (("loss",), _slip),
    "stuck_wheel": (("wheel",), _stuck_wheel),
    "wrong_pose": (("by", "carried_to", "lost"), _wrong_pose),
    "laser_noise": (("sigma", "dropout"), _laser_noise),
    "odometry_noise": (("sigma",), _odometry_noise),
    "door_closes": (("between",), _closed_door),
    "battery": (
        ("capacity", "level", "per_second", "per_metre", "charging_place", "within", "charging"),
        _battery,
    ),
}


def _number(entries: _Entries, key: str, default: float, most: float) -> float:
    return entries[key].number(0.0, most) if key in entries else default


def _place(
    value: FaultValue, within: Optional[FaultValue], default: float, waypoints: Waypoints
) -> AtPlace:
    metres = default if within is None else within.positive()
    return AtPlace(_pose(value, waypoints), metres)


def _pose(value: FaultValue, waypoints: Waypoints) -> Pose:
    """Returns the pose of a waypoint's name, or of coordinates."""
    if isinstance(value.value, dict):
        for key in ("x", "y"):
            if key not in value.value:
                raise value.wrong(f"{key} is missing; add it")
        return _coordinates(value)
    try:
        return waypoints.find(str(parse_term(value.text())))
    except TermError as err:
        raise value.wrong(f"{value.value!r:.80} is no waypoint: {err}") from err
    except WaypointError as err:
        raise value.wrong(err) from err


def _coordinates(value: FaultValue) -> Pose:
    entries = value.entries("x", "y", "theta")
    return Pose(
        *(
            entries[key].number(-_FARTHEST, _FARTHEST) if key in entries else 0.0
            for key in ("x", "y", "theta")
        )
    )
