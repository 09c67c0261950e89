"""The notes suffice: beliefs are those of a solver that forgets no observation.

Random worlds have observations that nothing explains, causes that end, and repairs. All of what was
observed is explained again by ``diagnose``, which a test of rosclingo compares with an enumeration.
EPISODES=200 in the environment runs so many worlds, FULL=1 runs 60.
"""

from __future__ import annotations

import random
from collections import Counter
from pathlib import Path
from typing import Dict, FrozenSet, List, NamedTuple, Sequence, Set, Tuple

import pytest
from draws import draws

from rosclingo.solver.diagnosis import diagnose
from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.solver.terms import parse_term
from rosclingo.wire.commands import GetPrograms, Ground, Part
from rosclingo.wire.term_text import split_term
from rosoclingo.loop.planner.demand import Demand, step_parts

HERE = Path(__file__).parent
LIBRARY = HERE.parents[1] / "lib"
SEEDS = draws(range(3), 60, "EPISODES")
Seen = Tuple[str, str]  # a thing, or fix(C), and what was observed of it
Causes = FrozenSet[str]


class World(NamedTuple):
    """A world as world_of_causes.lp describes it; a kind has a surprise and how it lasts."""

    things: Sequence[str]
    kinds: Dict[str, Tuple[int, str]]
    effects: Set[Tuple[str, str, str, str]]

    @property
    def text(self) -> str:
        return " ".join([
            "value(u;x;y).",
            *(f"thing({thing})." for thing in self.things),
            *(f"kind({kind},{weight},{lasts})." for kind, (weight, lasts) in self.kinds.items()),
            *(f"effect({','.join(effect)})." for effect in sorted(self.effects)),
        ])  # fmt: skip


class Found(NamedTuple):
    """Causes that are not past: those believed, certain, possible; and the others."""

    believed: Causes
    certain: Causes
    possible: Causes
    past: Causes


class Observer:
    """Tells a solver the observations, step by step, and remembers all of them.

    The library numbers moments anew when older ones are forgotten: here, a moment is a step.
    """

    def __init__(self, world: World, file: Path) -> None:
        file.write_text(world.text)
        files = (LIBRARY / "memory.lp", LIBRARY / "causes.lp", HERE / "world_of_causes.lp", file)
        self.world = world
        self.seen: List[Tuple[int, str, str]] = []
        self.noted = 0
        self._engine = Engine(Options(tuple(map(str, files)), ()))
        self._demand = Demand()
        (programs,) = self._engine.run([GetPrograms()]).answers
        self._demand.begin(programs)
        assert self._engine.run([self._demand.ground([Part("base")])]).failure is None
        self._step = -1
        self._steps: Dict[str, int] = {}  # by the library's moments
        self.observe()

    def observe(self, *seen: Seen) -> Found:
        """Returns the beliefs after one more observation."""
        self._step += 1
        said = [
            f"mended({split_term(thing)[1][0]})" if thing[:3] == "fix" else f"saw({thing},{value})"
            for thing, value in seen
        ]
        self.seen += [(self._step, *one) for one in seen]
        self._demand.tell([f"event(info,{one},{self._step})" for one in said])
        commands: List[Ground] = [self._demand.ground(step_parts(self._step))]
        commands += [*self._demand.take_pending(), *self._demand.prepare(self._step)]
        reply = self._engine.run(commands)
        assert reply.failure is None, reply.failure
        found: Dict[str, Set[str]] = {name: set() for name in Found._fields}
        noted = set()
        terms = [split_term(text) for text in self._engine.solve().symbols]
        (moment,) = [arguments[0] for name, arguments in terms if name == "moment"]
        self._steps[moment] = self._step
        for name, arguments in terms:
            if name == "found":
                kind, since = split_term(arguments[1])[1]
                found[arguments[0]].add(f"c({kind},{self._steps[since]})")
            elif name == "holds" and arguments[1] == str(self._step):
                noted.add(split_term(arguments[0])[1][2])
                self.noted += 1
        self._steps = {moment: step for moment, step in self._steps.items() if moment in noted}
        past = found["past"]
        return Found(
            *(frozenset(found[name] - past) for name in Found._fields[:3]), frozenset(past)
        )

    def expected(self) -> Tuple[Set[Causes], Causes, Causes]:
        """Returns what would be found in all that was observed: the best ones, and the next two."""
        facts: List[str] = []
        causes: Set[Tuple[str, int]] = set()
        for step, thing, value in self.seen:
            usual = "yes" if thing[:3] == "fix" else "u"
            facts += [f"observed(seen({thing},{step}),{value})"]
            facts += [f"usual(seen({thing},{step}),{usual})"]
            causes |= {
                (kind, step) for kind, of, makes, _ in self.world.effects
                if (of, makes) == (thing, value) and value != usual
            }  # fmt: skip
        past: Set[str] = set()
        for kind, since in causes:
            weight, lasts = self.world.kinds[kind]
            cause = f"c({kind},{since})"
            facts.append(f"cause({cause},{weight})")
            ends = [s for s, thing, _ in self.seen if thing == f"fix({kind})" and since <= s]
            if ends or lasts == "moment":
                past.add(cause)
            last = since if lasts == "moment" else min(ends, default=self._step)
            facts += [
                f"{'makes' if how == 'must' else 'may_make'}({cause},seen({thing},{step}),{makes})"
                for step, thing, _ in self.seen if since <= step <= last
                for other, of, makes, how in self.world.effects if (other, of) == (kind, thing)
            ]  # fmt: skip
        found = diagnose([(t.name, tuple(t.arguments)) for t in map(parse_term, facts)], 300, 0)
        best = {frozenset(map(str, one.causes)) - past for one in found.kept}
        return best, *(frozenset(map(str, all_)) - past for all_ in (found.certain, found.possible))


def draw(dice: random.Random) -> World:
    things = [f"o{number}" for number in range(dice.randint(2, 4))]
    kinds = {
        f"k{number}": (dice.randint(1, 5), dice.choice(["lasting", "lasting", "moment"]))
        for number in range(dice.randint(1, 5))
    }
    effects = {
        (kind, thing, dice.choice("xxyu"), dice.choice(["must", "must", "may"]))
        for kind in kinds for thing in things if dice.random() < 0.6
    }  # fmt: skip
    return World(things, kinds, effects)


@pytest.mark.costly
@pytest.mark.parametrize("block", SEEDS)
def test_nothing_that_matters_is_forgotten(block: int, tmp_path: Path) -> None:
    """Ten random worlds in each block."""
    counts: Counter[str] = Counter()
    for seed in range(10 * block, 10 * block + 10):
        dice = random.Random(seed)
        observer = Observer(draw(dice), tmp_path / "world.lp")
        for _ in range(dice.randint(2, 7)):
            seen = [
                (thing, dice.choice("uuxy")) for thing in observer.world.things
                if dice.random() < 0.5
            ]  # fmt: skip
            seen += [
                (f"fix({kind})", "yes") for kind in observer.world.kinds if dice.random() < 0.12
            ]
            if not seen:
                continue
            found, (best, certain, possible) = observer.observe(*seen), observer.expected()
            assert found.believed in best, (seed, observer.seen)
            assert (found.certain, found.possible) == (certain, possible), (seed, observer.seen)
            counts["believed"] += bool(found.believed)
            counts["past"] += bool(found.past)
        counts["seen"] += len(observer.seen)
        counts["noted at most"] += observer.noted
    print(counts)
    assert min(counts.values()) > 0


LAMP = World(
    ("lamp", "radio"),
    {"fuse": (2, "lasting")},
    {("fuse", "lamp", "x", "must"), ("fuse", "radio", "x", "must")},
)


def test_what_nothing_explains_refutes_no_cause(tmp_path: Path) -> None:
    """A fuse makes lamp and radio silent; that the radio hums says nothing of the fuse."""
    observer = Observer(LAMP, tmp_path / "world.lp")
    assert observer.observe(("lamp", "x")).certain == {"c(fuse,1)"}
    for _ in range(3):
        assert observer.observe(("radio", "y")).certain == {"c(fuse,1)"}
    assert observer.observe(("radio", "u")).believed == frozenset()


def test_a_repair_is_remembered(tmp_path: Path) -> None:
    """As long as what it has ended explains something that may have another cause."""
    kinds = {"leak": (2, "lasting"), "dust": (3, "lasting")}
    world = World(("cup", "bell"), kinds, {(kind, "cup", "x", "must") for kind in kinds})
    observer = Observer(world, tmp_path / "world.lp")
    assert observer.observe(("cup", "x")).believed == {"c(leak,1)"}
    assert observer.observe(("cup", "x")).believed == {"c(leak,1)"}
    observer.observe(("fix(leak)", "yes"))
    for _ in range(3):
        assert observer.observe(("bell", "u")) == Found(
            frozenset(), frozenset(), frozenset(), frozenset({"c(leak,1)", "c(leak,2)"})
        )
    assert observer.observe(("cup", "x")).believed == {"c(dust,1)"}


def test_a_refuted_cause_is_not_forgotten_where_all_others_leave_more_open(tmp_path: Path) -> None:
    observer = Observer(LAMP._replace(things=("lamp", "radio", "bell")), tmp_path / "world.lp")
    observer.observe(("lamp", "x"))
    assert observer.observe(("radio", "u")).believed == frozenset()
    for step in (3, 4, 5):
        either = {"c(fuse,1)", "c(fuse,3)"}
        assert observer.observe(("lamp" if step == 3 else "bell", "x")).possible == either
