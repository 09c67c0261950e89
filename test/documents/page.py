"""A section of a document, and a reader who types what it prints."""

from __future__ import annotations

import contextlib
import os
import shutil
import sys
from pathlib import Path
from typing import Callable, Iterator, List, Sequence

import pytest
from readmes import ROOT, Piece, section
from screen import start_with_rviz
from terminals import Terminal, Terminals, wait_for
from typist import pipe

# Commands, or how they begin, and why they are not typed here.
NOT_TYPED = {
    "scripts/demo": "builds anew; test_scripts.py sees what it types, and test_demo.py types that",
    "scripts/test": "would run this test again",
    "FULL=1 scripts/test": "likewise",
    "scripts/in-chroot": "makes a system of another release",
    "scripts/package": "builds for minutes, as root in bare systems",
    "sudo apt-get install ./packages": "likewise",
    "scripts/docs": "builds the site anew, as scripts/test does",
    "scripts/soak": "builds anew; test_scripts.py sees what it types, test_soak.py types that",
    "scripts/fuzz": "takes minutes; test_fuzz.py gives each door some inputs",
    "sudo nft": "changes the firewall of this machine",
    "export ROS_IP=": "for terminals of a robot; the tests have ROS_HOSTNAME",
    "scripts/setup": "installs packages; scripts/test begins with it",
    "src/rosoclingo/scripts/setup": "likewise",
    "PYTHON=": "for catkin_make",
    "catkin_make": "builds the workspace anew, as scripts/test does in all of these ways",
    "source devel/setup.bash": "is done before this test",
    "mkdir -p ~/navigation": "builds the navigation stack, whose source is not here",
    "git clone -b noetic-devel": "likewise",
    "source ~/navigation": "likewise",
    "roslaunch rosoclingo_gazebo real_navigation.launch map:=": "needs a robot",
    "rostest rosoclingo_gazebo real_navigation.rostest": "catkin registers it",
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
    "rosrun diagnostic_aggregator": "needs ROS's aggregator, which is no dependency of ours",
    "rosrun rosoclingo new.py my_robot": "the tutorial begins with it",
    "python3 -m rosoclingo.tools.new": "test_new.py of rosoclingo runs it",
    "python3 -m rosoclingo.tools.check": "test_check.py of rosoclingo runs it",
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


def has_libraries(page: Page) -> None:
    """Makes python3 one that has the libraries which the text wants."""
    page.terminals.environment["PATH"] = os.pathsep.join(
        [os.path.dirname(sys.executable), os.environ["PATH"]]
    )
