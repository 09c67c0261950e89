"""The layout for Foxglove: whether all that it shows is there, by the names of the protocol."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any, Dict, Iterator, Set

ROOT = Path(__file__).resolve().parents[3]
LAYOUT: Dict[str, Any] = json.loads((ROOT / "rosoclingo_rviz/foxglove/office.json").read_text())
PANELS: Dict[str, Any] = LAYOUT["configById"]
# How the protocol lists the names below the planning node.
ROW = re.compile(r"^\| (.*`~.*) \| (topic|service)s? `(\w+)/(\w+)`", re.MULTILINE)


def shown(part: Any) -> Iterator[str]:
    """Yields the panels of a part of the layout."""
    if isinstance(part, str):
        yield part
    else:
        yield from shown(part["first"])
        yield from shown(part["second"])


def values(part: Any, *keys: str) -> Iterator[str]:
    """Yields the values of some keys, wherever they are."""
    if isinstance(part, dict):
        for key, value in part.items():
            if key in keys and isinstance(value, str):
                yield value
            else:
                yield from values(value, *keys)
    elif isinstance(part, list):
        for one in part:
            yield from values(one, *keys)


def test_each_panel_has_its_place_and_settings() -> None:
    placed = list(shown(LAYOUT["layout"]))
    assert sorted(placed) == sorted(PANELS)


def test_all_of_rosoclingo_that_it_names_is_there() -> None:
    protocol = (ROOT / "docs/protocol.md").read_text()
    kinds: Dict[str, str] = {}
    services: Set[str] = set()
    for names, what, package, kind in ROW.findall(protocol):
        for name in re.findall(r"`~(\w+)`", names):
            if what == "service":
                services.add(name)
            elif package == "rosoclingo":
                kinds[name] = kind
    paths = list(values(PANELS, "topicPath", "topicName", "value"))
    found = [re.fullmatch(r"/rosoclingo/(\w+)(?:\.(\w+).*)?", path) for path in paths]
    topics = [one.groups() for one in found if one]
    assert {name for name, _ in topics} == {"summary", "plan", "held", "journal", "out", "in"}
    for name, field in topics:
        definition = (ROOT / f"rosoclingo/msg/{kinds[name]}.msg").read_text()
        assert field is None or re.search(rf"^[\w/\[\]]+ {field}$", definition, re.MULTILINE), field
    asked = set(values(PANELS, "serviceName"))
    assert asked == {"/rosoclingo/pause", "/rosoclingo/resume"}
    assert {name.rsplit("/")[-1] for name in asked} <= services
    told = PANELS["Publish!message"]
    assert told["datatype"] == f"rosoclingo/{kinds['in']}"
    assert set(json.loads(told["value"])) == {"id", "value"}
