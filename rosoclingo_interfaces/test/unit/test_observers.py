"""Files of observers, their conditions, and when what is told. Messages are plain objects here."""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any, List, Mapping, Optional, Sequence

import pytest

from rosoclingo_interfaces.errors import EntryError, ReadingError
from rosoclingo_interfaces.observation.observer import Observer
from rosoclingo_interfaces.observation.observers import read_observers
from rosoclingo_interfaces.observation.transforms import MOST_FRAMES, TransformTree
from rosoclingo_interfaces.observation.vocabulary import unknown_terms

PLACES = """frame: map
waypoints:
  a: {x: 0, y: 0, theta: 0}
  b: {x: 4, y: 0, theta: 0}
  c(1): {x: 0, y: 4, theta: 0}
"""

TYPES: Mapping[str, Mapping[str, str]] = {
    "std_msgs/Bool": {"data": "bool"},
    "std_msgs/String": {"data": "string"},
    "std_msgs/Int32": {"data": "int32"},
    "sensor_msgs/BatteryState": {"percentage": "float32", "cell_voltage": "float32[]"},
    "geometry_msgs/PoseWithCovarianceStamped": {
        "header": "std_msgs/Header",
        "pose": "geometry_msgs/PoseWithCovariance",
    },
    "geometry_msgs/PoseWithCovariance": {"pose": "geometry_msgs/Pose", "covariance": "float64[36]"},
    "geometry_msgs/Pose": {"position": "geometry_msgs/Point"},
    "geometry_msgs/Point": {"x": "float64"},
    "some_msgs/Places": {"poses": "geometry_msgs/Pose[]"},
}


class Clock:
    """Observers of a file, with a clock that a test sets; collects what they tell."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.tree = TransformTree()
        self.now = 100.0
        (folder / "places.yaml").write_text(PLACES)

    def read(self, text: str) -> List[Observer]:
        file = self.folder / "observers.yaml"
        file.write_text(text)
        return read_observers(file, self.tree)

    def observer(self, *lines: str) -> Observer:
        (observer,) = self.read("observers:\n- " + "\n  ".join(lines))
        return observer

    def tells(self, observer: Observer, message: Any, seconds: float = 2.0) -> Optional[str]:
        """Returns what is told after a message, which comes after some time."""
        self.now += seconds
        observer.hear(message, self.now)
        return observer.tick(self.now)


@pytest.fixture
def clock(tmp_path: Path) -> Clock:
    return Clock(tmp_path)


def data(value: Any) -> SimpleNamespace:
    return SimpleNamespace(data=value)


def rotated(angle: float) -> SimpleNamespace:
    return SimpleNamespace(x=0.0, y=0.0, z=math.sin(angle / 2), w=math.cos(angle / 2))


def pose(x: float, y: float, frame: str = "map", angle: float = 0.0) -> SimpleNamespace:
    return SimpleNamespace(
        _type="geometry_msgs/PoseStamped",
        header=SimpleNamespace(frame_id=frame),
        pose=SimpleNamespace(position=SimpleNamespace(x=x, y=y, z=0.0), orientation=rotated(angle)),
    )


def transform(frame: str, child: str, x: float, y: float, angle: float = 0.0) -> SimpleNamespace:
    return SimpleNamespace(
        header=SimpleNamespace(frame_id=frame),
        child_frame_id=child,
        transform=SimpleNamespace(
            translation=SimpleNamespace(x=x, y=y, z=0.0), rotation=rotated(angle)
        ),
    )


def scan(ranges: Sequence[float], **more: float) -> SimpleNamespace:
    """As a scanner sees it that has its beams from straight ahead on, in the frame ``scan``."""
    fields = {
        "angle_min": 0.0,
        "angle_increment": 2 * math.pi / max(1, len(ranges)),
        "range_min": 0.1,
        "range_max": 10.0,
    }
    return SimpleNamespace(
        _type="sensor_msgs/LaserScan",
        header=SimpleNamespace(frame_id="scan"),
        ranges=ranges,
        **{**fields, **more},
    )


def grid(
    values: Mapping[int, int], width: int = 60, height: int = 20, **more: Any
) -> SimpleNamespace:
    """A costmap of cells of 0.1 m around the way, some columns in another value."""
    row = [values.get(column, 0) for column in range(width)]
    origin = SimpleNamespace(
        position=SimpleNamespace(x=-1.0, y=-1.0, z=0.0), orientation=rotated(0.0)
    )
    info = SimpleNamespace(resolution=0.1, width=width, height=height, origin=origin)
    message = SimpleNamespace(
        _type="nav_msgs/OccupancyGrid",
        header=SimpleNamespace(frame_id="map"),
        info=info,
        data=row * height,
    )
    vars(message).update(more)
    return message


HEAD = "observers:\n- topic: t\n  tell: x\n"
NEAREST = "observers:\n- topic: t\n  tell: at(W)\n  nearest_waypoint: "
CLOSED = "observers:\n- topic: t\n  tell: x\n  closed: "


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        ("", 1, "the file is empty; it needs the key observers"),
        ("- 1", 1, "expected a mapping"),
        ("observer: []", 1, "unknown key 'observer'; there are observers"),
        ("observers: []", 1, "expected a list with one entry or more"),
        ("observers: [1]", 1, "expected a mapping"),
        ("observers:\n- {", 2, "it is no YAML"),
        ("observers:\n- " + "[" * 99, 2, "it is no YAML: it is nested too deeply"),
        ("observers:\n- ? [a]\n  : 1", 2, "expected a name as the key"),
        ("observers: &a [*a]", 1, "it is no YAML: it holds itself by an alias"),
        (HEAD + "  silent: 1\n  topic: u", 5, "topic is there twice; remove one"),
        (HEAD + "  silent: 1\n  rates: 2", 5, "unknown key 'rates'; there are topic, tf, type"),
        ("observers:\n- topic: t\n  silent: 1", 2, "the key tell is missing"),
        (HEAD, 2, "expected one condition of range, pattern, equals"),
        (HEAD + "  equals: 1\n  silent: 1", 5, "not equals and silent"),
        ("observers:\n- tell: x\n  equals: 1", 2, "expected a topic or tf, and not both"),
        (HEAD + "  equals: 1\n  tf: {child: r}", 5, "expected a topic or tf, and not both"),
        ("observers:\n- tf: {child: r}\n  tell: x\n  equals: 1", 2, "tf is for nearest_waypoint"),
        (HEAD + "  silent: 1\n  field: data", 5, "field is for range, pattern, equals"),
        (HEAD + "  equals: 1\n  field: a..b", 5, "field: expected names such as"),
        (HEAD + "  equals: 1\n  field: a[-1]", 5, "field: expected names such as"),
        (HEAD + "  equals: 1.5", 4, "equals: expected true, false, an integer or a text"),
        (HEAD + "  equals: [1]", 4, "equals: expected a text"),
        (HEAD + "  equals:", 4, "equals: expected true, false, an integer or a text"),
        (HEAD + "  equals: !!int ''", 4, "equals: expected an integer such as 3"),
        (HEAD + "  equals: !!bool ''", 4, "equals: expected true, false, an integer or a text"),
        (HEAD + "  silent: 0", 4, "silent: expected more than 0 seconds"),
        (HEAD + "  silent: soon", 4, "silent: expected a number of seconds from 0 on"),
        (HEAD + "  silent: .nan", 4, "silent: expected a number of seconds from 0 on"),
        (HEAD + "  silent: 1\n  debounce: -1", 5, "debounce: expected a number of seconds"),
        (HEAD + "  silent: 1\n  rate: {}", 5, "rate: expected a number of terms in a second"),
        (HEAD + "  silent: 1\n  id: Info", 5, "id: 'Info' is not a ground term"),
        (HEAD + "  silent: 1\n  id: commit", 5, "id: commit stands for what was published"),
        (HEAD + "  silent: 1\n  else: x", 5, "else: expected another term than that of tell"),
        (HEAD + "  silent: 1\n  else: y(W)", 5, "else: 'y(W)': W stands for a waypoint in tell"),
        (HEAD + "  silent: 1\n  else: 'y('", 5, "else: 'y(' cannot be told"),
        ("observers:\n- topic: t\n  tell: x(U)\n  silent: 1", 3, "tell: 'x(U)' cannot be told"),
        ("observers:\n- topic: t\n  tell: x(V)\n  silent: 1", 3, "V stands for a value in tell of"),
        (HEAD + "  value: {}", 3, "does not say which value: write V for it, such as battery(V)"),
        (HEAD.replace("x", "x(V)") + "  value: 1", 4, "value: expected a mapping"),
        (HEAD.replace("x", "x(V)") + "  value: {steps: 1}", 4, "unknown key 'steps'; there"),
        (HEAD.replace("x", "x(V)") + "  value: {step: 0.5}", 4, "step: expected an integer from 1"),
        (HEAD.replace("x", "x(V)") + "  value: {}\n  else: y", 5, "else: a value does not end"),
        (HEAD + "  pattern: '('", 4, "pattern: expected a regular expression: '('"),
        (HEAD + "  range: 3", 4, "range: expected a mapping"),
        (HEAD + "  range: {}", 4, "range: expected below, or above, or from and to"),
        (HEAD + "  range: {below: 1, above: 0}", 4, "range: expected below, or above, or"),
        (HEAD + "  range:\n    from: 2\n    to: 1", 5, "range: from is greater than to"),
        (HEAD + "  range: {below: 1, hysteresis: -1}", 4, "hysteresis: expected a number of"),
        (HEAD + "  covariance: {}", 4, "the key above of covariance is missing"),
        (HEAD + "  covariance: {above: x}", 4, "above: expected a number of square metres"),
        (NEAREST + "{waypoints: places.yaml}", 4, "the key within of nearest_waypoint is missing"),
        (NEAREST + "{waypoints: ~no_such_user/x, within: 1}", 4, "waypoints: Could not determine"),
        (NEAREST + "{waypoints: no.yaml, within: 1}", 4, "cannot read the waypoint file"),
        (NEAREST + f"{{waypoints: {'x' * 9000}, within: 1}}", 4, "cannot read the waypoint file"),
        (NEAREST.replace("at(W)", "at(a)") + "{waypoints: places.yaml, within: 1}", 3, "write W"),
        (CLOSED + "{waypoints: places.yaml, from: a, to: d}", 4, "there is no waypoint d"),
        (CLOSED + "{waypoints: places.yaml, from: a, to: a}", 4, "are at the same place"),
        (CLOSED + "{waypoints: places.yaml, from: a, to: 'b('}", 4, "to: 'b(' is not a ground"),
        (CLOSED + "{waypoints: places.yaml, from: a, to: b, width: 0}", 4, "width: expected more"),
        (CLOSED + "{waypoints: places.yaml, from: a, to: b, width: 1.0e+300}", 4, "100 at most"),
        (CLOSED + "{waypoints: places.yaml, from: a, to: b, radius: 1.0e+300}", 4, "100 metres at"),
        (CLOSED + "{waypoints: places.yaml, from: a, to: b, occupied: 0}", 4, "occupied: expected"),
        ("observers:\n- tf: {}\n  tell: at(W)\n  nearest_waypoint: "
         "{waypoints: places.yaml, within: 1}", 2, "the key child of tf is missing"),
    ],
)  # fmt: skip
def test_each_mistake_is_refused_by_line(clock: Clock, text: str, line: int, message: str) -> None:
    with pytest.raises(EntryError) as raised:
        clock.read(text)
    said = str(raised.value)
    assert len(said) < 3000
    assert said.startswith(f"{clock.folder / 'observers.yaml'}, line {line}: ")
    assert message in said


def test_files_that_cannot_be_read(clock: Clock) -> None:
    with pytest.raises(EntryError, match="cannot read the file of observers"):
        read_observers(clock.folder / "none.yaml", clock.tree)
    (clock.folder / "deep.yaml").write_text("[" * 1500)
    with pytest.raises(EntryError, match="nested too deeply"):
        read_observers(clock.folder / "deep.yaml", clock.tree)
    (clock.folder / "bytes.yaml").write_bytes(b"\xff")
    with pytest.raises(EntryError, match="cannot read the file of observers"):
        read_observers(clock.folder / "bytes.yaml", clock.tree)


@pytest.mark.parametrize(
    ("condition", "field", "kind", "message"),
    [
        ("equals: true", "data", "std_msgs/Bool", ""),
        ("equals: true", "data", "std_msgs/Int32", "is int32; a truth value is needed"),
        ("equals: 3", "data", "std_msgs/Int32", ""),
        ("equals: 3", "data", "std_msgs/String", "is string; an integer is needed"),
        ("equals: door", "data", "std_msgs/String", ""),
        ("pattern: door", "data", "std_msgs/Bool", "is bool; a text is needed"),
        ("range: {below: 1}", "percentage", "sensor_msgs/BatteryState", ""),
        ("range: {below: 1}", "cell_voltage[*]", "sensor_msgs/BatteryState", ""),
        ("range: {below: 1}", "cell_voltage", "sensor_msgs/BatteryState", "write [*] behind"),
        (
            "range: {below: 1}", "level", "sensor_msgs/BatteryState",
            "has no field level; there are: percentage, cell_voltage",
        ),
        ("range: {below: 1}", "data.x", "std_msgs/Bool", "bool has no fields, such as x"),
        ("range: {below: 1}", "data[0]", "std_msgs/Int32", "data is no list, but int32"),
        (
            "covariance: {above: 1}", "pose.covariance",
            "geometry_msgs/PoseWithCovarianceStamped", "",
        ),
        ("covariance: {above: 1}", "data", "std_msgs/Int32", "a covariance matrix is needed"),
        (
            "range: {below: 1}", "pose.covariance[36]",
            "geometry_msgs/PoseWithCovarianceStamped", "covariance has 36 entries, from 0 on",
        ),
    ],
)  # fmt: skip
def test_fields_are_checked_against_types(
    clock: Clock, condition: str, field: str, kind: str, message: str
) -> None:
    observer = clock.observer("topic: t", "tell: x", condition, f"field: {field}")
    if not message:
        observer.check(kind, TYPES.get)
        return
    with pytest.raises(EntryError) as raised:
        observer.check(kind, TYPES.get)
    assert f"observers.yaml, line 5: field: {field}" in str(raised.value)
    assert message in str(raised.value)


def test_types_of_poses_and_ways_are_checked(clock: Clock) -> None:
    lines = ["topic: t", "tell: at(W)", "nearest_waypoint: {waypoints: places.yaml, within: 1}"]
    clock.observer(*lines).check("nav_msgs/Odometry", TYPES.get)
    with pytest.raises(EntryError, match="line 2: std_msgs/Bool is none of geometry_msgs/"):
        clock.observer(*lines).check("std_msgs/Bool", TYPES.get)
    clock.observer(*lines, "field: poses[0]").check("some_msgs/Places", TYPES.get)
    with pytest.raises(EntryError, match=r"line 5: field: poses of .*Pose\[\]; geometry"):
        clock.observer(*lines, "field: poses").check("some_msgs/Places", TYPES.get)
    way = clock.observer("topic: t", "tell: x", "closed: {waypoints: places.yaml, from: a, to: b}")
    way.check("sensor_msgs/LaserScan", TYPES.get)
    with pytest.raises(EntryError, match="line 2: closed needs a topic of sensor_msgs/Laser"):
        way.check("std_msgs/Bool", TYPES.get)


def test_a_range_with_hysteresis(clock: Clock) -> None:
    observer = clock.observer(
        "topic: t", "tell: battery(low)", "else: battery(ok)",
        "range: {below: 0.2, hysteresis: 0.1}",
    )  # fmt: skip
    values = [0.5, 0.2, 0.19, 0.29, 0.31, 0.25, 0.1]
    assert [clock.tells(observer, data(value)) for value in values] == [
        None, None, "battery(low)", None, "battery(ok)", None, "battery(low)",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("condition", "held", "others"),
    [
        ("{above: 3}", [3.1, 9], [3, -4]),
        ("{from: 1, to: 2}", [1, 1.5, 2], [0.9, 2.1]),
        ("{below: -1}", [-2], [-1, 0]),
    ],
)
def test_ranges(
    clock: Clock, condition: str, held: Sequence[float], others: Sequence[float]
) -> None:
    observer = clock.observer("topic: t", "tell: x", "else: y", f"range: {condition}")
    for value in held:
        assert clock.tells(observer, data(value)) == "x"
        assert clock.tells(observer, data(others[0])) == "y"
    for value in others:
        assert clock.tells(observer, data(value)) is None


def test_lists_of_numbers(clock: Clock) -> None:
    near = clock.observer(
        "topic: t", "tell: near", "else: far", "range: {below: 0.5}", "field: data[*]"
    )
    assert clock.tells(near, data([math.nan, 0.4, math.inf])) == "near"
    assert clock.tells(near, data([math.inf, math.nan])) == "far"
    with pytest.raises(ReadingError, match="has no number"):
        near.hear(data([math.nan]), clock.now)
    with pytest.raises(ReadingError, match="has no number"):
        near.hear(data([]), clock.now)
    second = clock.observer("topic: t", "tell: x", "range: {below: 0.5}", "field: data[1]")
    assert clock.tells(second, data([1, 0])) == "x"
    with pytest.raises(ReadingError, match="data has no entry 1"):
        second.hear(data([0]), clock.now)


def test_equality_and_patterns(clock: Clock) -> None:
    closed = clock.observer("topic: t", "tell: closed(d1)", "else: open(d1)", "equals: true")
    values = [False, True, True, False]
    expected = [None, "closed(d1)", None, "open(d1)"]
    assert [clock.tells(closed, data(value)) for value in values] == expected
    for words in ("equals: ''", 'equals: ""', "equals: !!str"):
        nothing = clock.observer("topic: t", "tell: no_text", "else: text", words)
        said = [clock.tells(nothing, data(value)) for value in ("x", "", "", " ")]
        assert said == [None, "no_text", None, "text"]
    text = clock.observer("topic: t", "tell: seen", "pattern: ^person")
    assert clock.tells(text, data("no person")) is None
    assert clock.tells(text, data("person 3")) == "seen"
    with pytest.raises(ReadingError, match="more than 10000 characters"):
        text.hear(data("person" * 10_000), clock.now)


def test_a_covariance(clock: Clock) -> None:
    """The longest axis of the ellipse counts, wherever it points."""
    lost = clock.observer(
        "topic: t", "tell: lost", "else: found", "covariance: {above: 1, hysteresis: 0.5}",
        "field: data",
    )  # fmt: skip

    def matrix(x: float, y: float, mixed: float = 0.0, row: int = 6) -> SimpleNamespace:
        values = [0.0] * row**2
        values[0], values[row + 1], values[1], values[row] = x, y, mixed, mixed
        return data(values)

    assert clock.tells(lost, matrix(0.9, 0.9)) is None
    assert clock.tells(lost, matrix(0.9, 0.9, 0.3)) == "lost"
    assert clock.tells(lost, matrix(0.1, 0.6)) is None
    assert clock.tells(lost, matrix(0.1, 0.4)) == "found"
    assert clock.tells(lost, matrix(0, 2, row=3)) == "lost"
    for wrong in (matrix(math.nan, 1), matrix(-1, 9), matrix(1, math.inf), data([1.0] * 5)):
        with pytest.raises(ReadingError):
            lost.hear(wrong, clock.now)


def test_a_way_that_is_too_long(clock: Clock) -> None:
    far = PLACES.replace("y: 4", "y: 90000")
    (clock.folder / "places.yaml").write_text(far)
    with pytest.raises(EntryError, match=r"closed: from and to are more than 1000 m apart"):
        clock.observer("topic: t", "tell: x", "closed: {waypoints: places.yaml, from: a, to: c(1)}")


def test_the_nearest_waypoint(clock: Clock) -> None:
    at = clock.observer(
        "topic: t", "tell: at(mailbot,W)", "else: between",
        "nearest_waypoint: {waypoints: places.yaml, within: 1, hysteresis: 0.5}",
    )  # fmt: skip
    assert at.terms == ("at(mailbot,a)", "at(mailbot,b)", "at(mailbot,c(1))", "between")
    places = [(2, 2), (0.9, 0), (1.4, 0), (1.6, 0), (1.4, 0), (3.2, 0), (0, 3.5)]
    assert [clock.tells(at, pose(x, y)) for x, y in places] == [
        None, "at(mailbot,a)", None, "between", None, "at(mailbot,b)", "at(mailbot,c(1))",
    ]  # fmt: skip


def test_between_two_waypoints_that_are_near(clock: Clock) -> None:
    """The nearest one changes only if another is nearer by the hysteresis."""
    at = clock.observer(
        "topic: t", "tell: at(W)",
        "nearest_waypoint: {waypoints: places.yaml, within: 3, hysteresis: 0.5}",
    )  # fmt: skip
    places = [1.9, 2.1, 2.2, 2.3, 1.8, 1.7]
    expected = ["at(a)", None, None, "at(b)", None, "at(a)"]
    assert [clock.tells(at, pose(x, 0)) for x in places] == expected


def test_poses_in_other_frames(clock: Clock) -> None:
    at = clock.observer(
        "topic: t", "tell: at(W)", "nearest_waypoint: {waypoints: places.yaml, within: 0.1}"
    )
    with pytest.raises(ReadingError, match="no transform from 'odom' to 'map' has come on /tf"):
        at.hear(pose(0, 1, "odom"), clock.now)
    # One that looks to the left, 3 m ahead of the origin: (0, -1) there is (4, 0) here.
    clock.tree.add(transform("/map", "odom", 3, 0, math.pi / 2))
    assert clock.tells(at, pose(0, -1, "odom")) == "at(b)"
    assert clock.tells(at, pose(0, 0, "/map")) == "at(a)"


def test_a_robot_by_its_transforms(clock: Clock) -> None:
    at = clock.observer(
        "tf: {child: base_link}", "tell: at(W)",
        "nearest_waypoint: {waypoints: places.yaml, within: 0.1}",
    )  # fmt: skip
    clock.tree.add(transform("map", "odom", 3, 0, math.pi / 2))
    clock.tree.add(transform("base", "base_link", 0, 0))
    with pytest.raises(ReadingError, match="no transform"):
        at.hear(None, clock.now)
    clock.tree.add(transform("odom", "base", 0, -1))
    assert clock.tells(at, None) == "at(b)"
    clock.tree.add(transform("base_link", "map", 0, 0))
    with pytest.raises(ReadingError, match="go in a circle"):
        at.hear(None, clock.now)


def test_transforms_that_make_no_sense(clock: Clock) -> None:
    wrong = [
        transform("map", "", 0, 0), transform("map", "/map", 0, 0),
        transform("map", "odom", math.nan, 0), transform("map", "odom", 0, 1e300),
    ]  # fmt: skip
    for message in wrong:
        with pytest.raises(ReadingError):
            clock.tree.add(message)
    flat = transform("map", "odom", 0, 0)
    flat.transform.rotation.w = 0.0
    with pytest.raises(ReadingError, match="a quaternion has the length 0"):
        clock.tree.add(flat)
    for number in range(MOST_FRAMES):
        clock.tree.add(transform("map", f"f{number}", 0, 0))
    with pytest.raises(ReadingError, match="there are more than 10000 frames"):
        clock.tree.add(transform("map", "one_more", 0, 0))
    clock.tree.add(transform("map", "f3", 1, 0))


def test_a_way_on_a_costmap(clock: Clock) -> None:
    way = clock.observer(
        "topic: t", "tell: closed", "else: open",
        "closed: {waypoints: places.yaml, from: a, to: b, radius: 0.1}",
    )  # fmt: skip
    assert clock.tells(way, grid({})) is None
    assert clock.tells(way, grid({30: 64})) is None
    assert clock.tells(way, grid({30: 100})) == "closed"
    assert clock.tells(way, grid({30: -1})) is None  # nobody knows: what was known counts
    assert clock.tells(way, grid({})) == "open"
    gap = grid({30: 100})
    for row in range(8, 13):  # half a metre in the middle
        gap.data[row * 60 + 30] = 0
    assert clock.tells(way, gap) is None
    for row in (8, 9, 12):
        gap.data[row * 60 + 30] = 100
    assert clock.tells(way, gap) == "closed"  # 0.2 m are too narrow
    elsewhere = grid({})
    elsewhere.info.origin.position.x = 50.0
    assert clock.tells(way, elsewhere) is None
    for wrong in (grid({}, data=[0]), grid({}, info=SimpleNamespace(
        resolution=0.0, width=60, height=20, origin=grid({}).info.origin
    ))):  # fmt: skip
        with pytest.raises(ReadingError, match="a costmap of 60 x 20 cells"):
            way.hear(wrong, clock.now)


def test_a_way_that_a_laser_sees(clock: Clock) -> None:
    """The robot stands 1 m before a, and looks away from b."""
    way = clock.observer(
        "topic: t", "tell: closed", "else: open", "closed: {waypoints: places.yaml, from: a, to: b}"
    )
    free = [math.inf] * 360
    with pytest.raises(ReadingError, match="no transform from 'map' to 'scan'"):
        way.hear(scan(free), clock.now)
    clock.tree.add(transform("map", "scan", -1.0, 0.0, math.pi))

    def wall(metres: float, half: int) -> List[float]:
        """A wall across the way, so many degrees to both sides."""
        ranges = list(free)
        for degree in range(-half, half + 1):
            ranges[180 + degree] = metres / math.cos(math.radians(degree))
        return ranges

    assert clock.tells(way, scan(wall(3.0, 12))) == "closed"
    assert clock.tells(way, scan(wall(3.0, 1))) == "open"  # one can drive around it
    assert clock.tells(way, scan(wall(0.5, 40))) is None  # before the way: nothing is seen there
    assert clock.tells(way, scan([math.nan] * 360)) is None
    assert clock.tells(way, scan(wall(3.0, 12), range_max=2.0)) is None
    assert clock.tells(way, scan(wall(3.0, 12))) == "closed"
    for wrong in (
        scan([]), scan(free, angle_increment=0.0), scan(free, angle_min=math.nan),
        scan(free, range_max=-1.0),
    ):  # fmt: skip
        with pytest.raises(ReadingError, match="the scan has no ranges"):
            way.hear(wrong, clock.now)


def test_silence(clock: Clock) -> None:
    silent = clock.observer("topic: t", "tell: gone", "else: here", "silent: 5")
    assert not silent.needs_type
    ticks = [silent.tick(now) for now in (10.0, 14.9, 15.0, 30.0)]
    assert ticks == [None, None, "gone", None]
    silent.hear(None, 31.0)
    assert [silent.tick(now) for now in (31.0, 35.9, 36.0)] == ["here", None, "gone"]
    silent.hear(None, 37.0)
    # The clock begins anew.
    assert [silent.tick(now) for now in (37.0, 1.0, 5.0, 6.0)] == ["here", None, None, "gone"]


def test_debounce(clock: Clock) -> None:
    """A condition that lasts for so long is told, also if no other message comes."""
    observer = clock.observer("topic: t", "tell: x", "else: y", "equals: true", "debounce: 2")
    observer.hear(data(True), 10.0)
    assert observer.tick(11.9) is None
    observer.hear(data(False), 11.9)
    observer.hear(data(True), 12.0)
    assert [observer.tick(now) for now in (13.9, 14.0, 14.1)] == [None, "x", None]
    observer.hear(data(False), 20.0)
    observer.hear(data(True), 21.0)
    assert observer.tick(25.0) is None
    observer.hear(data(False), 30.0)
    assert [observer.tick(now) for now in (1.0, 2.9, 3.0)] == [None, None, "y"]  # a clock anew


def test_rate(clock: Clock) -> None:
    """Of what changes too often, what holds in the end is told."""
    observer = clock.observer("topic: t", "tell: x", "else: y", "equals: true", "rate: 0.5")
    told = []
    for number in range(41):
        observer.hear(data(number % 2 == 0), number / 10)
        told.append(observer.tick(number / 10))
    assert [(n, term) for n, term in enumerate(told) if term] == [(0, "x"), (21, "y")]
    assert observer.tick(4.2) == "x"
    free = clock.observer("topic: t", "tell: x", "equals: true", "rate: 0")
    assert [clock.tells(free, data(value), 0.0) for value in (True, False, True)] == [
        "x", None, "x",
    ]  # fmt: skip


def test_what_still_holds(clock: Clock) -> None:
    """New subscribers are told what was told last, unless that has ended."""
    observer = clock.observer("topic: t", "tell: x", "equals: true")
    standing = []
    for value in (False, True, False):
        clock.tells(observer, data(value))
        standing.append(observer.teller.standing)
    assert standing == [None, "x", None]


def test_terms_that_an_encoding_does_not_know(clock: Clock) -> None:
    observers = clock.read(
        "observers:\n- {topic: t, tell: 'blocked(a,b)', equals: true, else: 'unblocked(a,b)'}\n"
        "- {topic: t, tell: 'at(robot,W)', nearest_waypoint: {waypoints: places.yaml, within: 1}}\n"
    )
    known = ["info:blocked(a,b)", "info:unblocked(a,b)", "info:at(mailbot,a)"]
    (warning,) = unknown_terms(observers, known)
    assert "observers.yaml, line 3: the planner's encoding does not know" in warning
    assert "'info:at(robot,a)', 'info:at(robot,b)', 'info:at(robot,c(1))'" in warning
    assert "the nearest that it knows is 'info:at(mailbot,a)'" in warning
    assert len(list(unknown_terms(observers, []))) == 2


def test_values(clock: Clock) -> None:
    """Terms have numbers, truth values and texts of messages in them."""
    percent = clock.observer(
        "topic: t", "tell: battery(V)", "field: percentage",
        "value: {times: 100, step: 5, hysteresis: 1}", "rate: 0",
    )  # fmt: skip
    percent.check("sensor_msgs/BatteryState", TYPES.get)
    said = [clock.tells(percent, SimpleNamespace(percentage=part)) for part in
            (0.91, 0.89, 0.87, 0.86, 0.85, 1.0)]  # fmt: skip
    assert said == ["battery(90)", None, None, "battery(85)", None, "battery(100)"]
    for value in (math.nan, math.inf, 3e9):
        with pytest.raises(ReadingError, match="makes no integer"):
            percent.hear(SimpleNamespace(percentage=value), clock.now)
    with pytest.raises(EntryError, match=r"data of std_msgs/String is string; a number is needed"):
        clock.observer("topic: t", "tell: x(V)", "value: {times: 2}").check(
            "std_msgs/String", TYPES.get
        )
    seen = clock.observer("topic: t", "tell: seen(cam,V)", "value: {}", "rate: 0")
    for kind in ("Bool", "String", "Int32"):
        seen.check(f"std_msgs/{kind}", TYPES.get)
    for value, term in (
        ("box(3)", "box(3)"), ("The box", '"The box"'), ('a"b', '"a\\"b"'), (True, "true"),
        (-7, "-7"), ("V", '"V"'), ("", '""'),
    ):  # fmt: skip
        assert clock.tells(seen, data(value)) == f"seen(cam,{term})"
    with pytest.raises(ReadingError, match="more than 1000 characters"):
        seen.hear(data("x" * 1001), clock.now)
    assert list(unknown_terms([seen], ["info:other"])) == []
