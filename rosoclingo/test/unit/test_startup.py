"""Which processes replay a bag, and the files that they get."""

from __future__ import annotations

import dataclasses
import shutil
from pathlib import Path
from typing import Any, Dict, List, Mapping, Sequence

import pytest

from rosclingo.solver.about import about
from rosclingo.solver.engine import Engine
from rosclingo.solver.options import parse_options
from rosclingo.solver.programs import parse_files
from rosoclingo.bags.model import Recording
from rosoclingo.bags.replay.disk import from_disk, is_unchanged
from rosoclingo.bags.replay.startup import check, has_same_encodings, starts
from rosoclingo.encodings.about import Launched
from rosoclingo.encodings.unpack import unpack
from rosoclingo.errors import BagError, LaunchedError
from rosoclingo.loop.journal import Entry, LoopWaits

FILES = {"/home/me/ws/task.lp": '#include "parts/map.lp".', "/home/me/ws/parts/map.lp": "a."}


def program(
    arguments: Sequence[str], files: Mapping[str, str] = FILES, node: str = "/planner"
) -> Launched:
    return Launched(node, "rosclingo run.py", tuple(arguments), files)


def recording(name: str = "/rosoclingo", **programs: Launched) -> Recording:
    solvers = {role: f"/{role}" for role in ("controller", "planner")}
    loop = Launched(name, "rosoclingo run.py", solvers=solvers)
    nodes = {"controller": program(["-f", "task.lp"], node="/controller"),
             "planner": program(["-f", "task.lp", "-c", "slots=1"]), **programs}  # fmt: skip
    return Recording(name, (), {name: loop, **{one.node: one for one in nodes.values()}})


@pytest.mark.parametrize(
    "arguments",
    [
        ["-f", "/home/me/ws/task.lp"], ["-f", "task.lp"], ["-f", "task"], ["-fws/task.lp"],
        ["--file", "../ws/task"], ["--file=./task.lp"], ["-f", "/a/link/ws/task.lp"],
    ],
)  # fmt: skip
def test_files_are_written_and_found(tmp_path: Path, arguments: List[str]) -> None:
    changed, directory = unpack(program([*arguments, "-c", "f=task.lp"]), tmp_path)
    assert directory.is_dir()
    assert changed[-2:] == ["-c", "f=task.lp"]
    file = Path(changed[-3])
    assert file.read_text() == FILES["/home/me/ws/task.lp"]
    assert (file.parent / "parts" / "map.lp").read_text() == "a."
    assert tmp_path in file.parents


def test_includes_from_the_working_directory(tmp_path: Path) -> None:
    files = {"/ws/a/task.lp": '#include "maps/map.lp".', "/ws/maps/map.lp": "a."}
    _, directory = unpack(program(["-f", "/ws/a/task.lp"], files), tmp_path)
    assert (directory / "maps" / "map.lp").read_text() == "a."


def test_includes_with_an_absolute_path(tmp_path: Path) -> None:
    files = {"/ws/task.lp": '#include "/ws/map.lp".\n#include  "/etc/x.lp".', "/ws/map.lp": "a."}
    (_, file), _ = unpack(program(["-f", "task.lp"], files), tmp_path)
    text = Path(file).read_text()
    assert f'"{tmp_path}/ws/map.lp"' in text
    assert '"/etc/x.lp"' in text


def test_the_same_name_in_two_folders(tmp_path: Path) -> None:
    files = {"/ws/a/task.lp": "a.", "/ws/b/task.lp": "b."}
    (_, first, _, second), _ = unpack(program(["-f", "b/task", "-f", "a/task.lp"], files), tmp_path)
    assert (Path(first).read_text(), Path(second).read_text()) == ("b.", "a.")


@pytest.mark.parametrize("directory", ["w", "."])
def test_links_and_names_that_are_alike(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, directory: str
) -> None:
    """By a node's ``~about``, the same files are loaded again, as clingo finds them."""
    texts = {
        "a/robot.lp": '#include "x.lp". #include "parts/robot.lp". #include "../o/parts/robot.lp".',
        "a/x.lp": "x(a).", "b/x.lp": "x(b).", "w/x.lp": "x(w).", "o/parts/robot.lp": "robot(o).",
        "a/parts/robot.lp": "robot(a).", "b/parts/robot.lp": "robot(b). % #include \"none.lp\".",
        "main.lp": '#include "b/r.lp".',
    }  # fmt: skip
    for name, text in texts.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    (tmp_path / "b" / "r.lp").symlink_to("../a/robot.lp")  # what it includes is next to the link
    (tmp_path / "w" / "m").symlink_to("../b")
    monkeypatch.chdir(tmp_path / directory)
    up = "../" if directory == "w" else ""
    for arguments in (["-f", f"{up}b/r"], [f"--file={up}main.lp", "-c", "n=1"],
                      ["-f", f"{up}w/m/r.lp", "-f", f"{up}a/parts/robot.lp"]):  # fmt: skip
        options = parse_options(arguments)
        engine = Engine(options)
        said = about("rosclingo run.py", arguments, engine.program)
        recorded = Launched.decode("/planner", said)
        assert recorded.directory == str(tmp_path / directory)
        expected = facts(options.files)
        words, folder = unpack(recorded, tmp_path / "replay")
        monkeypatch.chdir(folder)
        assert facts(parse_options(words).files) == expected
        assert facts(parse_options(from_disk(recorded)).files) == expected
        monkeypatch.chdir(tmp_path / directory)
        shutil.rmtree(tmp_path / "replay")


def facts(files: Sequence[str]) -> List[str]:
    return sorted(map(str, parse_files(files).statements))


def test_no_file_leaves_the_folder(tmp_path: Path) -> None:
    files = {"/ws/../../../../evil.lp": "a.", "../up.lp": "b."}
    folder = tmp_path / "a" / "b"
    unpack(program([], files), folder)
    assert {path.relative_to(folder) for path in tmp_path.rglob("*.lp")} == {
        Path("evil.lp"), Path("up.lp"),
    }  # fmt: skip


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    message = r"/planner/about does not have the file other\.lp of its command line"
    with pytest.raises(LaunchedError, match=message):
        unpack(program(["-f", "other.lp"]), tmp_path)
    with pytest.raises(BagError, match=f"{message}; give its command line: --planner"):
        starts(recording(planner=program(["-f", "other.lp"])), tmp_path)


@pytest.mark.parametrize("option", ["-f", "--const"])
def test_an_option_of_the_bag_without_its_value(tmp_path: Path, option: str) -> None:
    message = f"command line of /planner is wrong: option {option} needs a value"
    with pytest.raises(BagError, match=message):
        starts(recording(planner=program(["-f", "task.lp", option])), tmp_path)


def test_files_from_disk(tmp_path: Path) -> None:
    file = tmp_path / "task.lp"
    recorded = program(["-f", "task", "-t", "2"], {str(file): "old."})
    with pytest.raises(BagError, match="is not there any more"):
        from_disk(recorded)
    file.touch()
    assert from_disk(recorded) == ["-f", str(file), "-t", "2"]


def test_files_that_have_not_changed(tmp_path: Path) -> None:
    files = {str(tmp_path / name): f"{name}." for name in ("task.lp", "part.lp")}
    recorded = program(["-f", "task"], files)
    nodes = {one: program(["-f", "task"], files, f"/{one}") for one in ("controller", "planner")}
    bag = recording(**nodes)
    assert not is_unchanged(recorded)
    for path, text in files.items():
        Path(path).write_text(text)
    assert is_unchanged(recorded)
    assert has_same_encodings(bag, [None], disk=True)
    for other in (b"another.", b"\xff"):
        (tmp_path / "part.lp").write_bytes(other)
        assert not is_unchanged(recorded)
    assert not is_unchanged(program([], {str(tmp_path / "task.lp"): "\udc80"}))
    assert not has_same_encodings(bag, [None], disk=True)
    assert has_same_encodings(bag, [None, None], disk=False)
    assert not has_same_encodings(bag, [None, "-f other.lp"], disk=False)


def test_files_of_packages_are_found_elsewhere(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    robots = tmp_path / "src" / "robots"
    file = robots / "encodings" / "task.lp"
    file.parent.mkdir(parents=True)
    file.touch()
    (robots / "package.xml").write_text(
        "<package format='2'><name>robots</name><version>1.0.0</version></package>"
    )
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "src"))
    recorded = program(["-f", "task"], {"/home/other/ws/src/robots/encodings/task.lp": "old."})
    assert from_disk(recorded) == ["-f", str(file)]


def commands(of: Recording, folder: Path, **changes: str) -> Dict[str, List[str]]:
    return {one.name: list(one.command) for one in starts(of, folder, **changes)}


def test_the_recorded_system(tmp_path: Path) -> None:
    made = commands(recording(), tmp_path)
    assert list(made) == ["rosoclingo", "controller", "planner"]  # the loop first
    assert made["rosoclingo"] == [
        "rosrun", "rosoclingo", "run.py", "__name:=rosoclingo", "_controller:=/controller",
        "_planner:=/planner",
    ]  # fmt: skip
    assert made["planner"][:4] == ["rosrun", "rosclingo", "run.py", "__name:=planner"]
    assert made["planner"][-2:] == ["-c", "slots=1"]


def test_nodes_of_similar_names(tmp_path: Path) -> None:
    names = {"controller": "/a/b", "planner": "/a_b"}
    loop = Launched("/loop", "rosoclingo run.py", solvers=names)
    nodes = {name: program(["-f", "t.lp"], {"/ws/t.lp": name}, name) for name in names.values()}
    of = Recording("/loop", (), {"/loop": loop, **nodes})
    _, controller, planner = starts(of, tmp_path)
    assert Path(controller.command[-1]).read_text() == "/a/b"
    assert Path(planner.command[-1]).read_text() == "/a_b"
    assert controller.directory != planner.directory


def test_another_planner(tmp_path: Path) -> None:
    made = commands(recording(), tmp_path, planner="-f 'my task.lp' -t 2")
    assert made["planner"][4:] == ["-f", "my task.lp", "-t", "2"]
    assert Path(made["controller"][-1]).is_file()


def test_namespaces(tmp_path: Path) -> None:
    made = starts(Recording("/a/b/loop", ()), tmp_path, planner="-f p", controller="-f c")
    assert [(one.name, one.namespace) for one in made] == [
        ("loop", "/a/b"), ("controller", "/a/b"), ("planner", "/a/b"),
    ]  # fmt: skip


def test_another_system(tmp_path: Path) -> None:
    made = commands(recording(), tmp_path, system="robots all.launch map:=office")
    assert list(made.values()) == [["roslaunch", "robots", "all.launch", "map:=office"]]
    made = commands(recording(), tmp_path, single="-f a.lp")
    assert made == {"rosoclingo": ["rosrun", "rosoclingo", "run-1.0.py", "__name:=rosoclingo",
                                   "-f", "a.lp"]}  # fmt: skip


PARAMETERS = ["_abort_unreachable:=true", "_patience:=2.5"]


def deciding(of: Recording, **parameters: Any) -> Recording:
    """A recording of a loop with parameters."""
    loop = dataclasses.replace(of.programs[of.name], parameters=parameters)
    return dataclasses.replace(of, programs={**of.programs, of.name: loop})


def test_what_the_loop_decides_by(tmp_path: Path) -> None:
    """It is as in the recording, whichever solvers there are, and nothing else is taken from it."""
    values = {"abort_unreachable": True, "patience": 2.5, "explain": True}
    of = deciding(recording(), **values)
    assert commands(of, tmp_path)["rosoclingo"][-2:] == PARAMETERS
    older = deciding(recording(), abort_unreachable=True, search_seconds=2.5, seed_planner="lama")
    assert commands(older, tmp_path)["rosoclingo"][-2:] == PARAMETERS
    assert commands(of, tmp_path, planner="-f p")["rosoclingo"][-2:] == PARAMETERS
    assert commands(of, tmp_path, single="-f a.lp")["rosoclingo"][4:] == [*PARAMETERS, "-f", "a.lp"]
    single = Launched("/rosoclingo", "rosoclingo run-1.0.py", ("-f", "task.lp"), FILES)
    of = deciding(Recording("/rosoclingo", (), {"/rosoclingo": single}), **values)
    assert commands(of, tmp_path)["rosoclingo"][4:7] == [*PARAMETERS, "-f"]
    assert commands(of, tmp_path, system="a b")["the system"] == ["roslaunch", "a", "b"]


def test_a_store_of_the_replay(tmp_path: Path) -> None:
    store = tmp_path / "run.store"
    for changes in ({}, {"single": "-f a.lp"}):
        loop = starts(recording(), tmp_path, store=store, **changes)[0]
        assert f"_store:={store}" in loop.command
    with pytest.raises(BagError, match="--kill needs nodes that replay"):
        starts(recording(), tmp_path, store=store, system="a b")


@pytest.mark.parametrize(
    "wrong",
    [{"abort_unreachable": "true"}, {"abort_unreachable": 1}, {"patience": True},
     {"patience": "1 __name:=x"}, {"search_seconds": "1"}],
)  # fmt: skip
def test_a_wrong_parameter_in_a_bag(tmp_path: Path, wrong: Dict[str, Any]) -> None:
    (name,) = wrong
    with pytest.raises(BagError, match=f"wrong value of the parameter {name} of /rosoclingo"):
        starts(deciding(recording(), **wrong), tmp_path)


def test_what_does_not_fit(tmp_path: Path) -> None:
    single = Launched("/rosoclingo", "rosoclingo run-1.0.py", ("-f", "task.lp"), FILES)
    one_node = Recording("/rosoclingo", (), {"/rosoclingo": single})
    strange = Recording("/rosoclingo", (), {"/rosoclingo": Launched("/rosoclingo", "rm -r")})
    nothing: Dict[str, str] = {}
    for of, changes, text in (
        (Recording("/rosoclingo", ()), nothing, "does not say what /rosoclingo was started with"),
        (Recording("/rosoclingo", ()), {"planner": "-f a"}, "--controller"),
        (one_node, {"planner": "-f a.lp"}, "use --single"),
        (strange, nothing, "unknown program"),
        (recording(), {"single": "-f a", "planner": "-f a"}, "--single is one node"),
        (recording(), {"system": "a b", "planner": "-f a"}, "--system starts everything"),
        (recording(planner=program([], node="/other")), nothing, "the planner, /planner"),
    ):
        with pytest.raises(BagError, match=text):
            starts(of, tmp_path, **changes)
    assert commands(one_node, tmp_path)["rosoclingo"][2] == "run-1.0.py"


@pytest.mark.parametrize("argument", ["__log:=/tmp/elsewhere", "__name:=other", "_x:=1"])
def test_a_bag_that_renames_nodes_is_refused(tmp_path: Path, argument: str) -> None:
    hostile = recording(planner=program(["-f", "task.lp", argument]))
    with pytest.raises(BagError, match=f"argument '{argument}' of /planner"):
        starts(hostile, tmp_path)


def test_scripts_of_a_bag_have_to_be_allowed() -> None:
    entries = (Entry(LoopWaits()),)
    text = "#script (python) print(1) #end."
    hostile = recording(planner=program(["-f", "task.lp"], {"/home/me/ws/task.lp": text}))
    hostile = dataclasses.replace(hostile, entries=entries)
    check(Path("a.bag"), hostile, allow_scripts=True)
    with pytest.raises(BagError, match=r"task\.lp has a #script block.*--allow-scripts"):
        check(Path("a.bag"), hostile, allow_scripts=False)


@pytest.mark.parametrize("name", ["/a b", "/..", "", "/1x", "x"])
def test_a_node_whose_name_is_none_is_refused(name: str) -> None:
    odd = dataclasses.replace(recording(), name=name, entries=(Entry(LoopWaits()),))
    with pytest.raises(BagError, match="is no name of a node"):
        check(Path("a.bag"), odd, allow_scripts=False)
