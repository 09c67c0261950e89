"""Why a delivery waits, and what would be instead: on random maps, against fresh planners.

``WHY_MAPS=0:300 python -m pytest rosoclingo_aspprograms/test/planning/test_why.py`` takes more
maps, those from 0 to 299, and blocks the ways in each order. FULL=1 takes 20.
"""

from __future__ import annotations

import itertools
import os
import random
from pathlib import Path
from typing import Dict, FrozenSet, Iterable, List, Optional, Sequence, Tuple

import pytest
from draws import draws
from episode import DYN_RESET, MAILBOT, OFFICE, PACKAGE, RECORDING, SINGLE, Episode
from instance_map import InstanceMap
from oracle import shortest

from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.wire.commands import Result
from rosclingo.wire.term_text import split_term
from rosoclingo.errors import QuestionError
from rosoclingo.loop.planner.planner import Planner
from rosoclingo.loop.situation import Situation
from rosoclingo.loop.values.atoms import Plan
from rosoclingo.why.explainer import Explainer
from rosoclingo.why.facts import FactKind
from rosoclingo.why.reason import MinimalReason
from rosoclingo_aspprograms.validator import Edge

MAPS = range(*map(int, os.environ.get("WHY_MAPS", "0:0").split(":")))
SECONDS = 600.0  # no more than a bound
IN_OFFICE = Options((OFFICE, MAILBOT), ("-c", "slots=2"))


class Building:
    """A random map: rooms, some of which have several ways.

    Attributes:
        graph: The map.
        options: The planner's command line.
        room: A room that has two or three ways.
        ways: These.
        pick: The source of random numbers.
    """

    def __init__(self, seed: int, folder: Path, slots: int = 3) -> None:
        pick = self.pick = random.Random(seed)
        nodes = [f"n{number}" for number in range(pick.randint(5, 9))]
        edges = {frozenset((node, pick.choice(nodes[:i]))) for i, node in enumerate(nodes) if i}
        edges |= {frozenset(pick.sample(nodes, 2)) for _ in range(len(nodes) // 2)}
        self.room = "room"
        ways = {frozenset((self.room, n)) for n in pick.sample(nodes, pick.randint(2, 3))}
        offices = {self.room, *pick.sample(nodes, 2)}
        self.graph = InstanceMap(offices, edges | ways, {"mailbot": nodes[0]})
        self.ways = sorted(ways, key=sorted)
        file = folder / "building.lp"
        facts = [f"office({office})." for office in sorted(offices)]
        facts += [
            "connection({},{}).".format(*sorted(e)) for e in sorted(self.graph.edges, key=sorted)
        ]
        file.write_text("\n".join([*facts, f"start(mailbot,{nodes[0]})."]))
        self.options = Options((str(file), MAILBOT), ("-c", f"slots={slots}"))
        self.job = (self.room, pick.choice(sorted(offices - {self.room})))
        if pick.random() < 0.5:
            self.job = (self.job[1], self.job[0])

    @property
    def request(self) -> str:
        return "bring({},{})".format(*self.job)

    def blocked(self, edge: Edge) -> str:
        return "blocked({},{})".format(*self.pick.sample(sorted(edge), 2))


def one_shot(options: Options, told: Iterable[str], slot: str = "1") -> Optional[int]:
    """Returns how many steps a fresh planner needs until a goal ends; None for no such plan.

    All is told in the first step.
    """
    planner = Planner(Engine(options))
    planner.begin()
    events = (split_term(atom)[1] for atom in told)
    assert not planner.tell([f"event({source},{content},0)" for source, content, _ in events])
    planner.query(0, None, ())
    outcome = planner.search(0, 0, lambda: False)
    horizon = planner.needed or 0
    outcome = planner.search(0, horizon, lambda: False)
    assert outcome.result is Result.SAT
    plan = Plan(outcome.symbols)
    ends = [
        s for step in range(horizon + 1) for s, word in plan.statuses(step) if word != "accepted"
    ]
    return horizon if slot in ends else None


def check(building: Building, reason: Optional[MinimalReason], request: str) -> None:
    """Checks that the facts suffice, and that each is needed."""
    assert reason is not None
    assert reason.is_complete
    assert not reason.given
    atoms = [atom for member in reason.members for atom in member.fact.atoms]
    assert one_shot(building.options, [request, *atoms]) is None
    for member in reason.members:
        rest = [request, *(atom for atom in atoms if atom not in member.fact.atoms)]
        assert member.without is not None
        assert one_shot(building.options, rest) == member.without.steps


def smallest(building: Building, told: Iterable[str]) -> int:
    """Returns how few of the ways that are blocked suffice to cut the room off."""
    edges = sorted(closed(told), key=sorted)
    ends = {building.graph.starts["mailbot"], *building.job}
    for number in range(1, len(edges) + 1):
        for some in itertools.combinations(edges, number):
            if not building.graph.distances(building.job[0], some).keys() >= ends:
                return number
    raise AssertionError("the room can be reached")


def closed(atoms: Iterable[str]) -> FrozenSet[Edge]:
    return frozenset(frozenset(split_term(split_term(a)[1][1])[1]) for a in atoms if "blocked" in a)


@pytest.mark.costly
@pytest.mark.parametrize("seed", MAPS or draws([2, 5], 20))
def test_what_is_named_suffices_and_each_of_it_is_needed(seed: int, tmp_path: Path) -> None:
    """All ways to a room are blocked, one after the other."""
    building = Building(seed, tmp_path, slots=1)
    orders: List[Sequence[Edge]] = list(itertools.permutations(building.ways))
    if not MAPS:
        orders = [building.pick.choice(orders)]
    for order in orders:
        others = [e for e in building.graph.edges if e not in order]
        noise = building.pick.sample(sorted(others, key=sorted), 2)
        edges = [*noise, *order]
        request = f"event(1,{building.request},{building.pick.randint(0, len(edges))})"
        told = [f"event(info,{building.blocked(e)},{step})" for step, e in enumerate(edges)]
        situation = Situation(
            (request, *told), step=len(told), last=60, goals=(("1", building.request),)
        )
        answer = Explainer(building.options, situation, seconds=SECONDS).goal("1")
        assert answer.no_plan is not None
        reason = answer.no_plan.reason
        check(building, reason, request)
        assert reason is not None
        assert reason.is_smallest
        assert len(reason.members) == smallest(building, told)


def drawn(seed: int, folder: Path) -> Tuple[Building, Situation, List[str], List[Edge]]:
    """Returns a random state without a plan so far: goals, and ways that are blocked."""
    building = Building(seed, folder)
    pick = building.pick
    offices = sorted(building.graph.offices)
    jobs = [tuple(pick.sample(offices, 2)) for _ in range(pick.randint(1, 2))]
    requests = ["bring({},{})".format(*job) for job in jobs]
    edges = pick.sample(sorted(building.graph.edges, key=sorted), pick.randint(0, 2))
    told = [f"event({slot},{request},0)" for slot, request in enumerate(requests, 1)]
    told += [f"event(info,{building.blocked(edge)},0)" for edge in edges]
    goals = tuple((str(slot), request) for slot, request in enumerate(requests, 1))
    return building, Situation(tuple(told), last=60, goals=goals), requests, edges


def length(building: Building, place: str, requests: Sequence[str], blocked: Iterable[Edge]) -> int:
    """Returns the length of a shortest plan, found without a solver."""
    jobs = [tuple(split_term(request)[1]) for request in requests]
    return shortest(building.graph, place, None, jobs, blocked)  # type: ignore[arg-type]


@pytest.mark.costly
@pytest.mark.parametrize("seed", draws([1, 3, 9], 10))
def test_another_first_move(seed: int, tmp_path: Path) -> None:
    building, situation, requests, blocked = drawn(seed, tmp_path)
    start = building.graph.starts["mailbot"]
    best = length(building, start, requests, blocked)
    free = building.graph.edges.difference(blocked)
    near = {next(iter(e - {start})) for e in free if start in e}
    reachable = building.graph.distances(start, blocked)
    served = sum(reachable.keys() >= set(split_term(r)[1]) for r in requests)
    if not served:
        return
    explainer = Explainer(building.options, situation, seconds=SECONDS)
    lengths = {place: 1 + length(building, place, requests, blocked) for place in near}
    for place in sorted(building.graph.distances(start))[:4]:
        if place == start:
            continue
        answer = explainer.why_not(f"do(mailbot,go({place}),1)")
        if place not in near:
            assert answer.other is None
            named = closed(a for m in answer.reason.members for a in m.fact.atoms)  # type: ignore[union-attr]
            way = frozenset((start, place))
            assert named == ({way} if way in building.graph.edges else set())
            continue
        assert answer.plan is not None
        assert answer.plan.horizon == best
        assert answer.other is not None
        assert answer.other.horizon == lengths[place]
        assert answer.longer == lengths[place] - best
        without = explainer.why(f"do(mailbot,go({place}),1)").other
        assert without is not None
        others = [length for other, length in lengths.items() if other != place]
        if start not in {split_term(r)[1][0] for r in requests}:
            assert without.horizon == min([*others, best + 1])
        else:
            assert without.horizon <= min([*others, best + 1])


@pytest.mark.costly
@pytest.mark.parametrize("seed", draws(range(4), 6))
def test_what_would_be(seed: int, tmp_path: Path) -> None:
    building, situation, requests, blocked = drawn(seed, tmp_path)
    start = building.graph.starts["mailbot"]
    edge = building.pick.choice(sorted(building.graph.edges, key=sorted))
    new = "bring({},{})".format(*building.pick.sample(sorted(building.graph.offices), 2))
    explainer = Explainer(building.options, situation, seconds=SECONDS)
    answer = explainer.what_if([f"goal:{new}", f"info:{building.blocked(edge)}"])
    told = [*requests, new]
    blocked = [*blocked, edge]
    reachable = building.graph.distances(start, blocked)
    if all(reachable.keys() >= set(split_term(r)[1]) for r in told):
        assert answer.plan is not None
        assert answer.plan.horizon == length(building, start, told, blocked)
    else:
        assert answer.plan is None
        assert answer.no_plan is not None
        assert answer.no_plan.reason is not None


def run(
    mode: str, happens: Dict[int, Sequence[str]], steps: int, planner: Options = IN_OFFICE
) -> Tuple[Situation, Episode]:
    """Returns the situation of a run in the office, after so many actions."""
    graph = InstanceMap.read(Path(OFFICE))
    episode = Episode(mode, graph, list(planner.files), options=planner.clingo)
    goals = {}

    def turn() -> bool:
        for event in happens.get(len(episode.published), ()):
            name, _, content = event.partition(":")
            if name == "goal":
                goals[content] = episode.request(content)
            elif name == "fails":
                episode.answer("mailbot", "failure")
            else:
                episode.announce(content)
        happens.pop(len(episode.published), None)
        if len(episode.published) >= steps:
            return bool(episode._items)
        for actuator in sorted(episode.acting):
            episode.answer(actuator)
        return bool(episode._items)

    episode.play(turn)
    return Situation.of(episode.loop.state, 60), episode


@pytest.mark.costly
def test_a_blocked_room_is_said_in_words() -> None:
    situation, _ = run(RECORDING, {0: ["goal:bring(o9,o14)"], 2: ["info:blocked(c5,o9)"]}, 3)
    answer = Explainer(IN_OFFICE, situation, seconds=SECONDS).goal("1")
    assert answer.text.startswith(
        "There is no plan for bring(o9,o14) because the way between c5 and o9 is blocked. Without "
        "that, there would be a plan of "
    )


@pytest.mark.costly
@pytest.mark.parametrize("mode", [RECORDING, DYN_RESET])
def test_a_failure_is_named_and_what_came_before_a_reset(mode: str) -> None:
    """The robot finds the only way to o2 blocked after it has served another goal."""
    happens: Dict[int, Sequence[str]] = {
        0: ["goal:bring(o1,o3)"],
        3: ["info:blocked(c3,c4)"],
        6: ["goal:bring(o2,o1)"],
        9: ["fails:"],
    }
    situation, episode = run(mode, happens, 9)
    assert episode.actions[8] == "go(o2)"
    answer = Explainer(IN_OFFICE, situation, seconds=SECONDS).goal("bring(o2,o1)")
    assert answer.no_plan is not None
    reason = answer.no_plan.reason
    assert reason is not None
    failures = [m.fact for m in reason.members if m.fact.kind is FactKind.FAILURE]
    assert [fact.content for fact in failures] == ["go(o2)"]
    assert "mailbot has failed to go to o2 in step" in answer.text
    assert "c3" not in answer.text


@pytest.mark.costly
def test_a_way_blocked_before_a_reset_is_named() -> None:
    happens: Dict[int, Sequence[str]] = {
        0: ["goal:bring(o1,o3)"],
        3: ["info:blocked(c2,o2)"],
        6: ["goal:bring(o2,o1)"],
    }
    situation, _ = run(DYN_RESET, happens, 7)
    assert situation.step == 0 or "event(save,blocked(c2,o2),0)" in situation.told
    text = Explainer(IN_OFFICE, situation, seconds=SECONDS).no_plan().text
    assert text.startswith("There is no plan for bring(o2,o1) because the way between c2 and o2 is")


@pytest.mark.costly
def test_where_the_robot_has_gone_is_named() -> None:
    """It has gone into an office, and the way out is blocked."""
    happens: Dict[int, Sequence[str]] = {
        0: ["goal:bring(o2,o3)", "goal:bring(o1,o3)"],
        3: ["info:blocked(c1,o1)"],
    }
    situation, episode = run(RECORDING, happens, 3)
    assert episode.actions == ["go(c1)", "go(o1)", "pickup(2)"]
    explainer = Explainer(IN_OFFICE, situation, seconds=SECONDS)
    reason = explainer.goal("bring(o2,o3)").no_plan.reason  # type: ignore[union-attr]
    assert reason is not None
    named = [member.fact.content for member in reason.members]
    assert named == ["blocked(c1,o1)", "go(o1)"]
    assert [fact.content for fact in reason.given if fact.kind is FactKind.ACTION] == ["go(c1)"]


@pytest.mark.costly
def test_an_action_that_is_asked_about_may_be_impossible_or_planned() -> None:
    told = ("event(1,bring(o9,o14),0)", "event(info,blocked(open1,c6),0)")
    situation = Situation(told, last=60, goals=(("1", "bring(o9,o14)"),))
    explainer = Explainer(IN_OFFICE, situation, seconds=SECONDS)
    assert explainer.why_not("do(mailbot,go(c6),1)").text == (
        "mailbot cannot go to c6 in step 1 because the way between open1 and c6 is blocked. "
        "Without that, it could."
    )
    assert explainer.why_not("do(mailbot,go(o1),1)").text == (
        "mailbot cannot go to o1 in step 1, after what is done until then."
    )
    assert explainer.why("do(mailbot,go(c1),1)").text == (
        "If mailbot were not to go to c1 in step 1, the best plan would take 13 steps, 1 more than "
        "now."
    )
    assert explainer.why("do(mailbot,go(open2),1)").text.startswith(
        "The plan has no such action in step 1, but go("
    )
    later = explainer.why_not("do(mailbot,go(c1),3)")
    assert later.other is not None
    assert later.other.actions[:4] == (
        "do(mailbot,go(c1),1)", "do(mailbot,go(c2),2)", "do(mailbot,go(c1),3)",
        "do(mailbot,go(c2),4)",
    )  # fmt: skip
    assert later.longer == 2


@pytest.mark.costly
def test_a_refill_that_is_put_off() -> None:
    """A goal has ended before, and needs not end again."""
    garden = PACKAGE / "plants"
    files = (str(garden / "instances/garden.lp"), str(garden / "plants.lp"))
    goals = (("1", "water((3,4))"), ("2", "water((2,2))"))
    told = tuple(f"event({slot},{request},0)" for slot, request in goals)
    situation = Situation(told, last=40, goals=goals)
    explainer = Explainer(Options(files, ("-c", "full=1")), situation, seconds=SECONDS)
    plan = explainer.no_plan().plan
    assert plan is not None
    assert plan.horizon == 12
    (fill,) = [action for action in plan.actions if "fill" in action]
    answer = explainer.why(fill)
    assert answer.longer == 1
    assert answer.other is not None
    assert any("fill" in action for action in answer.other.actions)


@pytest.mark.costly
def test_it_does_not_know_everything() -> None:
    situation, _ = run(RECORDING, {0: ["goal:bring(o1,o3)"]}, 1)
    explainer = Explainer(IN_OFFICE, situation, seconds=SECONDS)
    for question, words in (
        (lambda: explainer.goal("bring(o3,o1)"), "no open goal bring"),
        (lambda: explainer.why("go(c1)"), "no action"),
        (lambda: explainer.why("do(mailbot,go(c1),0)"), "has gone by"),
        (lambda: explainer.what_if(["info:blocked(o1,o2)"]), "does not know it"),
        (lambda: explainer.what_if(["blocked(o1,o2)"]), "is no event"),
    ):
        with pytest.raises(QuestionError, match=words):
            question()


@pytest.mark.costly
@pytest.mark.parametrize("seed", draws([0], 3))
def test_a_long_history_makes_no_other_answer(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """What was done long ago is told as what held in the end; the steps are those of the loop."""
    pick = random.Random(seed)
    offices = [f"o{number}" for number in range(1, 15) if number not in (9, 14)]
    words = ["bring({},{})".format(*pick.sample(offices, 2)) for _ in range(3)]
    happens: Dict[int, Sequence[str]] = {
        0: [f"goal:{word}" for word in words[:2]],
        1: ["info:blocked(c3,c4)"],
        pick.randrange(6, 12): [f"goal:{words[2]}"],
        pick.randrange(12, 15): ["info:blocked(c5,o9)"],
        pick.randrange(20, 23): ["goal:bring(o9,o14)"],
    }
    options = Options((OFFICE, MAILBOT))
    short, episode = run(SINGLE, happens, 24, options)
    assert short.offset + short.step == episode.loop.state.step > 20
    monkeypatch.setattr("rosoclingo.loop.situation._HISTORY", 1000)
    full = Situation.of(episode.loop.state, 60)
    assert full.offset == 0
    assert len(full.told) > len(short.told)
    explainers = [Explainer(options, told, seconds=SECONDS) for told in (short, full)]
    answers = [explainer.goal("bring(o9,o14)") for explainer in explainers]
    for answer in answers:
        assert "the way between c5 and o9 is blocked" in answer.text
        assert answer.no_plan is not None
        assert answer.no_plan.reason is not None
    opened = [explainer.what_if(["info:unblocked(o9,c5)"]) for explainer in explainers]
    assert opened[0].plan is not None
    assert opened[1].plan is not None
    assert opened[0].told == opened[1].told
    assert opened[0].plan.step == opened[1].plan.step
    assert opened[0].plan.horizon == opened[1].plan.horizon
    assert len(opened[0].plan.actions) == len(opened[1].plan.actions)
    assert {slot for slot, _, step in opened[0].plan.ends if step > full.step} == {
        slot for slot, _, step in opened[1].plan.ends if step > full.step
    }
