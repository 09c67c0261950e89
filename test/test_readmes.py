"""Types every command that the documents print, literally and in their order.

A test takes one section: it has to type all that stands there, but for what ``NOT_TYPED`` names,
and each command has to do what the text says. Needs a sourced workspace.
"""

from __future__ import annotations

import ast
import contextlib
import functools
import os
import re
import shlex
import shutil
import subprocess
import sys
import textwrap
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Callable, Dict, Iterator, List, Sequence

import pytest
import yaml
from readmes import DOCUMENTS, ROOT, Piece, check_output, section, sections
from screen import screen, start_with_rviz
from terminals import Terminal, Terminals, wait_for
from typist import pipe

from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.solver.programs import parse_files
from rosclingo.wire.commands import Ground, Part
from rosoclingo.check import command as check
from rosoclingo.desk import plan
from rosoclingo.why.phrases import Phrases
from rosoclingo_interfaces.navigation.waypoints import read_waypoints

__all__ = ["screen"]

# Commands, or how they begin, and why they are not typed here.
NOT_TYPED = {
    "scripts/demo": "builds anew; test_scripts.py sees what it types, and test_demo.py types that",
    "scripts/test": "would run this test again",
    "FULL=1 scripts/test": "likewise",
    "scripts/in-chroot": "makes a system of another release",
    "scripts/setup": "installs packages; scripts/test begins with it",
    "src/rosoclingo/scripts/setup": "likewise",
    "PYTHON=": "for catkin_make",
    "catkin_make": "builds the workspace anew, as scripts/test does in all of these ways",
    "source devel/setup.bash": "is done before this test",
    "sudo apt-get install": "Gazebo and the navigation stack are not among Debian's packages",
    "pip install": "is done by scripts/setup",
    "rosbag compress --bz2": "names a command without a bag",
    "rostest rosoclingo_gazebo driving.rostest": "catkin registers it in CMakeLists.txt",
    "rosrun rosoclingo_gazebo demo.py": "takes half a minute; test_demo.py types it",
    "rostopic pub -1 /rosoclingo/in rosoclingo/ROSoClingoIn mailbot2": "mailbot.examples has it",
    'rostopic pub -1 /rosoclingo/in rosoclingo/ROSoClingoIn info "at(': "likewise",
    "rosrun rosoclingo_gazebo fleet_demo.py": "takes a minute; test_demo.py types it",
    "python benchmarks/kills.py": "takes an hour; test_kills.py of rosoclingo types parts of it",
    "python benchmarks/simulator_bench.py": "measures for minutes; scripts/bench types it",
    "test/bags/record": "makes the regression bags anew",
    ".venv/bin/": "checks and tests",
    "python -m pytest": "likewise",
    "rostest rosclingo control.rostest": "likewise",
    "export PYTHONPATH=": "for these",
    "roslaunch rosoclingo rosoclingo.launch mode:=./my_mode.lp": "needs another commands.py",
    "roslaunch rosoclingo_examples blocks_world.launch record:=my_run.bag": "needs another node.py",
    "rosbag info my_run.bag": "likewise",
    "rosnode kill": "names a command without a node",
    "rosrun rosoclingo new.py my_robot": "the tutorial begins with it",
    "python3 -m rosoclingo.scaffold": "test_new.py of rosoclingo runs it",
    "python3 -m rosoclingo.check": "test_check.py of rosoclingo runs it",
}

# Where a section's output is compared with what is really printed.
COMPARED = {
    ("README.md", "Try it"): "rosoclingo_gazebo/test/system/test_demo.py",
    ("docs/bags.md", "replay.py"): "rosoclingo/test/system/test_replay.py",
    ("docs/bags.md", "compare.py"): "test/test_readmes.py",
    ("docs/check.md", "Examples"): "test/test_readmes.py",
    ("docs/modelling.md", "A first encoding"): "test/test_readmes.py",
    ("docs/modelling.md", "Batteries"): "test/test_readmes.py",
    ("docs/modelling.md", "Capacities"): "test/test_readmes.py",
    ("docs/modelling.md", "Doors"): "test/test_readmes.py",
    ("docs/modelling.md", "Bringing things back"): "test/test_readmes.py",
    ("docs/modelling.md", "Urgent things"): "test/test_readmes.py",
    ("docs/modelling.md", "Waiting"): "test/test_readmes.py",
    ("docs/modelling.md", "A plain encoding"): "test/test_readmes.py",
    ("docs/tutorial.md", "1. A package that runs"): "test/test_readmes.py",
    ("docs/tutorial.md", "2. A second action"): "test/test_readmes.py",
    ("docs/tutorial.md", "3. Failures and announcements"): "test/test_readmes.py",
    ("docs/tutorial.md", "4. A run as a test"): "test/test_readmes.py",
    ("docs/why.md", "At run time"): "test/test_readmes.py",
    ("docs/why.md", "In Python"): "test/test_readmes.py",
    ("rosclingo/README.md", "rosclingo"): "test/test_readmes.py",
    ("rosoclingo/README.md", "rosoclingo"): "test/test_readmes.py",
    ("rosoclingo/README.md", "At the desk: plan.py"): "test/test_readmes.py",
    ("rosoclingo/README.md", "Before it runs: check.py"): "test/test_readmes.py",
    ("rosoclingo/README.md", "A domain in PDDL: pddl.py"): "test/test_readmes.py",
    ("rosoclingo/README.md", "Where the time goes"): "test/test_readmes.py",
    ("rosoclingo_aspprograms/README.md", "rosoclingo_aspprograms"): "test/test_readmes.py",
    ("rosoclingo_examples/README.md", "rosoclingo_examples"): "test/test_readmes.py",
    ("rosoclingo_interfaces/README.md", "rosoclingo_interfaces"): "test/test_readmes.py",
    ("rosoclingo_gazebo/README.md", "rosoclingo_gazebo"): "test/test_readmes.py",
    ("rosoclingo_simulator/README.md", "rosoclingo_simulator"): "test/test_readmes.py",
}

ACTIONS = str(ROOT / "rosoclingo_aspprograms" / "lib" / "actions.lp")
ASP = ROOT / "rosoclingo_aspprograms" / "mailbot"
OFFICE, PAPER = ASP / "instances" / "graph_wg.lp", ASP / "mailbot_paper.lp"
TOWER = ROOT / "rosclingo" / "example"
LINE = ROOT / "rosoclingo" / "example" / "line.lp"
BAGS = ROOT / "test" / "bags"

# What a shell of the reader's has: roscore finds its port taken by nobody else's, and rosrun, which
# takes as long as a node to start, looks only once for a program of ours.
PROFILE = """
roscore() { command roscore -p "${ROS_MASTER_URI##*:}" "$@"; }
rosrun() {
  local found=$ROSRUN_FOUND/$1.$2
  [[ $1 == ros*clingo* ]] || { command rosrun "$@"; return; }
  [ -s "$found" ] || command rosrun --prefix echo "$1" "$2" >"$found" || return
  "$(<"$found")" "${@:3}"
}
"""


class Page:
    """A section of a README, and a reader who types what it prints, in a folder of his own."""

    def __init__(self, place: Path, pieces: List[Piece]) -> None:
        found = place.parent / "rosrun"  # shared by the tests of this process
        found.mkdir(exist_ok=True)
        self.terminals = Terminals(place)
        self.terminals.environment["ROSRUN_FOUND"] = str(found)
        self.folder = place / "folder"
        self.folder.mkdir()
        self.left = pieces
        self._profile = PROFILE
        self._open: List[Terminal] = []

    def has(self, **files: Path) -> None:
        """Puts copies of files into the folder: ``task_lp`` is the name ``task.lp``."""
        for name, file in files.items():
            shutil.copy(file, self.folder / name.replace("_", "."))

    def block(self, kind: str) -> str:
        """Returns the next block, which is not typed."""
        piece = self.left.pop(0)
        assert piece.kind == kind, piece
        return piece.text

    def set_variables(self) -> None:
        """Types what comes next as long as it sets variables."""
        while self.left and self.left[0].kind == "variable":
            self._profile += self.left.pop(0).text + "\n"

    def command(self, word: str) -> Sequence[str]:
        """Returns the next command, in which a word is, as a shell takes it."""
        self.set_variables()
        command = self.block("command")
        assert word in command, f"{command!r} is next"
        return ("bash", "-c", f'cd "{self.folder}"\n{self._profile}{command}')

    def type(self, word: str, lines: str = "") -> Terminal:
        """Types the next command, in which a word is, and lines that it reads."""
        shell = self.command(word)
        if lines:
            terminal, typist = pipe(self.terminals, self.folder, *shell)
            typist.type(lines)
            typist.close()
        else:
            terminal = self.terminals.start(*shell)
        self._open.append(terminal)
        if word == "roscore":
            self.sees("/rosout")
        return terminal

    def type_with_rviz(self, word: str, is_up: Callable[[], bool]) -> Terminal:
        """Types the next command, again if rviz breaks, and waits until rviz is up."""
        shell = self.command(word)
        self._open.append(start_with_rviz(lambda: self.terminals.start(*shell), is_up))
        return self._open[-1]

    def run(self, word: str, lines: str = "") -> str:
        """Types the next command, waits until it has ended well, and returns what it has said."""
        terminal = self.type(word, lines)
        assert terminal.wait() == 0, terminal.output
        return terminal.output

    def hears(self, topic: str) -> None:
        """Waits until a latched topic is there: then its node is at work."""
        self.terminals.latched(topic)

    def sees(self, name: str) -> None:
        """Waits until there is a node, topic or service of a name."""
        wait_for(lambda: name in self.terminals.names())

    def interrupt(self) -> None:
        """Presses Ctrl-C in each terminal, the last first; all end, and complain of nothing."""
        for terminal in reversed(self._open):
            if terminal.process.poll() is None:
                terminal.interrupt()
                terminal.wait()
            assert "Traceback" not in terminal.output, terminal.output
        self._open.clear()


def is_left_out(piece: Piece) -> bool:
    is_for_a_shell = piece.kind in ("command", "variable")
    is_to_look_at = piece.kind in ("output", "mermaid")
    return is_to_look_at or (is_for_a_shell and piece.text.startswith(tuple(NOT_TYPED)))


def of(readme: str, heading: str) -> pytest.MarkDecorator:
    return pytest.mark.readme(readme, heading)


@pytest.fixture
def page(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Page]:
    """The section that the test's mark names."""
    pieces = section(*request.node.get_closest_marker("readme").args)
    page = Page(tmp_path, [piece for piece in pieces if not is_left_out(piece)])
    terminals = page.terminals
    if not {"roscore"} & {piece.text for piece in page.left}:
        terminals.start_master()
    try:
        yield page
        assert not page.left, "the README prints more than the test types"
        page.interrupt()
    finally:
        terminals.close()


def test_nothing_is_forgotten() -> None:
    """What is printed is typed or compared, and the lists name nothing that is not printed."""
    tests = [test for name, test in globals().items() if name.startswith("test_")]
    marks = [mark for test in tests for mark in getattr(test, "pytestmark", [])]
    tested = {mark.args for mark in marks if mark.name == "readme"}
    printed = [(name, *part) for name in DOCUMENTS for part in sections(name)]
    pieces = [piece for _, _, found in printed for piece in found]
    for readme, heading, found in printed:
        typed = [piece for piece in found if not is_left_out(piece)]
        assert not typed or (readme, heading) in tested, f"{readme}, {heading}: {typed}"
    assert set(COMPARED) == {
        (readme, heading)
        for readme, heading, found in printed
        if any(piece.kind == "output" for piece in found)
    }
    for (readme, heading), file in COMPARED.items():
        assert f'check_output("{readme}", "{heading}", ' in (ROOT / file).read_text()
    for entry, reason in NOT_TYPED.items():
        assert any(piece.text.startswith(entry) for piece in pieces), f"{entry} ({reason})"


@of("README.md", "The manual's examples")
def test_the_manuals_examples(page: Page) -> None:
    for script in ("start.py", "istart.py"):
        page.type("roscore")
        page.type("run.py")
        said = page.run(script)
        assert "result: sat" in said
        assert said.count("do(arm,") == 14
        page.interrupt()


def rostest(page: Page) -> None:
    """Makes a package of a block that is a line for rostest, and runs it."""
    package = page.folder / "my_package"
    (package / "test").mkdir(parents=True)
    (package / "package.xml").write_text("<package><name>my_package</name></package>")
    shutil.copy(page.folder / "run.bag", package / "test")
    launch = f"<launch>{page.block('xml')}</launch>"
    assert ET.fromstring(launch)[0].attrib["type"] == "replay.py"
    (package / "test" / "run.test").write_text(launch)
    page.terminals.environment["ROS_PACKAGE_PATH"] += f":{page.folder}"
    results = page.folder / "results"
    page.terminals.environment["ROS_TEST_RESULTS_DIR"] = str(results)
    tested = page.terminals.run("rostest", "my_package", "run.test")
    assert tested.wait() == 0, tested.output
    (file,) = results.rglob("rosunit-*.xml")
    suite = ET.parse(file).getroot()
    assert (suite.get("failures"), suite.get("errors")) == ("0", "0")


@of("README.md", "Regression bags")
def test_regression_bags(page: Page) -> None:
    recorded = page.type("roslaunch")
    journal = ("/rosoclingo", "/rosoclingo/journal")
    wait_for(lambda: "/recorder" in page.terminals.receivers(*journal))
    client, typist = pipe(
        page.terminals, page.folder, "rosrun", "rosoclingo_examples", "mailbot_manual.py"
    )
    typist.type("1 3\n")
    typist.close()
    assert client.wait() == 0, client.output
    recorded.interrupt()
    recorded.wait()
    page.has(yesterday_bag=page.folder / "run.bag", today_bag=page.folder / "run.bag")
    assert "no difference" in page.run("replay.py")
    rostest(page)
    assert "no difference" in page.run("compare.py")


@of("rosclingo/README.md", "rosclingo")
def test_rosclingo(page: Page) -> None:
    page.type("roscore")
    page.type("run.py")
    said = page.run("start.py")
    check_output("rosclingo/README.md", "rosclingo", said)
    assert "'do(arm,pickup(4),1)'" in said
    assert "'do(arm,putdown(3),14)'" in said


@of("rosclingo/README.md", "Your own files")
def test_files(page: Page) -> None:
    page.has(instance_lp=TOWER / "instance.lp", encoding_lp=TOWER / "toh.lp")
    page.type("run.py")
    page.sees("/rosclingo/control")
    page.interrupt()
    page.has(a_lp=TOWER / "instance.lp", b_lp=TOWER / "toh.lp")
    page.type("roslaunch")
    page.sees("/planner/control")


@of("rosclingo/README.md", "Control")
def test_control(page: Page) -> None:
    page.terminals.start("rosrun", "rosclingo", "run.py")
    page.sees("/rosclingo/control")
    result = yaml.safe_load(page.run("rosservice call"))["result"]
    assert "".join(result.splitlines()) == (
        "<return><success>True</success>"
        '<externals><external name="query(1)" value="true"/></externals></return>'
    )


@of("rosclingo/README.md", "Difference constraints")
def test_difference_constraints(page: Page) -> None:
    page.type("roscore")
    page.type("run.py")
    said = page.run("istart.py")
    assert "solving with horizon 21\n##### result\nresult: sat\n" in said
    assert "'dl(begin(join),17)'" in said
    assert said.count(",knife)") == 1


@of("rosclingo/README.md", "Use it from Python")
def test_use_it_from_python(page: Page) -> None:
    (page.folder / "a.lp").write_text(
        "#program query(t). #external query(t). {a(t)}. :- query(t), not a(t). #show a/1."
    )
    page.terminals.start("rosrun", "rosclingo", "run.py", "-f", str(page.folder / "a.lp"))
    (page.folder / "example.py").write_text(page.block("python"))
    said = page.terminals.run(sys.executable, str(page.folder / "example.py"))
    assert said.wait() == 0, said.output
    assert "a(3)" in said.output


@of("rosoclingo/README.md", "rosoclingo")
def test_rosoclingo(page: Page) -> None:
    page.type("rosoclingo.launch")
    page.hears("/rosoclingo/about")
    fulfill = page.type("fulfill.py")
    page.run("/rosoclingo/goal")
    fulfill.wait_for("go(3): success")
    check_output("rosoclingo/README.md", "rosoclingo", fulfill.output)
    page.interrupt()

    page.type("roscore")
    for _ in range(3):
        page.type("run.py")
    page.hears("/rosoclingo/about")


@of("rosoclingo/README.md", "The manual's example")
def test_the_blocks_world(page: Page) -> None:
    for _ in range(3):
        page.type("run.py")
    page.type("rostopic echo").wait_for("do(arm,putdown(3),14)")


@of("rosoclingo/README.md", "At the desk: plan.py")
def test_plan(page: Page) -> None:
    planned = page.run("plan.py")
    said = planned + page.run("--simulate")
    check_output("rosoclingo/README.md", "At the desk: plan.py", said)
    page.has(line_lp=LINE)
    has_libraries(page)
    assert page.run("python3 -m").splitlines()[1:] == planned.splitlines()[1:]


@of("rosoclingo/README.md", "Where the time goes")
def test_profile(page: Page) -> None:
    page.has(line_lp=LINE)
    check_output("rosoclingo/README.md", "Where the time goes", page.run("--profile"))


@of("rosoclingo/README.md", "Before it runs: check.py")
def test_check(page: Page) -> None:
    """The command shows what it says."""
    (page.folder / "my_rule.lp").write_text(page.block("prolog"))
    page.has(line_lp=LINE)
    terminal = page.type("check.py")
    assert terminal.wait() == 1, terminal.output
    check_output("rosoclingo/README.md", "Before it runs: check.py", terminal.output)


@of("rosoclingo/README.md", "A domain in PDDL: pddl.py")
def test_pddl(page: Page) -> None:
    page.set_variables()
    written = page.run("pddl.py")
    check_output("rosoclingo/README.md", "A domain in PDDL: pddl.py", written)
    assert "goal 1, goal, succeeds" in page.run("plan.py")


@of("rosoclingo/README.md", "One node: run-1.0.py")
def test_one_node(page: Page) -> None:
    page.has(instance_lp=OFFICE, encoding_lp=PAPER)
    for word in ("run-1.0.py", "single.launch"):
        page.type(word)
        page.hears("/rosoclingo/about")
        page.interrupt()


@of("docs/bags.md", "record.py")
def test_record(page: Page) -> None:
    page.type("record.py").wait_for("recording /rosoclingo in")
    page.interrupt()
    page.type("record:=run.bag").wait_for(f"{page.folder}/run.bag")


@of("docs/bags.md", "rosbag play")
def test_rosbag_play(page: Page) -> None:
    page.has(run_bag=BAGS / "mailbot_dynamic_recording.bag")
    started = page.terminals.start("roslaunch", "rosoclingo_examples", "mailbot_dynamic.launch")
    page.hears("/rosoclingo/about")
    page.run("rosbag play")
    started.wait_for("mailbot: go(")


@of("docs/bags.md", "replay.py")
def test_replay(page: Page) -> None:
    page.has(run_bag=BAGS / "mailbot_dynamic_recording.bag")
    assert "no difference" in page.run("replay.py")

    assert ET.fromstring(page.block("xml")).attrib["type"] == "replay.py"


@of("docs/grounding_on_demand.md", "Asking")
def test_asking(tmp_path: Path) -> None:
    """The parts find what can be reached, each place once and by the shortest way."""
    (program,) = [piece.text for piece in section("docs/grounding_on_demand.md", "Asking")]
    file = tmp_path / "reach.lp"
    file.write_text(
        f"way(1,(2;3)). way(2,3). way(3,(1;4)). #program from(k). reach(k,k,0). {program}"
        "#show reach/3."
    )
    engine = Engine(Options(files=(str(file),)))
    engine.apply(Ground((Part("base"),)))
    engine.apply(Ground((Part("from", ("1",)),)))
    engine.apply(Ground((Part("spread", ("1", "1")),), asking=True))
    expected = ["reach(1,1,0)", "reach(1,2,1)", "reach(1,3,1)", "reach(1,4,2)"]
    assert sorted(engine.solve().symbols) == expected


@of("docs/grounding_on_demand.md", "Shortest ways")
def test_shortest_ways(tmp_path: Path) -> None:
    """The way that is closed in graph 2 is open in graph 1."""
    (program,) = [piece.text for piece in section("docs/grounding_on_demand.md", "Shortest ways")]
    file = tmp_path / "ways.lp"
    file.write_text(
        f"way(1,2,5). way(1,3,2). way(3,2,2). closed(3,2,2). {program}#show distance/4."
    )
    engine = Engine(Options(files=(str(file),)))
    for part in ("base",), ("closing", "1"), ("closing", "2"):
        engine.apply(Ground((Part(part[0], part[1:]),)))
    for graph in ("1", "2"):
        engine.apply(Ground((Part("asking", (graph, "1", "2")),)))
    assert sorted(engine.solve().symbols) == ["distance(1,2,4,1)", "distance(1,2,5,2)"]


@of("docs/why.md", "At run time")
def test_why_at_run_time(page: Page) -> None:
    # Other tests may take all the time that what answers gives way to.
    page.terminals.master.setParam("/test", "/rosoclingo/why_nice", 0)
    node = page.type("rosoclingo.launch")
    page.hears("/rosoclingo/about")
    page.run("/rosoclingo/goal")
    node.wait_for("robot: go(2)")
    said = ""
    for word, status in (("info:close(3)", 0), ("goal:visit(6)", 0), ("--goal", 2)):
        (question,) = page.left[:1]
        terminal = page.type(word)
        while terminal.wait() == 1 and "there was no answer within" in terminal.output:
            page.left.insert(0, question)  # other processes have taken all the time
            terminal = page.type(word)
        assert terminal.wait() == status, terminal.output
        said += terminal.output
    check_output("docs/why.md", "At run time", said)


@of("docs/recovery.md", "Recovery")
def test_recovery(page: Page) -> None:
    shutil.copy(LINE, page.folder / "my_task.lp")
    launched = page.type("rosoclingo.launch")
    page.hears("/rosoclingo/about")
    page.run("/rosoclingo | awk")
    launched.wait_for("goes on with the run in the store")
    page.interrupt()


@of("docs/why.md", "In Python")
def test_why(tmp_path: Path) -> None:
    shutil.copy(LINE, tmp_path)
    (program,) = [p.text for p in section("docs/why.md", "In Python") if p.kind == "python"]
    said = subprocess.run(
        [sys.executable, "-c", program], cwd=tmp_path, check=True, capture_output=True, text=True
    )
    check_output("docs/why.md", "In Python", said.stdout)


@of("docs/why.md", "What an encoding may say")
def test_phrases(tmp_path: Path) -> None:
    (program,) = [piece.text for piece in section("docs/why.md", "What an encoding may say")]
    file = tmp_path / "phrases.lp"
    file.write_text(program)
    phrases = Phrases.read(parse_files([str(file)]))
    assert phrases.of("blocked(c3,c4)") == "the way between c3 and c4 is blocked"
    assert phrases.of("go(c3)") == "go to c3"


def has_libraries(page: Page) -> None:
    """Makes python3 one that has the libraries which the text wants."""
    page.terminals.environment["PATH"] = os.pathsep.join(
        [os.path.dirname(sys.executable), os.environ["PATH"]]
    )


@of("docs/bags.md", "compare.py")
def test_compare(page: Page) -> None:
    page.has(
        yesterday_bag=BAGS / "scenario1_recording.bag", today_bag=BAGS / "scenario2_recording.bag"
    )
    has_libraries(page)
    for word in ("rosrun", "python3 -m"):
        compared = page.type(word)
        assert compared.wait() == 1, compared.output
        check_output("docs/bags.md", "compare.py", compared.output)


@of("docs/bags.md", "report.py")
def test_report(page: Page) -> None:
    page.has(run_bag=BAGS / "scenario1_single.bag")
    has_libraries(page)
    for word in ("rosrun", "python3 -m"):
        page.run(word)
        report = page.folder / "run.html"
        assert "</html>" in report.read_text()
        report.unlink()


@of("rosoclingo_aspprograms/README.md", "rosoclingo_aspprograms")
def test_aspprograms(page: Page) -> None:
    for _ in range(3):
        page.type("run.py")
    heard = page.type("rostopic echo")
    heard.wait_for("do(mailbot,deliver(1),6)")
    assert "do(mailbot,go(1),1)" in heard.output
    check_output("rosoclingo_aspprograms/README.md", "rosoclingo_aspprograms", heard.output)
    page.interrupt()
    page.type("run-1.0.py")
    page.hears("/rosoclingo/about")


@of("rosoclingo_aspprograms/README.md", "An encoding of your own")
def test_plants(page: Page) -> None:
    page.type("roscore")
    page.type("run-1.0.py")
    page.hears("/rosoclingo/about")
    heard = page.type("rostopic echo")
    wait_for(lambda: any(name.startswith("/rostopic_") for name in page.terminals.names()))
    page.run("/rosoclingo/goal")
    heard.wait_for("go(")
    page.run("/rosoclingo/in")
    wait_for(lambda: heard.output.count("go(") == 2)
    assert "goal 1, water((3,4)): succeeded" in page.run("plan.py")
    page.block("prolog")  # which test_library.py plans with


@of("rosoclingo_aspprograms/README.md", "Actions in general")
def test_actions_in_general(page: Page, capsys: pytest.CaptureFixture[str]) -> None:
    """The encoding is written beside the library, as it names that."""
    library = Path("rosoclingo_aspprograms/lib/actions.lp")
    (page.folder / "lamp.lp").write_text(
        page.block("prolog").replace(library.name, str(ROOT / library))
    )
    assert plan.run([str(page.folder / "lamp.lp"), "--goal", "light"]) == 0
    assert "arm: press" in capsys.readouterr().out


@of("rosoclingo_aspprograms/README.md", "Seconds")
def test_seconds(page: Page) -> None:
    assert "goal 1, bring(o9,o14), succeeds in step 9" in page.run("plan.py")


@of("rosoclingo_aspprograms/README.md", "Requests, actions, messages")
def test_goal_information(page: Page) -> None:
    page.terminals.start("roslaunch", "rosoclingo_examples", "mailbot_office.launch")
    client, typist = pipe(
        page.terminals, page.folder, "rosrun", "rosoclingo_examples", "mailbot.py"
    )
    typist.type("o9 o14 box_of_chocolate\n")
    client.wait_for("[1] bring(o9,o14) box_of_chocolate: accepted")
    assert "box_of_chocolate" in page.run("get_goal_information")
    client.interrupt()
    typist.close()


@of("rosoclingo_examples/README.md", "rosoclingo_examples")
def test_examples(page: Page) -> None:
    page.type("mailbot_dynamic.launch")
    said = page.run("mailbot_manual.py", lines="1 3\n")
    check_output("rosoclingo_examples/README.md", "rosoclingo_examples", said)


@of("rosoclingo_examples/README.md", "mailbot_manual.py and mailbot.py")
def test_clients(page: Page) -> None:
    page.terminals.start("roslaunch", "rosoclingo_examples", "mailbot_dynamic.launch")
    assert "2 deliveries" in page.run("printf")


@of("rosoclingo_examples/README.md", "Launch files")
def test_launch_files(page: Page) -> None:
    assert "seed" in page.run("--ros-args").partition("Optional Arguments:")[2]
    client = page.type("echo 1 3")
    client.wait_for("waiting for the server")
    fixed = "mode:=dynamic.fixed.recording"
    page.terminals.start("roslaunch", "rosoclingo_examples", "mailbot_dynamic.launch", fixed)
    assert client.wait() == 0, client.output
    assert client.output.splitlines()[-1] == "1 delivery"


@of("rosoclingo_examples/README.md", "The manual's commands")
def test_the_manuals_commands(page: Page) -> None:
    page.type("roscore")
    for word in ("run.py", "run.py", "run.py", "fulfill.py"):
        page.type(word)
    assert "1 delivery" in page.run("mailbot_manual.py", lines="1 3\n")
    page.interrupt()
    page.terminals.start_master()
    for _ in range(3):
        page.type("run.py")
    page.type("rostopic echo").wait_for("do(mailbot,deliver(1),6)")


REQUEST = "o9 o14 box_of_chocolate\n"


@of("rosoclingo_gazebo/README.md", "rosoclingo_gazebo")
def test_gazebo(page: Page) -> None:
    office = page.type("mailbot_robot.launch")
    client = page.type("mailbot.py", lines=REQUEST)
    client.wait_for("step 2 of")
    assert "mailbot: go(c6): success" in office.output
    check_output("rosoclingo_gazebo/README.md", "rosoclingo_gazebo", client.output)


@of("rosoclingo_gazebo/README.md", "mailbot_scenario.launch")
def test_scenario(page: Page) -> None:
    page.type("mailbot_scenario.launch")
    page.sees("/simulator")
    page.type("run-1.0.py")
    robot = page.type("mailbot_interfaces.launch")
    page.type("mailbot.py", lines=REQUEST).wait_for("step 1 of")
    robot.wait_for("mailbot: go(c6)")


@of("rosoclingo_gazebo/README.md", "Real navigation")
def test_real_navigation(page: Page) -> None:
    page.type("localisation:=false")
    page.sees("/simulator")
    has_stack = page.terminals.run("rospack", "find", "move_base").wait() == 0
    started = page.type("real_navigation.launch")
    checked = page.type("navigation_check.py")
    if has_stack:
        page.sees("/move_base")
    for missing in [checked] if has_stack else [started, checked]:
        assert missing.wait() == (0 if has_stack else 1)
        assert ("packages are missing" in missing.output) != has_stack


@of("rosoclingo_gazebo/README.md", "A fleet")
def test_a_fleet(page: Page) -> None:
    page.type("mailbot_fleet.launch")
    for robot in ("mailbot", "mailbot2", "mailbot3"):
        page.sees(f"/move_base_interface_{robot}")
        page.sees(f"/{robot}/move_base/goal")
    page.sees("/rosoclingo/goal")


@of("rosoclingo_gazebo/README.md", "Systems of their own")
def test_systems_of_their_own(page: Page) -> None:
    offices = {}
    for robot in ("robot1", "robot2"):
        offices[robot] = page.type(f"frame_prefix:={robot}")
        page.sees(f"/{robot}/simulator")
    for robot in offices:
        page.type(f"ROS_NAMESPACE={robot}", lines=REQUEST).wait_for("step 2 of")
    for office in offices.values():
        assert "mailbot: go(c6): success" in office.output


@of("rosoclingo_simulator/README.md", "Several robots")
def test_several_robots(page: Page) -> None:
    page.type("fleet:=")
    for robot in ("robot1", "robot2"):
        page.sees(f"/{robot}/move_base/goal")


@of("rosoclingo_simulator/README.md", "Several systems")
def test_several_systems(page: Page) -> None:
    for robot in ("robot1", "robot2"):
        page.type(f"frame_prefix:={robot}")
        page.sees(f"/{robot}/simulator")


@of("rosoclingo_simulator/README.md", "The office, and a world of your own")
def test_world(page: Page) -> None:
    page.run("generate_world.py")
    house(page, page.block("yaml"))


def house(page: Page, description: str) -> Path:
    """Makes the world that the README describes, and returns its folder."""
    (page.folder / "house.yaml").write_text(description)
    made = page.terminals.run(
        "rosrun", "rosoclingo_simulator", "generate_world.py", str(page.folder / "house.yaml"),
        "--output", str(page.folder / "house"),
    )  # fmt: skip
    assert made.wait() == 0, made.output
    return page.folder / "house"


@of("rosoclingo_rviz/README.md", "rosoclingo_rviz")
def test_rviz(page: Page, screen: str) -> None:
    """The office is drawn, and rviz answers."""
    page.terminals.environment["DISPLAY"] = screen
    picture = str(page.folder / "rviz.png")

    def is_drawn() -> bool:
        # Within rviz's window, which fills the screen, the part that OpenGL draws.
        page.terminals.run("import", "-window", "root", "-crop", "1100x780+370+70", picture)
        return int(page.terminals.run("identify", "-format", "%k", picture).output) > 100

    office = page.type_with_rviz("rviz:=true", lambda: hears_markers(page) and is_drawn())
    assert "xmlrpc reply" in page.terminals.run("rosnode", "ping", "-c", "1", "/rviz").output
    assert "process has died" not in office.output, office.output


@of("rosoclingo_rviz/README.md", "rviz.launch")
def test_a_graph_in_rviz(page: Page, screen: str) -> None:
    page.terminals.environment["DISPLAY"] = screen
    page.has(graph_lp=OFFICE)
    page.type_with_rviz("rviz.launch", lambda: hears_markers(page))


def hears_markers(page: Page) -> bool:
    return "/rviz" in page.terminals.receivers("/graph_markers", "/graph_markers/markers")


@of("rosoclingo_rviz/README.md", "graph_markers.py")
def test_graph_markers(page: Page) -> None:
    page.has(graph_lp=OFFICE)
    page.type("graph_markers.py")
    page.hears("/graph_markers/markers")


@of("rosoclingo_simulator/README.md", "rosoclingo_simulator")
def test_simulator(page: Page) -> None:
    page.type("embedded.launch")
    page.sees("/simulator/obstacle")
    said = page.run("/simulator/obstacle")
    check_output("rosoclingo_simulator/README.md", "rosoclingo_simulator", said)
    page.interrupt()
    pieces = section("rosoclingo_simulator/README.md", "The office, and a world of your own")
    made = house(page, next(piece.text for piece in pieces if piece.kind == "yaml"))
    for kind, name in (("map", "floor.yaml"), ("waypoints", "places.yaml")):
        (found,) = [file for file in made.rglob("*.yaml") if holds(file, kind)]
        shutil.copy(found, page.folder / name)
    for picture in made.rglob("*.pgm"):
        shutil.copy(picture, page.folder)
    page.type("simulator.py")
    page.hears("/map")


def holds(file: Path, kind: str) -> bool:
    return {"map": "image", "waypoints": "frame"}[kind] in yaml.safe_load(file.read_text())


@of("rosoclingo_simulator/README.md", "Obstacles")
def test_obstacles(page: Page) -> None:
    page.terminals.start("roslaunch", "rosoclingo_simulator", "embedded.launch", "speed:=10")
    page.sees("/simulator/obstacle")
    for word in ("block c4 c5", "unblock c4 c5"):
        assert yaml.safe_load(page.run(word))["success"]


@of("rosoclingo_simulator/README.md", "MuJoCo physics and camera")
def test_mujoco(page: Page) -> None:
    page.type("physics:=mujoco")
    page.hears("/map")


ROBOT = '''
class base:
    """A robot that is everywhere at once."""
    has_arrived = True
    drive_to = stop = is_at = staticmethod(lambda *_: True)
'''


@of("rosoclingo_interfaces/README.md", "rosoclingo_interfaces")
def test_interfaces(page: Page) -> None:
    fulfill = page.type("fulfill.py")
    published = page.type("rostopic pub")
    fulfill.wait_for("mailbot: go(c3): success")
    check_output("rosoclingo_interfaces/README.md", "rosoclingo_interfaces", fulfill.output)
    fulfill.interrupt()
    fulfill.wait()
    first, _, rest = page.block("python").partition("\n")
    script = page.folder / "robot.py"
    script.write_text(f"{first}\n{ROBOT}\n{rest}")
    robot = page.terminals.start(sys.executable, str(script))
    robot.wait_for("mailbot: go(c3): success")
    published.interrupt()


@of("rosoclingo_interfaces/README.md", "fulfill.py")
def test_fulfill(page: Page) -> None:
    action = ("rostopic", "pub", "/rosoclingo/out", "rosoclingo/ROSoClingoOut", "mailbot", "go(c3)")
    page.terminals.start(*action)
    page.type("fulfill.py").wait_for("mailbot: go(c3): failure")


@of("rosoclingo_interfaces/README.md", "move_base_interface.py")
def test_move_base_interface(page: Page) -> None:
    page.type("move_base_interface.py")
    page.sees("/move_base_interface")
    (page.folder / "places.yaml").write_text(page.block("yaml"))
    assert set(read_waypoints(page.folder / "places.yaml").places) == {"c3", "c(4)"}


@of("rosoclingo_interfaces/README.md", "After a crash")
def test_what_follows_a_crash(page: Page) -> None:
    """A class of the README's, and what its table says of actions."""
    program = (
        "import clingo\nfrom rosoclingo_interfaces.interface import ActionInterface\n"
        f"{page.block('python')}\n"
        "class Any(Mailbot):\n    def __init__(self): pass\n"
        "for name in 'greet', 'charge', 'go(c3)', 'pickup(1)':\n"
        "    print(Any().outcome_after_crash(clingo.parse_term(name)))\n"
    )
    said = subprocess.run(
        [sys.executable, "-c", program], check=True, stdout=subprocess.PIPE, text=True
    )
    assert said.stdout.split() == ["fail", "again", "again", "unknown"]


@of("rosoclingo_interfaces/README.md", "un_block.py")
def test_un_block(page: Page) -> None:
    heard = page.terminals.start("rostopic", "echo", "/rosoclingo/in")
    page.run("un_block.py", lines="u c3 c4\n")
    page.run('echo "b c3 c4"')
    for value in ("unblocked(c3,c4)", "blocked(c3,c4)"):
        heard.wait_for(f'value: "{value}"')


@of("rosoclingo_interfaces/README.md", "mailbot_interfaces.launch")
def test_mailbot_interfaces(page: Page) -> None:
    for node in ("/move_base_interface", "/fulfill_go"):
        page.type("mailbot_interfaces.launch")
        page.sees(node)
        page.sees("/pickup_deliver")
        page.interrupt()
    page.type("fleet_interfaces.launch")
    for robot in ("mailbot", "mailbot2"):
        page.sees(f"/move_base_interface_{robot}")


def changed(file: Path, difference: str) -> str:
    """Returns a file's text after the changes that a block of the language diff shows."""
    text = file.read_text()
    for old, new in re.findall(r"((?:^-.*\n)+)((?:^\+.*\n)+)", difference, re.MULTILINE):
        before, after = (re.sub(r"^[-+]", "", lines, flags=re.MULTILINE) for lines in (old, new))
        assert text.count(before) == 1, before
        text = text.replace(before, after)
    return text


@of("CONTRIBUTING.md", "Add a command")
def test_the_method_of_a_command(page: Page) -> None:
    """It is the one that the next section has, which is typed."""
    pieces = section("CONTRIBUTING.md", "In a package of your own")
    (script,) = [piece.text for piece in pieces if piece.kind == "python"]
    assert page.block("python").strip() in script
    page.block("diff")
    page.set_variables()


@of("CONTRIBUTING.md", "In a package of your own")
def test_a_command_in_a_package_of_ones_own(page: Page) -> None:
    pieces = section("CONTRIBUTING.md", "Add a command")
    difference = next(piece.text for piece in pieces if piece.kind == "diff")
    mode = ROOT / "rosoclingo/modes/static.incremental.recording.lp"
    (page.folder / "my_mode.lp").write_text(changed(mode, difference))
    for word in ("catkin_create_pkg", "mkdir", "touch", "chmod"):
        page.run(word)
    page.set_variables()
    (page.folder / "my_package/nodes/my_run.py").write_text(page.block("python"))
    page.type("roscore")
    for _ in range(2):
        page.type("run.py")
    page.type("my_run.py").wait_for("the plan has 14 actions")


@of("CONTRIBUTING.md", "Add an action of a robot")
def test_an_action_of_a_robot(page: Page) -> None:
    (page.folder / "my_task.lp").write_text(page.block("prolog"))
    (page.folder / "my_robot.py").write_text(page.block("python"))
    page.type("single.launch")
    robot = page.type("my_robot.py")
    result = page.type("rostopic echo")
    page.hears("/rosoclingo/about")
    listeners = functools.partial(page.terminals.receivers, "/rosoclingo", "/rosoclingo/result")
    wait_for(lambda: any(name.startswith("/rostopic_") for name in listeners()))
    page.run("rostopic pub")
    result.wait_for('result: "succeeded"')
    assert "hello ann" in robot.output


@of("CONTRIBUTING.md", "Add a recorded topic")
def test_a_recorded_topic(page: Page) -> None:
    environment = (ROOT / "rosoclingo/src/rosoclingo/ros/environment.py").read_text()
    for used in ("publisher(", "String", "def show_plan(", "class RosEnvironment"):
        assert used in environment
    for _ in range(2):
        ast.parse(textwrap.dedent(page.block("python")))


@of("CONTRIBUTING.md", "Add a regression bag")
def test_a_regression_bag(page: Page) -> None:
    recording = (BAGS / "recording.py").read_text()
    added = ast.parse(textwrap.dedent(page.block("python")))
    for name in {node.id for node in ast.walk(added) if isinstance(node, ast.Name)}:
        assert re.search(rf"\b{name}\b", recording), name


BATTERY = """
#program base. fluent(battery(0..3)). before(battery(3),0).
#program state(t). holds(battery(N),0) :- before(battery(N),0), t = 0.
#program transition(t).
holds(battery(N-1),t) :- holds(battery(N),t-1), do(robot,_,t).
holds(battery(N),t) :- holds(battery(N),t-1), not do(robot,_,t).
"""


@of("docs/why.md", "Rules")
def test_a_rule_with_a_name(page: Page) -> None:
    battery = page.folder / "battery.lp"
    battery.write_text(BATTERY + page.block("prolog"))
    command = [
        "rosrun",
        "rosoclingo",
        "plan.py",
        str(LINE),
        str(battery),
        "--goal=visit(6)",
        "-c",
        "steps=9",
    ]
    said = " ".join(
        subprocess.run(command, check=False, stderr=subprocess.PIPE, text=True).stderr.split()
    )
    answer = re.search(
        "The answer is `(.*?)`", " ".join((ROOT / "docs/why.md").read_text().split())
    )
    assert answer is not None
    assert answer[1] in said


def test_examples_of_an_encoding() -> None:
    check_output("docs/check.md", "Examples", (ASP / "mailbot.examples").read_text())


TUTORIAL = [
    "1. A package that runs",
    "2. A second action",
    "3. Failures and announcements",
    "4. A run as a test",
]


@pytest.fixture
def tutorial(tmp_path: Path) -> Iterator[Page]:
    """The tutorial's steps, with all that they have to be typed, as one page."""
    with as_one_page(tmp_path, "docs/tutorial.md", TUTORIAL) as page:
        yield page


@contextlib.contextmanager
def as_one_page(place: Path, document: str, headings: Sequence[str]) -> Iterator[Page]:
    """Makes one page of several sections, which needs no master."""
    found = [section(document, heading) for heading in headings]
    page = Page(place, [piece for part in found for piece in part if piece.kind != "output"])
    try:
        yield page
        assert not page.left, f"{document} prints more than the test types"
    finally:
        page.terminals.close()


GUIDE, ROBOTS = "docs/modelling.md", "With robots"


def write_guide(folder: Path) -> str:
    """Writes each file as the guide prints it, and returns the guide's text."""
    text = (ROOT / GUIDE).read_text()
    for name, content in re.findall(
        r"`(my_\w+\.lp)`[^`]*?:\n\n```prolog\n(.*?)```", text, re.DOTALL
    ):
        (folder / name).write_text(content)
    return text


@of(GUIDE, ROBOTS)
def test_modelling_with_robots(page: Page) -> None:
    write_guide(page.folder)
    page.terminals.environment["A"] = ACTIONS
    page.terminals.master.setParam(
        "/test", "/rosoclingo/why_nice", 0
    )  # other tests take all the time
    page.type("single.launch").wait_for("plans with")
    page.type("fulfill.py")
    page.hears("/rosoclingo/dispatch")
    page.run("ROSoClingoActionGoal")
    page.run("locked(d1)")
    said = page.run("why.py")
    assert "no plan for bring(store,ward1) because the door d1 is locked." in said
    page.run("/rosoclingo/cancel")


def test_modelling(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """All other commands are typed, in this process."""
    monkeypatch.chdir(tmp_path)
    text = write_guide(tmp_path)
    programs: Dict[str, Callable[[List[str]], int]] = {"plan.py": plan.run, "check.py": check.run}
    others = [(heading, pieces) for heading, pieces in sections(GUIDE) if heading != ROBOTS]
    said = {heading: "" for heading, _ in others}
    for heading, pieces in others:
        for command in (piece.text for piece in pieces if piece.kind == "command"):
            words = shlex.split(command.replace("\\\n", "").replace("$A", ACTIONS))
            programs[words[2]](words[3:])
            said[heading] += "".join(capsys.readouterr())
    check_output("docs/modelling.md", "A first encoding", said["A first encoding"])
    check_output("docs/modelling.md", "Batteries", said["Batteries"])
    check_output("docs/modelling.md", "Capacities", said["Capacities"])
    assert "goal 2, bring(ward2," in said["Several robots"]
    assert "goal 2, bring(ward2," in said["Shared resources"]
    check_output("docs/modelling.md", "Doors", said["Doors"])
    check_output("docs/modelling.md", "Bringing things back", said["Bringing things back"])
    check_output("docs/modelling.md", "Urgent things", said["Urgent things"])
    check_output("docs/modelling.md", "Waiting", said["Waiting"])
    (reason,) = re.findall(r"^says `([^`]+)`", text, re.MULTILINE)
    assert reason in said["Waiting"]
    assert "nothing found" in said["All of it"]
    check_output("docs/modelling.md", "A plain encoding", said["A plain encoding"])
    robot = Path("my_robot.lp").read_text()
    Path("my_robot.lp").write_text(re.sub("^request.*", "", robot, flags=re.MULTILINE))
    files = ["my_map.lp", "my_robot.lp", "my_many.lp"]
    assert plan.run([ACTIONS, *files, "--goal", "bring(store,ward1)"]) == 0


for _heading in (heading for heading, _ in sections(GUIDE) if heading != ROBOTS):
    test_modelling = of(GUIDE, _heading)(test_modelling)


@of("docs/tutorial.md", TUTORIAL[0])
@of("docs/tutorial.md", TUTORIAL[1])
@of("docs/tutorial.md", TUTORIAL[2])
@of("docs/tutorial.md", TUTORIAL[3])
def test_the_tutorial(tutorial: Page) -> None:
    """A package of one's own, from an empty folder; its README prints nothing else."""
    typed = {piece.text for piece in tutorial.left}
    workspace = tutorial.folder / "my_workspace"
    package = workspace / "src" / "my_robot"
    encoding, script = package / "encoding/robot.lp", package / "nodes/robot.py"

    tutorial.run("mkdir")
    said = tutorial.run("new.py") + tutorial.run("plan.py")
    printed = [piece.text for _, found in sections(str(package / "README.md")) for piece in found]
    assert len(printed) > 5
    assert typed.issuperset(printed)
    assert tutorial.block("command") == f"cd {workspace.name}"
    tutorial.folder = workspace
    tutorial.run("catkin_make")
    sources(tutorial, tutorial.block("command"))
    robot = tutorial.type("roslaunch")
    robot.wait_for("/planner is ready")
    tutorial.sees("/rosoclingo/goal")
    tutorial.run("rostopic pub")
    robot.wait_for("go(kitchen): success")
    check_output("docs/tutorial.md", "1. A package that runs", said + robot.output)
    tutorial.interrupt()
    tutorial.run("rostest")

    change(encoding, tutorial.block("diff"))
    place = "    def _simulate("
    script.write_text(script.read_text().replace(place, f"{tutorial.block('python')}\n{place}"))
    check_output("docs/tutorial.md", "2. A second action", tutorial.run("plan.py"))

    meet_failures(tutorial, encoding)

    robot = tutorial.type("record:=")
    tutorial.sees("/rosoclingo/goal")
    tutorial.run("rostopic pub")
    robot.wait_for("sweep(kitchen): success")
    check_output("docs/tutorial.md", "4. A run as a test", robot.output)
    tutorial.interrupt()
    tests = package / "test/robot.rostest"
    tests.write_text(tests.read_text().replace("</launch>", f"{tutorial.block('xml')}</launch>"))
    assert "testdetour" in tutorial.run("rostest")
    tutorial.run("report.py")
    assert "sweep(kitchen)" in (workspace / "detour.html").read_text()


def meet_failures(tutorial: Page, encoding: Path) -> None:
    """Types the tutorial's third step."""
    text = (ROOT / "docs/tutorial.md").read_text()
    said = tutorial.run("robot:failure")
    blocked = tutorial.type("blocked(dock,hall)")
    assert blocked.wait() == 1
    (reason,) = re.findall(r"says why:\n`([^`]+)`", text)
    assert reason in blocked.output
    said += tutorial.run("unblocked(dock,hall)")
    check_output("docs/tutorial.md", "3. Failures and announcements", said)
    change(encoding, tutorial.block("diff"))
    wet = tutorial.type("wet(kitchen)")
    assert wet.wait() == 1
    (reason,) = re.findall(r"says `(There is no plan[^`]+)`", text)
    assert reason in wet.output
    examples = encoding.with_suffix(".examples")
    change(examples, tutorial.block("diff"))
    checked = tutorial.type("check.py")
    assert checked.wait() == 1
    (difference,) = re.findall(r"the request waits: `([^`]+)`", text)
    assert f"robot.examples:15: example: {difference}" in checked.output
    assert "1 found" in checked.output
    change(examples, tutorial.block("diff"))
    assert re.search("5 examples, .*: nothing found", tutorial.run("check.py"))


def change(file: Path, difference: str) -> None:
    """Changes a file as a block of the language diff shows: a paragraph for each place."""
    text = file.read_text()
    for paragraph in re.split(r"\n\n+", difference.strip("\n")):
        lines = paragraph.splitlines()
        old, new = (
            "".join(f"{line[1:]}\n" for line in lines if line[0] in kept) for kept in (" -", " +")
        )
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    file.write_text(text)


def sources(page: Page, command: str) -> None:
    """Gives each terminal from now on what a command sets."""
    variables = subprocess.check_output(
        ("bash", "-c", f"{command} && env -0"),
        cwd=page.folder, env=page.terminals.environment, text=True,
    )  # fmt: skip
    pairs = (variable.partition("=") for variable in variables.split("\0"))
    page.terminals.environment.update({name: value for name, _, value in pairs if name})
