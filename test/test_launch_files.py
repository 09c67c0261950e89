"""Every launch file, with every argument: it loads, its nodes come up, and all of them end.

Needs a sourced workspace, in devel or install space.
"""

from __future__ import annotations

import functools
import os
import shutil
import signal
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any, Dict, Iterator, Set, Tuple

import pytest
from roslaunch.arg_dump import get_args
from roslaunch.config import ROSLaunchConfig
from roslaunch.core import RLException
from roslaunch.xmlloader import XmlLoader
from screen import RVIZ_BROKE, screen
from terminals import Terminal, Terminals, catches_interrupts, package, wait_for

__all__ = ["screen"]

ROOT = Path(__file__).resolve().parents[1]
FILES = [(file.parts[-3], file.name) for file in sorted(ROOT.glob("*/launch/*.launch"))]

# What takes other arguments than numbers and true and false, or needs some.
MODE = ROOT / "rosoclingo" / "modes" / "static.incremental.recording.lp"
LINE = ROOT / "rosoclingo" / "example" / "line.lp"
NEEDED = {
    "nodes.launch": [
        "abort_unreachable:=false", "action_timeout:=0", "encoding:=line.lp", "explain:=true",
        "mode:=static.fixed.recording", "options:=-t 1", "r:=5", "record:=none",
        "required:=false", "patience:=0", "steps:=10", "threads:=1",
        "why_seconds:=20",
    ],
    "rosoclingo.launch": ["encoding:=line.lp", "mode:=static.fixed.recording"],
    "single.launch": ["encoding:=line.lp"],
}  # fmt: skip
ANOTHER = {
    "physics": "mujoco",
    "required": "true",
    "abort_unreachable": "true",
    "explain": "false",
    "mode": "dynamic.incremental.reset",
    "navigation": "fulfill",
    "rosoclingo": "another",
    "robot": "robot7",
    "fleet": "robot7@c1",
}
WITH = {"go_delay": ["navigation:=fulfill"], "go_fail": ["navigation:=fulfill"]}

# Gazebo and the navigation stack may be missing: test_launch.py of rosoclingo_gazebo tests what
# they are told.
MISSING = {"gazebo.launch", "real_navigation.launch"}
OF_GAZEBO = {"gui", "simulator"}

STARTED = {
    "rosclingo.launch": ["files:=line.lp"],
    "rosoclingo.launch": ["encoding:=line.lp", f"mode:=./{MODE.name}"],
    "single.launch": ["encoding:=line.lp"],
}
PARTS = {"nodes.launch"}  # are started as a part of others


@functools.lru_cache(maxsize=None)
def path(file: Tuple[str, str]) -> str:
    return str(package(file[0]) / "launch" / file[1])


def arguments(file: Tuple[str, str]) -> Dict[str, Any]:
    """Returns documentation and default of each argument, as ``--ros-args`` shows them."""
    shown = get_args([path(file)])
    assert isinstance(shown, dict)
    return shown


REQUIRED = 2  # which of a node's values says that its end is that of the launch file


@functools.lru_cache(maxsize=None)
def load(file: Tuple[str, str], *given: str) -> Tuple[Dict[str, Tuple[Any, ...]], Dict[str, Any]]:
    """Returns the nodes and the parameters that a launch file stands for."""
    config = ROSLaunchConfig()
    XmlLoader().load(path(file), config, argv=list(given), verbose=False)
    nodes = {
        f"{node.namespace}{node.name}": (
            node.type,
            node.args,
            node.required,
            node.respawn,
            node.remap_args,
        )
        for node in config.nodes
    }
    assert len(nodes) == len(config.nodes)
    return nodes, {name: param.value for name, param in config.params.items()}


@pytest.mark.parametrize("file", FILES, ids="/".join)
def test_arguments_are_explained(file: Tuple[str, str]) -> None:
    """What has a default is shown as optional, and nothing but arguments as required."""
    declared = ET.parse(path(file)).getroot().findall("arg")
    optional = {tag.attrib["name"] for tag in declared if "default" in tag.attrib}
    required = {
        tag.attrib["name"] for tag in declared if not {"default", "value"} & set(tag.attrib)
    }
    shown = arguments(file)
    assert {name for name, (_, default) in shown.items() if default} == optional
    assert {name for name, (_, default) in shown.items() if not default} == required
    if file[1] != "nodes.launch":  # which is a part of another one
        assert all(doc for doc, _ in shown.values())


@pytest.mark.costly
@pytest.mark.parametrize("file", FILES, ids="/".join)
def test_each_argument_counts(file: Tuple[str, str]) -> None:
    """Another value starts other nodes, or the same ones in another way."""
    if file[1] in MISSING:
        pytest.skip("needs packages that are not there")
    needed = NEEDED.get(file[1], [])
    for name, (_, default) in arguments(file).items():
        if name in OF_GAZEBO:
            continue
        flipped = {"true": "false", "false": "true"}.get(str(default))
        value = flipped or ANOTHER.get(name, "7")
        given = [n for n in needed if not n.startswith(f"{name}:=")] + WITH.get(name, [])
        changed = load(file, *given, f"{name}:={value}")
        assert changed != load(file, *needed, *WITH.get(name, [])), name


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Terminals]:
    """Terminals with a master that all tests of this file use, one after another."""
    opened = Terminals(tmp_path_factory.mktemp("terminals"))
    try:
        opened.start_master()
        yield opened
    finally:
        opened.close()


def start(terminals: Terminals, folder: Path, *words: str) -> Terminal:
    """Types a roslaunch in a folder where encodings are."""
    folder.mkdir()
    shutil.copy(LINE, folder)
    shutil.copy(MODE, folder)
    # An earlier launch file may have left it behind.
    terminals.master.deleteParam("/test", "/use_sim_time")
    return terminals.start("bash", "-c", 'cd "$0" && exec roslaunch "$@"', str(folder), *words)


def come_up(terminals: Terminals, launch: Terminal, expected: Set[str]) -> None:
    def is_up() -> bool:
        assert launch.process.poll() is None, launch.output
        return expected <= terminals.names() and all(
            catches_interrupts(terminals.pid(node)) for node in expected
        )

    wait_for(is_up)
    assert "has died" not in RVIZ_BROKE.sub("", launch.output)


def have_ended(terminals: Terminals, launch: Terminal, expected: Set[str]) -> None:
    assert launch.wait() == 0, launch.output
    for wrong in ("escalating", "Traceback"):
        assert wrong not in launch.output, launch.output
    assert not expected & terminals.names()


@pytest.mark.costly
@pytest.mark.parametrize("file", [f for f in FILES if f[1] not in MISSING | PARTS], ids="/".join)
def test_start_and_stop(
    shared: Terminals, screen: str, tmp_path: Path, file: Tuple[str, str]
) -> None:
    """In a namespace, and recorded in a bag in the folder where roslaunch was typed."""
    shared.environment["DISPLAY"] = screen
    folder, given = tmp_path / "my robot", [*STARTED.get(file[1], []), "record:=x.bag"]
    launch = start(shared, folder, *file, *given, "__ns:=robot1")
    # Without rviz, which may break: documents/test_pictures.py tests that it is started.
    nodes = {f"/robot1{node}" for node in load(file, *given)[0] if node != "/rviz"}
    come_up(shared, launch, nodes)
    launch.interrupt()
    have_ended(shared, launch, nodes)
    bag = folder / "x.bag"
    assert bag.exists() or f"there is no {bag}" in launch.output


@pytest.mark.parametrize(
    ("file", "node"),
    [
        (("rosoclingo", "rosoclingo.launch"), "/controller"),
        (("rosclingo", "rosclingo.launch"), "/rosclingo"),
        (("rosoclingo", "rosoclingo.launch"), "/planner"),
        (("rosoclingo", "single.launch"), "/rosoclingo"),
        (("rosoclingo_examples", "mailbot_office.launch"), "/rosoclingo"),
        (("rosoclingo_simulator", "embedded.launch"), "/simulator"),
    ],
)
def test_what_is_required(file: Tuple[str, str], node: str) -> None:
    given = STARTED.get(file[1], [])
    assert not load(file, *given)[0][node][REQUIRED]
    assert load(file, *given, "required:=true")[0][node][REQUIRED]


@pytest.mark.parametrize(
    ("file", "bag"),
    [
        (("rosoclingo", "rosoclingo.launch"), "run.bag"),
        (("rosclingo", "rosclingo.launch"), "run"),  # to which rosbag appends the ending
    ],
)
def test_a_bag_that_exists_ends_the_launch(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], file: Tuple[str, str], bag: str
) -> None:
    """Before anything starts; the files that include these have the same argument."""
    given = [*STARTED.get(file[1], []), f"record:={tmp_path / bag}"]
    (tmp_path / "run.bag").touch()
    with pytest.raises(RLException, match=r"free_file\.py"):
        load(file, *given)
    assert f"{tmp_path}/run.bag: there is such a file already" in capfd.readouterr().err


@pytest.mark.costly
def test_required(shared: Terminals, tmp_path: Path) -> None:
    """A node that dies ends the launch file, which is in the namespace of the environment here."""
    file, node, namespace = ("rosoclingo", "rosoclingo.launch"), "/planner", "/rosoclingo"
    shared.environment["ROS_NAMESPACE"] = namespace
    try:
        given = [*STARTED.get(file[1], []), "required:=true"]
        launch = start(shared, tmp_path / "my robot", *file, *given)
        nodes = {namespace + name for name in load(file, *given)[0]}
        come_up(shared, launch, nodes)
        os.kill(shared.pid(namespace + node), signal.SIGKILL)
        launch.wait()
        assert f"REQUIRED process [{namespace[1:]}{node}" in launch.output
        assert not (nodes - {namespace + node}) & shared.names()
    finally:
        del shared.environment["ROS_NAMESPACE"]
