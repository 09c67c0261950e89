"""Which part may import from which: no circle, no arrow up, ROS where it is said.

A part is a package, and in rosoclingo a room: a folder on its ground floor, or a module there.
"""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from collections import defaultdict
from pathlib import Path
from typing import DefaultDict, Dict, Iterator, List, Sequence, Set

import pytest

ROOT = Path(__file__).resolve().parents[1]
ROS = {  # but for rospkg, which looks for folders only
    "rospy", "actionlib", "genpy", "rosbag", "rosgraph", "roslaunch", "roslib", "rosmaster",
    "rosparam", "rosservice", "rostopic", "tf", "tf2_ros", "diagnostic_updater",
}  # fmt: skip

# From the bottom up: each may import from those before it. Modules stand beside folders.
FLOORS = {
    "rosclingo": [
        "libraries", "start", "free_file", "errors", "limits", "strict_yaml", "terminal", "health",
        "wire", "solver", "ros",
    ],
    "rosoclingo": [
        "errors", "engine",
        "loop.words", "loop.quality", "loop.journal", "loop.values", "loop.planner", "loop.inputs",
        "loop.mode", "loop.execution", "loop", "loop.single", "commands",
        "store", "in_process", "encodings",
        "why", "ros",  # below the bags: no live node imports a replay
        "drawing", "bags.wire", "bags.topics", "bags.holds", "bags.believed", "bags.model",
        "bags.run_model", "bags.read", "bags.record", "bags.compare", "bags.replay", "bags.ros",
        "bags.report",
        "tools.profile", "tools.plan", "tools.new", "tools.check", "tools.pddl",
    ],
    "rosoclingo_interfaces": [
        "errors", "store_file", "prompt", "announcements", "watchdog", "navigation", "observation",
        "ledger", "served_goals", "execution", "interface",
        "adapters", "faulty_actions", "executor", "retransmitter", "ros", "node",
    ],
    "rosoclingo_console": ["model", "web", "bag_console", "ros"],
    "rosoclingo_examples": ["orders", "line_words", "ros"],
    "rosoclingo_rviz": ["ros"],
    "rosoclingo_simulator": [
        "errors", "calls", "pacer", "followed_clock", "world", "physics", "navigation",
        "faults", "ros",
    ],
    "rosoclingo_gazebo": ["demo", "ros"],
}  # fmt: skip
GENERATED = ("msg", "srv")
PUBLIC = "rosoclingo_interfaces.node"  # by which programs of users import what is in ros/
PRIVATE = ("rospy.impl", "clingo._internal", "clingo.core")  # which only patches import


def floor_of(package: str, module: str) -> str:
    """Returns the floor that a module is on, such as ``bags.read``; "" for the package itself."""
    name = module[len(package) + 1 :]
    floors = [floor for floor in FLOORS[package] if f"{name}.".startswith(f"{floor}.")]
    assert floors or name in ("", "bags", "tools"), f"{module}: on no floor in FLOORS"
    return max(floors, key=len, default="")


def imports(file: Path) -> Iterator[str]:
    """Yields the modules that a file imports, also in a function, and by a name in quotes."""
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Import):
            yield from (name.name for name in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{file}: a relative import"
            yield from (f"{node.module}.{name.name}" for name in node.names)
        elif isinstance(node, ast.Call):
            called = getattr(node.func, "attr", getattr(node.func, "id", ""))
            if called in ("import_module", "__import__") and isinstance(node.args[0], ast.Constant):
                yield str(node.args[0].value)


def modules(package: str) -> Sequence[Path]:
    return sorted((ROOT / package / "src").rglob("*.py"))


@pytest.mark.parametrize("package", sorted(FLOORS))
def test_no_arrow_goes_up(package: str) -> None:
    order = FLOORS[package]
    wrong: List[str] = []
    for file in modules(package):
        module = ".".join(file.relative_to(ROOT / package / "src").with_suffix("").parts)
        floor = floor_of(
            package, module[: -len(".__init__")] if module.endswith(".__init__") else module
        )
        for target in imports(file):
            if target.split(".")[0] != package or target.split(".")[1] in GENERATED:
                continue
            below = floor_of(package, target)
            if floor and order.index(below) > order.index(floor):
                wrong.append(f"{module} imports {target}")
    assert not wrong


def part_of(module: str) -> str:
    """Returns a module's part, such as ``rosoclingo.loop`` or ``rosoclingo_console``."""
    package, *rest = module.split(".")
    return ".".join([package, *rest[:1]]) if package == "rosoclingo" else package


def arrows() -> Dict[str, Set[str]]:
    """Returns the parts that each part imports."""
    found: Dict[str, Set[str]] = {}
    for package in FLOORS:
        for file in modules(package):
            module = ".".join(file.relative_to(ROOT / package / "src").with_suffix("").parts)
            targets = {part_of(t) for t in imports(file) if t.split(".")[0] in FLOORS}
            found.setdefault(part_of(module), set()).update(targets - {part_of(module)})
    return found


def circular(parts: Dict[str, Set[str]]) -> Dict[str, Set[str]]:
    """Returns the parts in a circle, or between two circles, with what they import there."""
    while True:
        imported = {target for targets in parts.values() for target in targets}
        rest = {name: ts & parts.keys() for name, ts in parts.items() if name in imported}
        rest = {name: targets for name, targets in rest.items() if targets}
        if rest == parts:
            return rest
        parts = rest


def test_no_circle_between_parts() -> None:
    assert circular(arrows()) == {}


def test_a_circle_is_seen() -> None:
    circle = {"bags": {"tools"}, "tools": {"bags"}}
    others = {"ros": {"bags"}, "loop": {"engine"}, "engine": set()}
    assert circular({**circle, **others, "bags": {"tools", "loop"}}) == circle


def test_the_ground_floor_is_seen_at_a_glance() -> None:
    """It has ten rooms at most, and the package's first lines name each of them."""
    package = ROOT / "rosoclingo/src/rosoclingo"
    rooms = sorted(file.parent.name for file in package.glob("*/__init__.py"))
    text = ast.get_docstring(ast.parse((package / "__init__.py").read_text())) or ""
    assert rooms == sorted(set(re.findall(r":mod:`\.(\w+)`", text)) - {"commands", "errors"})
    assert len(rooms) <= 10


def needs_ros(target: str) -> bool:
    """Tells if a module is of ROS, has messages, or is in one of our folders for ROS."""
    first, *rest = target.split(".")
    return first in ROS or any(part in ("ros", *GENERATED) for part in rest)


def test_ros_is_imported_in_folders_of_this_name_only() -> None:
    wrong: List[str] = []
    for file in sorted(ROOT.glob("*/src/**/*.py")):
        parts = file.relative_to(ROOT).with_suffix("").parts[2:]
        if "ros" not in parts and ".".join(parts) != PUBLIC:
            wrong += [f"{file} imports {target}" for target in imports(file) if needs_ros(target)]
    assert not wrong


@pytest.mark.parametrize(
    "line",
    [
        "import rospy as r", "import os, actionlib.action_client", "from rospy import loginfo",
        "from std_msgs.msg import String", "from rosoclingo import msg",
        "import rosclingo.ros.init", "importlib.import_module('rospy')", "__import__('rospy')",
    ],
)  # fmt: skip
def test_each_form_of_an_import_is_seen(line: str, tmp_path: Path) -> None:
    file = tmp_path / "some.py"
    file.write_text(f"def late():\n    {line}\n")
    assert any(map(needs_ros, imports(file)))


def loaded_with(file: Path) -> Iterator[str]:
    """Yields the modules that a file imports outside of functions."""
    for node in ast.parse(file.read_text()).body:
        if isinstance(node, ast.Try):
            yield from (
                name.name for one in node.body if isinstance(one, ast.Import) for name in one.names
            )
        elif isinstance(node, ast.Import):
            yield from (name.name for name in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from (f"{node.module}.{name.name}" for name in node.names)


def test_recommended_libraries_are_loaded_only_when_they_are_used() -> None:
    """By modules that draw, or are for MuJoCo; the others import those in functions."""
    loads = {
        ".".join(file.relative_to(ROOT).with_suffix("").parts[2:]): [*loaded_with(file)]
        for file in sorted(ROOT.glob("*/src/**/*.py"))
    }
    found = {"matplotlib", "mujoco"}
    while True:
        more = {
            module
            for module, targets in loads.items()
            if any(
                target == one or target.startswith(f"{one}.") for target in targets for one in found
            )
        }
        if more <= found:
            break
        found |= more
    last = {module.rpartition(".")[2] for module in found}
    assert last == {
        "matplotlib", "canvas", "picture", "mujoco", "headless", "mujoco_physics", "rendering",
        "camera",
    }  # fmt: skip


def test_libraries_are_patched_in_one_place() -> None:
    files = [file for package in FLOORS for file in modules(package)]
    wrong = {file for file in files if any(name.startswith(PRIVATE) for name in imports(file))}
    assert {file.name for file in wrong} == {"patches.py"}


def test_each_folder_says_what_is_in_it() -> None:
    """Its docstring begins with a line about it, and docs/architecture.md names it."""
    tables = (ROOT / "docs/architecture.md").read_text()
    wrong: List[str] = []
    for file in sorted(ROOT.glob("*/src/**/__init__.py")):
        folder = "/".join(file.parent.relative_to(ROOT).parts[2:])
        line = (ast.get_docstring(ast.parse(file.read_text())) or "").partition("\n")[0]
        if not line.endswith("."):
            wrong.append(f"{file} does not say what is in its folder")
        if f"`{folder}/`" not in tables and "/" in folder:
            wrong.append(f"docs/architecture.md does not name {folder}/")
    assert not wrong


def test_the_loop_needs_clingo_alone() -> None:
    """As docs/architecture.md says it: no parser of XML, which only the way over ROS needs."""
    folder = ROOT / "rosoclingo/src/rosoclingo/loop"
    names = [
        ".".join(("rosoclingo.loop", *file.relative_to(folder).with_suffix("").parts))
        for file in sorted(folder.rglob("[a-z]*.py"))
    ]
    code = f"import sys; sys.modules['defusedxml'] = None; import {', '.join(names)}"
    subprocess.run([sys.executable, "-c", code], check=True)


def top_level_names(file: Path) -> Iterator[str]:
    """Yields the public classes and constants of a module."""
    for node in ast.parse(file.read_text()).body:
        if isinstance(node, ast.ClassDef):
            yield node.name
        elif isinstance(node, ast.Assign):
            yield from (target.id for target in node.targets if isinstance(target, ast.Name))
        elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            yield node.target.id


def test_a_name_is_that_of_one_thing() -> None:
    """Functions are left out, which are called by the names of their modules."""
    places: DefaultDict[str, List[str]] = defaultdict(list)
    for file in sorted(ROOT.glob("*/src/**/*.py")):
        if "template" not in file.parts:
            for name in {one for one in top_level_names(file) if not one.startswith("_")}:
                places[name].append(str(file.relative_to(ROOT)))
    assert {name: files for name, files in places.items() if len(files) > 1 and name != "T"} == {}
