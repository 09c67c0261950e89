"""Doors for YAML: waypoints, observers, adapters, faults, worlds, maps, and policies."""

from __future__ import annotations

import contextlib
import io
import shutil
import tempfile
from pathlib import Path
from typing import Any, Callable, List, Mapping, Sequence

import yaml
from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy
from PIL import Image

from fuzzing import Door
from rosclingo.solver.terms import parse_term
from rosoclingo.loop.values.served import ServedGoal
from rosoclingo_interfaces.adapters.adapter_file import read_adapter
from rosoclingo_interfaces.errors import ActionError, EntryError, WaypointError
from rosoclingo_interfaces.navigation.waypoints import read_waypoints
from rosoclingo_interfaces.observation.observers import read_observers
from rosoclingo_interfaces.observation.transforms import TransformTree
from rosoclingo_simulator.errors import FaultError, MapError, WorldError
from rosoclingo_simulator.faults.reader import read_faults
from rosoclingo_simulator.physics.occupancy import read_map
from rosoclingo_simulator.world.reader import read_world

_BOMB = b"a: &a [x, x]\nb: &b [*a, *a, *a, *a, *a, *a, *a, *a]\n" + b"".join(
    b"%c: &%c [*%c, *%c, *%c, *%c, *%c, *%c, *%c, *%c]\n" % ((at, at) + (at - 1,) * 8)
    for at in range(ord("c"), ord("m"))
)
_DEEP = b"[&a0 1, %s]" % b", ".join(
    b"&a%d %s*a%d%s" % (at, b"[" * 40, at - 1, b"]" * 40) for at in range(1, 80)
)
_WORDS = (
    b"&a ", b"*a", b"&a [*a]", b"<<: *a", b"? ", b"- ", b"--- ", b"...", b"%YAML 9.9\n", b"| ",
    b"> ",
    b"!!python/object/apply:os.system [id]", b"!!binary a", b"!!set {a, b}", b"!!omap [a: 1]",
    b"!a ",
    b"!!int x", b"!!float x", b"!!timestamp x", b"!!null ''", b"!!bool x", b"0o17", b"1_000",
    b".nan",
    b"2001-99-99", b"2001-01-01T99:99:99Z", b"190:20:30", b"=", b"<<", b"{", b"}", b"[", b"]",
    b", ",
    b'"\\U00110000"', b'"\\UFFFFFFFF"', b"%YAML 1." + b"9" * 5000 + b"\n---\n", _DEEP,
    b"{a: 1, a: 2}", b"\xef\xbb\xbf", b'"\\0"', b'"\\ud800"', b'"\\x00"', b"~", b"~nobody/x",
    b"\xff\xfea", b"9" * 400, b"9" * 5000, b"-" * 3, b"a: " * 30, _BOMB, b"*l", b"on", b"1e400",
    b"/",
)  # fmt: skip
_NUMBER: SearchStrategy[Any] = st.one_of(
    st.floats(-5, 5).map(lambda value: round(value, 2)), st.integers(-3, 9)
)
_PLACE = st.sampled_from(["a", "b", "c(1)"])
PLACES = """frame: map
waypoints:
  a: {x: 0, y: 0, theta: 0}
  b: {x: 4, y: 0, theta: 0}
  c(1): {x: 0, y: 4, theta: 0}
"""
_WAYPOINTS = st.fixed_dictionaries(
    {
        "frame": st.just("map"),
        "waypoints": st.dictionaries(
            st.sampled_from(["a", "c3", "c(1)", "7", "'x'"]),
            st.fixed_dictionaries({"x": _NUMBER, "y": _NUMBER, "theta": _NUMBER}),
            min_size=1,
            max_size=3,
        ),
    }
)
_HYSTERESIS = {"hysteresis": st.just(0.1)}
_CONDITIONS: Sequence[SearchStrategy[Any]] = (
    st.fixed_dictionaries(
        {"range": st.fixed_dictionaries({"below": _NUMBER}, optional=_HYSTERESIS)}
    ),
    st.fixed_dictionaries({"range": st.just({"from": 1, "to": 2})}),
    st.fixed_dictionaries({"pattern": st.sampled_from(["low.*", "(a|b)+", "^$"])}),
    st.fixed_dictionaries({"equals": st.sampled_from([True, 3, "open"])}),
    st.fixed_dictionaries({"covariance": st.just({"above": 0.5})}),
    st.fixed_dictionaries(
        {
            "nearest_waypoint": st.fixed_dictionaries(
                {"waypoints": st.just("places.yaml"), "within": st.just(1.5)}, optional=_HYSTERESIS
            )
        }
    ),
    st.fixed_dictionaries(
        {
            "closed": st.fixed_dictionaries(
                {"waypoints": st.just("places.yaml"), "from": _PLACE, "to": _PLACE},
                optional={"width": st.just(1.2)},
            )
        }
    ),
    st.fixed_dictionaries({"silent": st.just(3)}),
    st.fixed_dictionaries({"value": st.sampled_from([{}, {"times": 100, "step": 5}])}),
)
_OBSERVER = st.builds(
    lambda source, condition, more: {**source, **condition, **more},
    st.sampled_from(
        [{"topic": "/battery"}, {"tf": {"child": "base"}}, {"topic": "a", "type": "std_msgs/Bool"}]
    ),
    st.one_of(*_CONDITIONS),
    st.fixed_dictionaries(
        {"tell": st.sampled_from(["low", "battery(low)", "battery(V)", "at(W)"])},
        optional={
            "else": st.just("high"), "field": st.sampled_from(["data", "pose.x[0]"]),
            "id": st.just("info"), "debounce": st.just(0.5), "rate": st.just(2),
        },
    ),
)  # fmt: skip
_OBSERVERS = st.fixed_dictionaries({"observers": st.lists(_OBSERVER, min_size=1, max_size=2)})
_TYPES: Mapping[str, Mapping[str, str]] = {
    "a/String": {"data": "string"},
    "a/Bool": {"data": "bool"},
    "a/GripRequest": {"width": "float64", "force": "uint8"},
    "a/GripResponse": {"success": "bool"},
    "a/GoGoal": {
        "pose": "geometry_msgs/Pose", "stamp": "time", "names": "string[]", "rows": "int8[2]",
    },
    "a/GoAction": {},
    "a/GoResult": {"code": "int32"},
    "a/GoFeedback": {"part": "float32"},
    "geometry_msgs/Pose": {"position": "geometry_msgs/Point"},
    "geometry_msgs/Point": {"x": "float64", "y": "float64"},
}  # fmt: skip
_TARGETS: Sequence[SearchStrategy[Any]] = (
    st.fixed_dictionaries(
        {"action": st.sampled_from(["go(W)", "go(W,_)"]), "actionlib": st.just("base"),
         "type": st.just("a/Go"), "fields": st.just(
            {"pose": "{W.pose}", "stamp": "{now}", "names": ["{W}", "a{{b"], "rows": [1, 2]})},
        optional={"progress": st.just("part"), "after_crash": st.just("again"), "answers": st.just(
            [{"state": "aborted", "field": "code", "range": {"above": 3}, "answer": "stuck"}])},
    ),
    st.fixed_dictionaries(
        {"action": st.just("pick(ID)"), "slot": st.just("ID"), "service": st.just("grip{ID}"),
         "request": st.just("dish(T)"), "type": st.just("a/Grip"),
         "fields": st.just({"width": "{T.x}", "force": 3})},
        optional={"within": st.just(5)},
    ),
    st.fixed_dictionaries(
        {"action": st.just("open(D)"), "publish": st.just("/door"), "type": st.just("a/String"),
         "fields": st.just({"data": "open {D} {actuator}"}), "within": st.just(5)},
        optional={"cancel": st.just({"data": "stop"}), "until": st.just(
            {"topic": "door_{D}", "type": "a/Bool", "equals": True})},
    ),
)  # fmt: skip
_ADAPTERS = st.fixed_dictionaries(
    {
        "actions": st.lists(st.one_of(*_TARGETS), min_size=1, max_size=3),
        "places": st.just("places.yaml")
        | st.just({"a": {"x": 1, "y": 2}, "c(1)": {"x": 1.5, "y": 0, "theta": 1, "n": "x"}}),
    },
    optional={
        "actuators": st.just(["robot"]), "leaves_unknown": st.booleans(),
        "announce": st.just([{"topic": "t", "value": {}, "tell": "battery(V)"}]),
    },
)  # fmt: skip
_WHEN = st.one_of(
    st.fixed_dictionaries({"time": st.just(20)}),
    st.fixed_dictionaries({"place": _PLACE}, optional={"within": st.just(1.0)}),
    st.fixed_dictionaries({"probability": st.just(0.1)}, optional={"per": st.just("metre")}),
)
_FAULTS = st.fixed_dictionaries(
    {
        "faults": st.lists(
            st.builds(
                lambda fault, more: {**fault, **more},
                st.sampled_from(
                    [
                        {"fault": "slip", "loss": 0.4}, {"fault": "stuck_wheel", "wheel": "left"},
                        {"fault": "wrong_pose", "by": {"x": 1}}, {"fault": "odometry_noise"},
                        {"fault": "wrong_pose", "carried_to": "a", "lost": True},
                        {"fault": "laser_noise", "sigma": 0.2, "dropout": 0.1},
                        {"fault": "door_closes", "between": ["a", "b"]},
                    ]
                ),
                st.fixed_dictionaries({}, optional={"when": _WHEN, "lasts": st.just(9)}),
            )
            | st.fixed_dictionaries(
                {"fault": st.just("battery")},
                optional={"charging_place": _PLACE, "level": st.just(0.5), "capacity": st.just(2)},
            ),
            max_size=2,
        )
    },
    optional={"seed": st.integers(0, 9)},
)  # fmt: skip
_WORLDS = st.builds(
    lambda more, resolution: {
        "name": "hall", "floor": [-0.5, -0.5, 8.5, 4.5], "resolution": resolution,
        "waypoints": {"a": {"kind": "office", "at": [1, 2]}, "b": {"kind": "corridor", "at": [6,
        2]}},
        "connections": [["a", "b"]],
        "rooms": {
            "west": {"kind": "office", "areas": [[0, 0, 3, 4]], "doors": [[3, 1, 3.5, 3]]},
            "east": {"kind": "corridor", "areas": [[3.5, 0, 8, 4]]},
        },
        **more,
    },
    st.fixed_dictionaries(
        {},
        optional={
            "about": st.just("A hall."), "walls": st.just({"thickness": 0.1, "height": 2}),
            "clearance": st.just(0.3), "start": st.just({"robot": "a"}),
        },
    ),
    st.sampled_from([0.05, 0.5]),
)  # fmt: skip
_MAP = {
    "image": "map.pgm", "resolution": 0.1, "origin": [0.0, 0.0, 0.0], "occupied_thresh": 0.65,
    "free_thresh": 0.2,
}  # fmt: skip
_MAPS = st.fixed_dictionaries(
    {key: st.just(value) for key, value in _MAP.items()},
    optional={"negate": st.sampled_from([0, 1]), "mode": st.just("trinary")},
)


def _dump(value: Any) -> bytes:
    return yaml.safe_dump(value, sort_keys=False, default_flow_style=None).encode()


class YamlDoor(Door):
    """A door for a file in YAML."""

    words: Sequence[bytes] = _WORDS
    inputs = 800

    def __init__(
        self,
        name: str,
        values: SearchStrategy[Any],
        read: Callable[[Path], Any],
        *errors: type,
    ) -> None:
        self.name = name
        self.errors = errors
        self._values = values
        self._read = read
        self._folder = Path()

    def __enter__(self) -> Door:
        memory = Path("/dev/shm")
        self._folder = Path(tempfile.mkdtemp(dir=memory if memory.is_dir() else None))
        (self._folder / "places.yaml").write_text(PLACES, encoding="utf-8")
        (self._folder / "map.pgm").write_bytes(b"P5 4 2 255\n" + bytes(range(0, 256, 36)))
        return self

    def __exit__(self, *_: object) -> None:
        shutil.rmtree(self._folder)

    def valid(self) -> SearchStrategy[bytes]:
        """Returns files."""
        return self._values.map(_dump)

    def read(self, data: bytes) -> None:
        """Writes the file, and reads it."""
        file = self._folder / "input.yaml"
        file.write_bytes(data)
        self._read(file)

    def check(self, err: Exception) -> None:
        """Checks that the file is named, or another that it names."""
        assert str(self._folder) in str(err), str(err)


class PictureDoor(YamlDoor):
    """A door for the pictures of maps, as their headers say much of their sizes."""

    words = (
        b"P2", b"P5", b"P6", b"P1", b"65535", b"255", b"99999 99999\n", b"#", b"\n", b" ", b"0",
        b"-1",
        b"\x89PNG\r\n\x1a\n", b"GIF89a", b"BM", b"II*\0", b"\xff\xd8\xff", b"Pf", b"\xff" * 30,
    )  # fmt: skip

    def valid(self) -> SearchStrategy[bytes]:
        """Returns pictures of both kinds, and of others that Pillow knows."""
        return st.sampled_from(
            [
                b"P5 4 2 255\n" + bytes(range(0, 256, 36)),
                b"P5\n# comment\n2 2\n65535\n" + bytes(8),
                b"P2\n2 2\n255\n0 255 100 3\n",
                _picture("PNG"),
                _picture("BMP"),
                _picture("TIFF"),
                _picture("GIF"),
            ]
        )

    def read(self, data: bytes) -> None:
        """Writes the picture, and reads a map of it."""
        (self._folder / "map.pgm").write_bytes(data)
        super().read(_dump(_MAP))


def _picture(kind: str) -> bytes:
    written = io.BytesIO()
    Image.new("L", (3, 2), 100).save(written, kind)
    return written.getvalue()


def _adapters(file: Path) -> None:
    """Reads a file, and makes what is sent for some actions."""
    adapter = read_adapter(file, _TYPES.get, TransformTree())
    served = [ServedGoal(1, "1", "dish(a)", "id")]
    for text in ("go(a)", "go(b,c)", "pick(1)", 'open("x y")'):
        with contextlib.suppress(ActionError):
            one, values = adapter.find("robot", parse_term(text), lambda: served)
            one.name(values)
            one.fill(values)


def _faults(file: Path) -> None:
    read_faults(file, read_waypoints(file.parent / "places.yaml"))


def doors() -> List[Door]:
    """Returns the doors."""
    return [
        YamlDoor("waypoints", _WAYPOINTS, read_waypoints, WaypointError),
        YamlDoor(
            "observers",
            _OBSERVERS,
            lambda file: read_observers(file, TransformTree()),
            EntryError,
        ),
        YamlDoor("adapters", _ADAPTERS, _adapters, EntryError),
        YamlDoor("faults", _FAULTS, _faults, FaultError),
        YamlDoor("worlds", _WORLDS, read_world, WorldError),
        YamlDoor("maps", _MAPS, read_map, MapError),
        PictureDoor("pictures", _MAPS, read_map, MapError),
    ]
