"""check.py finds nothing in the encodings of the repository.

EPISODES=100 in the environment makes so many random runs of each.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Dict, List, Sequence, Tuple

import pytest

from rosclingo.solver.options import parse_options
from rosoclingo.encodings.alphabet import read_alphabet
from rosoclingo.in_process.parts import EXAMPLES
from rosoclingo.loop.single.dialects import detect
from rosoclingo.tools.check import command, static, twins
from rosoclingo.tools.check.command import Checking
from rosoclingo.tools.check.command_line import parse
from rosoclingo.tools.check.examples import Example, judge, read_examples
from rosoclingo.tools.check.run import Runner
from rosoclingo.tools.plan.command_line import parse_planner

EPISODES = os.environ.get("EPISODES", "1")
THIRDS = 3  # of the mailbot's many examples, as tests of their own
ROOT = Path(__file__).resolve().parents[3]
LINE = f"{EXAMPLES}/line.lp"
ASP = ROOT / "rosoclingo_aspprograms"
MAILBOT = str(ASP / "mailbot" / "mailbot.lp")
CAUSES = str(ASP / "mailbot" / "mailbot_causes.lp")
PAPER = str(ASP / "mailbot" / "mailbot_paper.lp")
STEPS = str(ASP / "test" / "planning" / "mailbot_by_steps.lp")
GRID, OFFICE, PAIR, HALL = (str(ASP / "mailbot" / "instances" / f"graph_{name}.lp")
                             for name in ("bench", "wg", "pair", "hall"))  # fmt: skip
FLEET = str(ASP / "mailbot" / "instances" / "fleet_{}.lp")
LENGTHS = str(ASP / "mailbot" / "instances" / "lengths.lp")
PLANTS = (str(ASP / "plants" / "plants.lp"), str(ASP / "plants" / "instances" / "garden.lp"))
WORKSHOP = tuple(str(ASP / "workshop" / name) for name in ("instances/furniture.lp", "workshop.lp"))
BLOCKS = (f"{EXAMPLES}/instance.lp", f"{EXAMPLES}/itoh.lp")
TOWER = ROOT / "rosclingo" / "example"
BENCHES = ROOT / "benchmarks" / "encodings"
ACTIONS = str(ASP / "lib" / "actions.lp")
TEMPLATE = str(ROOT / "rosoclingo" / "template" / "encoding" / "robot.lp.in")
HERE = ASP / "test" / "planning"
EPISODES_OF = ROOT / "rosoclingo" / "test" / "encodings"
SMALL = ("-c", "x=2", "-c", "y=1")

RUNS: Dict[str, Tuple[str, ...]] = {
    "line": (LINE,),
    "line in one node": (LINE, "--mode", "run-1.0"),
    "line with one slot": (LINE, "-c", "slots=1"),
    "line with a mode that forgets": (LINE, "--mode", "dynamic.incremental.dyn_reset"),
    "line 1.0": (f"{EXAMPLES}/line_1.0.lp",),
    "line of the paper": (f"{EXAMPLES}/line_paper.lp",),
    "line on demand": (f"{EXAMPLES}/line_demand.lp",),
    "blocks": BLOCKS,
    "ten blocks": (str(BENCHES / "ten_blocks.lp"), BLOCKS[1]),
    "single actions": (str(ROOT / "rosoclingo_interfaces" / "test" / "system" / "crashes.lp"),),
    "hanoi": (str(BENCHES / "hanoi.lp"), "-c", "disks=3"),
    "mailbot, with its examples": (PAIR, MAILBOT),
    "mailbot of the paper": (GRID, PAPER, *SMALL),
    "mailbot by steps": (GRID, STEPS, *SMALL),
    "plants": (*PLANTS, "-c", "x=3", "-c", "y=2"),
    "workshop": WORKSHOP,
    "rooms": (str(HERE / "rooms.lp"),),
    "template": (ACTIONS, TEMPLATE),
}
READ: Dict[str, Tuple[str, ...]] = {
    "tower": (str(TOWER / "instance.lp"), str(TOWER / "itoh.lp")),
    "ricochet": (str(BENCHES / "ricochet.lp"),),
    "robots": (str(BENCHES / "robots.lp"), GRID, MAILBOT, "-c", "robots=5", "-c", "x=4"),
    "several mailbots in one place": (str(BENCHES / "depot.lp"), GRID, MAILBOT, *SMALL),
    "mailbot in the office": (OFFICE, MAILBOT),
    "mailbot that looks for causes": (OFFICE, CAUSES),
    "mailbot with two offices": (str(BENCHES / "two_offices.lp"), MAILBOT),
    **{f"{robots} mailbots": (FLEET.format(robots), MAILBOT) for robots in (2, 3, 4)},
    "mailbot with a request": (
        GRID, MAILBOT, str(ASP / "mailbot" / "mailbot" / "requests" / "request01.lp"),
    ),
    "mailbot of the paper in the office": (OFFICE, PAPER),
    "mailbot by steps in the office": (OFFICE, STEPS),
    "garden": PLANTS,
    "office in seconds": (OFFICE, LENGTHS, MAILBOT),
    "hall": (HALL, MAILBOT),
    "waiter of the adapters": (
        ACTIONS, str(ROOT / "rosoclingo_interfaces" / "test" / "rostest" / "waiter.lp"),
    ),
    "jobs": (str(TOWER / "jobs.lp"), "--theory", "dl"),
    "flood": (str(BENCHES / "flood.lp"),),
    "hospital": tuple(
        str(ASP / "hospital" / name) for name in ("instances/small.lp", "hospital.lp")
    ),
    "restaurant": tuple(
        str(ASP / "restaurant" / name) for name in ("instances/small.lp", "restaurant.lp")
    ),
    **{name: (str(HERE / f"{name}.lp"),) for name in ("courier", "blocks", "power", "transport")},
    **{
        name: (str(EPISODES_OF / f"{name}.lp"),)
        for name in ("diner", "errands", "kitchen", "trucks", "tugs")
    },
    "hospital with two robots": (
        str(ASP / "hospital" / "instances" / "small.lp"), str(ASP / "hospital" / "hospital.lp"),
        str(EPISODES_OF / "linen_robots.lp"),
    ),
}  # fmt: skip
NO_PLANNERS = {
    TOWER / "toh.lp",  # has all steps at once
    BENCHES / "agenda_dl.lp", BENCHES / "agenda_tables.lp",  # are about a search of the mailbot's
    BENCHES / "linen.lp", BENCHES / "eight_blocks.lp",  # are searched alone, and not executed
    BENCHES / "shift.lp",  # has no map, which its benchmark draws
    HERE / "world_of_causes.lp",  # plans nothing
    ROOT / "rosoclingo" / "test" / "unit" / "fleet.lp",  # has too many requests for a check
    ROOT / "rosoclingo" / "test" / "encodings" / "large_step.lp",  # takes all memory
}  # fmt: skip


@pytest.mark.costly
@pytest.mark.parametrize("name", RUNS)
def test_what_runs(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def read_some(encoding: str, files: Sequence[str]) -> Sequence[Example]:
        found = read_examples(encoding, files)
        return found[::THIRDS] if encoding == MAILBOT else found

    monkeypatch.setattr(command, "read_examples", read_some)
    checking = Checking(parse([*RUNS[name], "--episodes", EPISODES, "--seconds", "0"]))
    assert [str(finding) for finding in checking.findings()] == []


@pytest.mark.costly
@pytest.mark.parametrize("third", range(1, THIRDS))
def test_the_other_examples_of_the_mailbot(third: int) -> None:
    runner = Runner()
    for example in read_examples(MAILBOT, (PAIR, MAILBOT))[third::THIRDS]:
        assert [str(finding) for finding in judge(example, runner.run(example.words))] == []


@pytest.mark.costly
@pytest.mark.parametrize("name", READ)
def test_what_is_read(name: str) -> None:
    """What takes too long to run is read."""
    options = parse_planner(READ[name], "")
    alphabet = read_alphabet(options)
    assert static.look(options, detect(options), alphabet) == []


@pytest.mark.costly
@pytest.mark.parametrize(
    ("check", "inputs", "others"),
    [
        # Told before the other robot has succeeded, as well as after.
        ("reset", ["--goal", "bring(b,c)", "--at", "6", "right:failure"],
         ["--mode", "dynamic.incremental.reset", "-c", "r=3",
          "--goal", "bring(b,c)", "--at", "6", "right:failure"]),
        # Only the time has changed, as after a success.
        ("failed", ["--at", "5", "goal:bring(c,d)", "--at", "7", "left:failure"],
         ["--at", "5", "goal:bring(c,d)"]),
    ],
)  # fmt: skip
def test_two_robots_with_a_clock(check: str, inputs: List[str], others: List[str]) -> None:
    files = (HALL, MAILBOT, "--simulate", "-c", "steps=38", "--most-steps", "114")
    runner = Runner()
    one, other = (runner.run((*files, *words)) for words in (inputs, others))
    assert list(getattr(twins, check)(one, other)) == []


def test_all_encodings_are_here() -> None:
    """But for modes, which are the controller's, and what others include."""
    used = {Path(word).resolve() for words in (*RUNS.values(), *READ.values()) for word in words}
    known = [file for file in ROOT.rglob("*.lp") if "modes" not in file.parts]
    known = [file for file in known if not {"lib", "build", "devel", "install"} & {*file.parts}]
    assert {file.resolve() for file in known} - used == NO_PLANNERS


def test_options_are_those_of_the_planner() -> None:
    assert parse_planner([LINE, *SMALL], "") == parse_options(["-f", LINE, *SMALL])
