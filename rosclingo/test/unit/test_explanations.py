"""Explanations of random cases are those of an enumeration by brute force, and bad ones refused."""

from __future__ import annotations

import random
from itertools import combinations
from typing import Dict, Iterator, List, NamedTuple, Set, Tuple

import pytest

from rosclingo.solver.diagnosis import CaseFact, diagnose
from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.solver.terms import parse_term
from rosclingo.wire.commands import Add, CleanupDomains, Ground, Part, Reply

Pair = Tuple[str, str]  # an observation and a value
Found = Tuple[int, int, Tuple[str, ...], Tuple[str, ...]]  # left open, weight, causes, left


class Case(NamedTuple):
    """A small world, and what was observed in it."""

    weights: Dict[str, int]
    makes: Set[Tuple[str, Pair]]
    may_make: Set[Tuple[str, Pair]]
    usual: Set[Pair]
    observed: Set[Pair]
    excludes: Set[Pair]
    ended: Set[Pair]  # a cause, and what it says nothing of any more

    @property
    def facts(self) -> List[CaseFact]:
        texts = [
            *(f"cause({cause},{weight})" for cause, weight in self.weights.items()),
            *(f"makes({cause},{o},{x})" for cause, (o, x) in sorted(self.makes)),
            *(f"may_make({cause},{o},{x})" for cause, (o, x) in sorted(self.may_make)),
            *(f"usual({o},{x})" for o, x in sorted(self.usual)),
            *(f"observed({o},{x})" for o, x in sorted(self.observed)),
            *(f"excludes({c},{d})" for c, d in sorted(self.excludes)),
            *(f"ended({c},{o})" for c, o in sorted(self.ended)),
        ]
        return [(term.name, tuple(term.arguments)) for term in map(parse_term, texts)]


def draw(dice: random.Random) -> Case:
    causes = [f"c{number}" for number in range(dice.randint(1, 7))]
    places = [f"o{number}" for number in range(dice.randint(1, 5))]
    values = ["x", "y", "z"]
    pairs = [(place, value) for place in places for value in values]
    links = [(cause, pair) for cause in causes for pair in pairs]
    both = [(cause, place) for cause in causes for place in places]
    return Case(
        weights={cause: dice.randint(1, 4) for cause in causes},
        makes=set(dice.sample(links, dice.randint(0, len(links) // dice.choice([2, 8])))),
        may_make=set(dice.sample(links, dice.randint(0, len(links) // 5))),
        usual={(place, dice.choice(values)) for place in places if dice.random() < 0.8},
        observed={(place, dice.choice(values)) for place in places if dice.random() < 0.9},
        excludes={
            (dice.choice(causes), dice.choice(causes)) for _ in range(dice.choice([0, 0, 1]))
        },
        ended=set(dice.sample(both, dice.choice([0, len(both) // 4]))),
    )


def enumerated(case: Case) -> Iterator[Found]:
    """Yields all explanations of a case, the best one first."""
    found: List[Tuple[int, Found]] = []
    names = sorted(case.weights)
    for size in range(len(names) + 1):
        for causes in combinations(names, size):
            so = set(causes)
            if any(c in so and d in so and c != d for c, d in case.excludes):
                continue
            left = tuple(sorted({o for o, x in case.observed if not is_possible(case, so, (o, x))}))
            weight = sum(case.weights[cause] for cause in causes)
            found.append((len(left), (len(left), weight, causes, left)))
    fewest = min(count for count, _ in found)
    best = sorted(one for count, one in found if count == fewest)
    for one in best:
        if not any(set(other[2]) < set(one[2]) for other in best):
            yield one


def is_possible(case: Case, so: Set[str], pair: Pair) -> bool:
    active = {cause for cause in so if (cause, pair[0]) not in case.ended}
    if any((cause, pair) in case.makes | case.may_make for cause in active):
        return True
    speaks = any(cause in active and said[0] == pair[0] for cause, said in case.makes)
    return pair in case.usual and not speaks


@pytest.mark.parametrize("block", range(3))
def test_explanations_are_those_of_an_enumeration(block: int) -> None:
    """Weights, ties, order, what is certain and what is possible, of 100 random worlds each."""
    sizes = set()
    kinds: Set[str] = set()
    for seed in range(100 * block, 100 * block + 100):
        dice = random.Random(seed)
        case, most, margin = draw(dice), dice.randint(1, 6), dice.randint(0, 4)
        every = list(enumerated(case))
        best = [one for one in every if one[1] == every[0][1]]
        found = diagnose(case.facts, most, margin)
        kept = [
            (len(one.unexplained), one.weight, texts(one.causes), texts(one.unexplained))
            for one in found.kept
        ]
        assert kept == [one for one in every if one[1] <= every[0][1] + margin][:most], seed
        assert set(texts(found.certain)) == set.intersection(*(set(one[2]) for one in best)), seed
        assert set(texts(found.possible)) == set.union(*(set(one[2]) for one in best)), seed
        sizes |= {len(kept), -len(best)}
        kinds |= {"left open"} if best[0][3] and best[0][2] else set()
        kinds |= {"ended"} if case.ended.intersection((c, o) for c, (o, _) in case.makes) else set()
    assert {1, 2, -1, -2} <= sizes  # there were ties, and cases with several explanations
    assert kinds == {"left open", "ended"}


def texts(symbols: object) -> Tuple[str, ...]:
    return tuple(map(str, symbols))  # type: ignore[call-overload]  # symbols of any kind


ASK = "#program ask(g,n,m). found(X,g) :- X = @explanations(g,n,m). #show found/2."


@pytest.fixture
def engine() -> Engine:
    made = Engine(Options())
    assert made.run([Add("base", (), ASK), Ground((Part("base"),))]).failure is None
    return made


def add(engine: Engine, name: str, facts: str) -> Reply:
    return engine.run([Add(name, (), facts), Ground((Part(name),))])


def ask(engine: Engine, case: str, most: str = "3", margin: str = "2") -> Reply:
    return engine.run([Ground((Part("ask", (case, most, margin)),))])


def found_in(engine: Engine, case: str) -> List[str]:
    """Returns what was found in a case, in clingo's order."""
    end = f",{case})"
    symbols = [text for text in engine.solve().symbols if text.endswith(end)]
    return [text[len("found(") : -len(end)] for text in symbols]


LAMP = "observed(lamp,dark,{0}). usual(lamp,lit,{0}). cause((bulb;fuse),2,{0}). "
DARK = "makes((bulb;fuse),lamp,dark,{0}). "
SILENT = "usual(radio,plays,{0}). observed(radio,plays,{0}). makes(fuse,radio,silent,{0})."


def test_a_belief_is_taken_back_in_a_later_case(engine: Engine) -> None:
    assert add(engine, "first", (LAMP + DARK).format("1")).failure is None
    assert ask(engine, "1").failure is None
    assert "because(2,fuse)" in found_in(engine, "1")
    assert add(engine, "second", (LAMP + DARK + SILENT).format("2")).failure is None
    assert ask(engine, "2").failure is None
    assert set(found_in(engine, "2")) == {
        "weighs(1,2)",
        "because(1,bulb)",
        "certain(bulb)",
        "possible(bulb)",
    }


def test_cases_may_be_asked_for_in_any_order(engine: Engine) -> None:
    """And again, with other limits; but not when others were asked for since."""
    for case in range(1, 8):
        assert add(engine, f"part{case}", (LAMP + DARK).format(case)).failure is None
    for case, most in ((2, "3"), (1, "3"), (2, "1"), (3, "3"), (4, "3"), (5, "3"), (6, "3")):
        assert ask(engine, str(case), most).failure is None
        assert "because(1,bulb)" in found_in(engine, str(case))
    failure = ask(engine, "1", "2").failure
    assert failure is not None
    assert "the case 1 was asked for too long ago" in failure.message


def test_what_nothing_explains_is_said(engine: Engine) -> None:
    assert add(engine, "first", LAMP.format("1")).failure is None
    assert ask(engine, "1").failure is None
    assert found_in(engine, "1") == ["weighs(1,0)", "unexplained(1,lamp)"]


def test_nothing_is_to_be_explained(engine: Engine) -> None:
    assert ask(engine, "1").failure is None
    assert found_in(engine, "1") == ["weighs(1,0)"]


def test_a_case_is_known_after_a_cleanup(engine: Engine) -> None:
    assert add(engine, "first", (LAMP + DARK).format("1")).failure is None
    assert engine.run([CleanupDomains()]).failure is None
    assert ask(engine, "1").failure is None
    assert "because(1,bulb)" in found_in(engine, "1")


@pytest.mark.parametrize(
    ("facts", "most", "pieces"),
    [
        ("cause(bulb,0,1).", "3", ["cause(bulb,0,1) has 0", "from 1 to 1000000 belongs"]),
        ("cause(bulb,much,1).", "3", ["cause(bulb,much,1) has much", "from 1 to 1000000"]),
        ("cause(bulb,1000001,1).", "3", ["has 1000001 where", "from 1 to 1000000"]),
        (
            "cause(bulb,2147483647,1). makes(bulb,lamp,dark,1). observed(lamp,dark,1).", "3",
            ["cause(bulb,2147483647,1) has 2147483647", "from 1 to 1000000"],
        ),
        ("cause(bulb,(1;2),1).", "3", ["bulb has two surprises"]),
        ("cause(1..2148,1000000,1).", "3", ["more than 2147483646 together", "case 1"]),
        ("{ observed(lamp,dark,1) }.", "3", ["observed(lamp,dark,1) is no fact"]),
        ("cause(bulb,1,1).", "0", ["explanations has 0", "from 1 to 2147483647"]),
    ],
)  # fmt: skip
def test_what_is_refused(engine: Engine, facts: str, most: str, pieces: List[str]) -> None:
    """It is refused whenever it is asked for, and the solver goes on."""
    assert add(engine, "first", facts).failure is None
    for _ in range(2):
        failure = ask(engine, "1", most).failure
        assert failure is not None
        assert all(piece in failure.message for piece in pieces), failure.message
        most = "(0)" if most == "0" else "4"
    assert engine.solve().symbols is not None


def test_the_largest_surprises_are_compared(engine: Engine) -> None:
    """Two causes that may be as surprising as any, against one that is as well."""
    facts = "observed((l;m),x,1). cause((a;b;all),1000000,1). makes(a,l,x,1). makes(b,m,x,1). "
    assert add(engine, "first", facts + "makes(all,(l;m),x,1).").failure is None
    assert ask(engine, "1", "3", "2147483647").failure is None
    assert found_in(engine, "1")[:5] == [
        "weighs(1,1000000)", "because(1,all)", "weighs(2,2000000)", "because(2,a)", "because(2,b)",
    ]  # fmt: skip


def test_what_is_usual_needs_no_cause(engine: Engine) -> None:
    """Though a cause would do as well; so it is the only explanation that can spare nothing."""
    facts = "observed(lamp,lit,1). usual(lamp,(lit;off),1). cause(sun,1,1). makes(sun,lamp,lit,1)."
    assert add(engine, "first", facts).failure is None
    assert ask(engine, "1").failure is None
    assert found_in(engine, "1") == ["weighs(1,0)"]
