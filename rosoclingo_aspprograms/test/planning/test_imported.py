"""Tasks in PDDL run with failures, cancels and messages, and PDDL's own semantics validates them.

EPISODES=100 in the environment runs so many, FULL=1 runs 20.
"""

from __future__ import annotations

import random
import subprocess
import sys
import time
from pathlib import Path
from typing import Dict, List, Tuple

import clingo
import pytest
from downward_versions import NEEDS_DOWNWARD
from draws import draws
from episode import DYN_RESET

from plan_validator import read_validator
from rosclingo.solver.options import Options
from rosclingo.wire.term_text import split_term
from rosoclingo.in_process.parts import EXAMPLES, make_parts
from rosoclingo.in_process.system import Request, System
from rosoclingo.loop.words import SOLVER
from rosoclingo.tools.pddl.command import main
from rosoclingo.tools.pddl.expressions import PddlError
from rosoclingo.tools.pddl.files import ImportOptions, import_task, write_files

pytestmark = NEEDS_DOWNWARD
DOMAIN = Path(EXAMPLES, "pddl", "delivery.pddl")
PROBLEM = Path(EXAMPLES, "pddl", "delivery_problem.pddl")
SEEDS = draws(list(range(3)), 100, "EPISODES")
OPTIONS = ImportOptions(actuators=["robot"], changing=["connected"], slots=2)
BOXES = ("red", "green", "blue")
ROOMS = ("kitchen", "hall", "office")


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> List[str]:
    folder = tmp_path_factory.mktemp("pddl")
    written = write_files(import_task(DOMAIN, PROBLEM, OPTIONS), folder)
    return [str(file) for file in written if file.suffix == ".lp"]


def test_the_goal_is_planned_at_once(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main([str(DOMAIN), str(PROBLEM), "--folder", str(tmp_path), "--plan"])
    assert ended.value.code == 0
    assert "goal 1, goal, succeeds in step" in capsys.readouterr().out


class ImportedWorld(System):
    """Actions change the world as PDDL says; one that is not possible is noted."""

    def __init__(self, files: List[str], domain: Path, problem: Path) -> None:
        parts = make_parts(DYN_RESET, Options(tuple(files), ()), ["-c", "steps=100"], log=self.warn)
        super().__init__(parts.loop, patience=0.03)
        self.improves = False  # which would take as long as it likes, since time stands still
        self.world = read_validator(domain, problem)
        self.violations: List[str] = []

    def turn(self) -> bool:
        for actuator in sorted(self.acting):
            self.finish(actuator, "success")
        return bool(self._items)

    def finish(self, actuator: str, outcome: str) -> None:
        """Answers an action; if it has succeeded, the world is another one."""
        if outcome == "success":
            try:
                self.world.execute_term(self.acting[actuator])
            except PddlError as err:
                self.violations.append(str(err))
        self.answer(actuator, outcome)


class Delivery(ImportedWorld):
    """Two robots that bring boxes through a door."""

    def __init__(self, files: List[str]) -> None:
        super().__init__(files, DOMAIN, PROBLEM)
        self.to_fail: List[str] = []  # the boxes that cannot be taken the first time
        self.to_cancel: Dict[str, Request] = {}  # when which box is taken

    def publish(self, actuator: str, action: str) -> None:
        super().publish(actuator, action)
        if actuator != SOLVER:
            others = [split_term(other)[0] for one, other in self.acting.items() if one != actuator]
            if action.startswith("go(") and "go" in others:
                self.violations.append(f"{action}: somebody is in the door")
            if split_term(action)[1][0] != actuator:
                self.violations.append(f"{actuator} does {action}")

    def finish(self, actuator: str, outcome: str) -> None:
        name, (_, box, *_) = split_term(self.acting[actuator])
        if name == "take" and box in self.to_fail:
            self.to_fail.remove(box)
            outcome = "failure"
        elif name == "take" and box in self.to_cancel:
            self.cancel(self.to_cancel.pop(box))
        super().finish(actuator, outcome)

    def place(self, box: str) -> Tuple[str, ...]:
        """Returns the fact that says where a box is."""
        return next(f for f in self.world.facts if f[0] in ("box_at", "carries") and box in f)

    def put_elsewhere(self, box: str, room: str) -> None:
        """Somebody brings a box to a room, and says so."""
        self.world.facts = (self.world.facts - {self.place(box)}) | {("box_at", box, room)}
        self.tell("info", f"box_at({box},{room})")


@pytest.mark.costly
def test_the_encoding_is_small(files: List[str]) -> None:
    """Its base was grounded for 5 s at each start and reset, for messages about small numbers."""
    control = clingo.Control(["-Wnone"])
    for file in files:
        control.load(file)
    begin = time.process_time()
    control.ground([("base", [])])
    assert time.process_time() < begin + 1.0  # of processor time, with some 0.01 s
    assert any(atom.symbol.match("told_up_to", 2) for atom in control.symbolic_atoms)


@pytest.mark.costly
def test_the_goal_is_reached(files: List[str]) -> None:
    world = Delivery(files)
    goal = world.request("goal")
    assert world.run() is None
    assert goal.words[-1] == "succeeded"
    world.world.require_goal()
    assert world.violations == []
    assert {actuator for actuator, _ in world.published} == {"left", "right"}


@pytest.mark.costly
def test_what_has_failed_is_done_again(files: List[str]) -> None:
    world = Delivery(files)
    goal = world.request("box_at(red,office)")
    world.to_fail.append("red")
    assert world.run() is None
    assert goal.words[-1] == "succeeded"
    assert world.violations == []
    assert ("box_at", "red", "office") in world.world.facts
    assert world.to_fail == []


@pytest.mark.costly
def test_a_goal_that_is_cancelled_leaves_the_other_one(files: List[str]) -> None:
    world = Delivery(files)
    red, unknown = world.request("box_at(red,office)"), world.request("box_at(red,ofice)")
    blue = world.request("box_at(blue,kitchen)")
    world.to_cancel["red"] = red
    assert world.run() is None
    assert "ofice is unknown as the second argument of box_at" in unknown.reason
    assert [goal.words[-1] for goal in (red, unknown, blue)] == [
        "canceled",
        "rejected",
        "succeeded",
    ]
    assert world.violations == []
    assert world.place("blue") == ("box_at", "blue", "kitchen")


@pytest.mark.costly
def test_a_message_changes_a_fact(files: List[str]) -> None:
    """There is no way until it is said that there is one again; a box is where somebody says."""
    world = Delivery(files)
    for way in ("connected(kitchen,hall)", "connected(hall,kitchen)"):
        world.tell("info", f"-{way}")
    goal = world.request("box_at(red,office)")
    assert world.run() is None
    assert goal.words == ["accepted"]
    world.put_elsewhere("red", "hall")
    assert world.run() is None
    assert goal.words[-1] == "succeeded"
    assert ("right", "take(right,red,hall)") in world.published
    assert world.violations == []


def test_a_message_says_a_number(files: List[str]) -> None:
    """With less in its battery, a robot charges on its way."""
    world = Delivery(files)
    world.world.numbers["battery", "right"] = 2
    world.tell("info", "value(battery(right),2)")
    goal = world.request("robot_at(right,kitchen)")
    assert world.run() is None
    assert goal.words[-1] == "succeeded"
    assert ("right", "charge(right,hall)") in world.published
    assert world.violations == []


class RandomDelivery(Delivery):
    """Requests, failures, cancels and messages by chance."""

    def __init__(self, files: List[str], seed: int) -> None:
        super().__init__(files)
        self.random = random.Random(seed)
        self.left = 5
        self.canceled: List[Request] = []

    def turn(self) -> bool:
        if self.left and self.random.random() < 0.3:
            self.happen()
        for actuator in sorted(self.acting):
            self.finish(actuator, "failure" if self.random.random() < 0.15 else "success")
        if not self._items and self.left:
            self.happen()
        return bool(self._items)

    def happen(self) -> None:
        self.left -= 1
        open_ones = [goal for goal in self.goals if not goal.ended]
        happens = self.random.choice(["request", "request", "cancel", "message"])
        box, room = self.random.choice(BOXES), self.random.choice(ROOMS)
        if happens == "cancel" and open_ones:
            self.canceled.append(self.random.choice(open_ones))
            self.cancel(self.canceled[-1])
        elif happens == "message" and self.place(box)[0] == "box_at" and not self.acting:
            self.put_elsewhere(box, room)
        else:
            self.request(f"box_at({box},{room})")


@pytest.mark.costly
@pytest.mark.parametrize("seed", SEEDS)
def test_a_random_episode(seed: int, files: List[str]) -> None:
    world = RandomDelivery(files, seed)
    world.request("goal")
    failure = world.run()
    assert failure is None, failure
    assert world.violations == []
    ends: Dict[str, str] = {goal.id: goal.words[-1] for goal in world.goals}
    canceled = {goal.id for goal in world.canceled}
    assert {end for goal, end in ends.items() if goal not in canceled} <= {"succeeded"}


HOUSE = """(define (domain House-Work)
(:requirements :strips :typing :negative-preconditions :conditional-effects :equality :adl)
(:types place thing)
(:constants home - place)
(:predicates (at ?p - place) (in ?t - thing ?p - place) (clean ?p - place) (road ?a ?b - place)
  (lamp-on))
(:functions (total-cost))
(:action go-to :parameters (?a ?b - place) :precondition (and (at ?a) (road ?a ?b))
  :effect (and (at ?b) (not (at ?a)) (when (and (lamp-on) (not (clean ?b))) (not (lamp-on)))
    (increase (total-cost) 2)))
(:action beam :parameters (?t - thing ?p - place)
  :precondition (and (not (at ?p)) (not (in ?t ?p)) (lamp-on))
  :effect (and (in ?t ?p) (forall (?q - place) (when (not (= ?q ?p)) (not (in ?t ?q))))))
(:action light :parameters () :effect (lamp-on))
(:action sweep :parameters (?p - place) :precondition (and (at ?p) (not (clean ?p)))
  :effect (clean ?p)))
"""
HOUSE_PROBLEM = """(define (problem tidy) (:domain House-Work) (:objects a b C-3 - place t - thing)
(:init (at home) (in t a) (road home a) (road a b) (road b C-3) (not (lamp-on))
  (= (total-cost) 0))
(:goal (and (in t C-3) (at C-3) (not (clean home)) (clean C-3) (not (lamp-on))))
(:metric minimize (total-cost)))
"""


def _house(folder: Path, problem: str = HOUSE_PROBLEM) -> ImportedWorld:
    files = folder / "domain.pddl", folder / "problem.pddl"
    for file, text in zip(files, (HOUSE, problem)):
        file.write_text(text)
    written = write_files(import_task(*files, ImportOptions(actuator="arm")), folder)
    return ImportedWorld([str(file) for file in written if file.suffix == ".lp"], *files)


@pytest.mark.costly
def test_conditions_are_met(tmp_path: Path) -> None:
    """The thing is beamed while nobody is there, and what is not clean puts the lamp out."""
    world = _house(tmp_path)
    goal = world.request("goal")
    assert world.run() is None
    assert goal.words[-1] == "succeeded"
    world.world.require_goal()
    assert world.violations == []
    assert {actuator for actuator, _ in world.published} == {"arm"}


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("(and (in t C-3) (at C-3)", "(and (road C-3 a)", "problem.pddl:4: the goal can never be"),
        ("(and (in t", "(and (at home)) (and (in t", "problem.pddl:4: :goal has one part"),
    ],
)
def test_a_goal_that_nobody_can_reach_is_refused(
    tmp_path: Path, old: str, new: str, message: str
) -> None:
    assert old in HOUSE_PROBLEM
    with pytest.raises(PddlError, match=message):
        _house(tmp_path, HOUSE_PROBLEM.replace(old, new))


@pytest.mark.costly
def test_the_command_writes_what_plan_py_reads(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "rosoclingo.tools.pddl", str(DOMAIN), str(PROBLEM)]
    command += ["--actuators", "robot", "--folder", str(tmp_path)]
    ended = subprocess.run(command, capture_output=True, text=True, check=True)
    assert f"wrote {tmp_path / 'delivery.lp'}" in ended.stdout
    examples = (tmp_path / "delivery.examples").read_text()
    assert "delivery_instance.lp -c steps=1000 --goal goal => succeeded" in examples
    bad = [*command, "--most", "speed=3"]
    again = subprocess.run(bad, capture_output=True, text=True, check=False)
    assert again.returncode == 2
    assert "there are battery, distance, load" in again.stderr


LIBRARY = Path(__file__).parents[2] / "lib"


@pytest.mark.parametrize("file", [each.stem for each in sorted(LIBRARY.glob("*.lp"))])
def test_files_of_the_library_are_not_shadowed(file: str, tmp_path: Path) -> None:
    refused = rf"{file}\.lp is the name of a file of the library.* by --name"
    with pytest.raises(PddlError, match=refused):
        import_task(DOMAIN, PROBLEM, ImportOptions(name=file))
    domain = tmp_path / "domain.pddl"
    domain.write_text(DOMAIN.read_text().replace("(domain delivery)", f"(domain {file})"))
    with pytest.raises(PddlError, match=refused):
        import_task(domain, PROBLEM, OPTIONS)
