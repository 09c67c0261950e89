"""Checks reasons against independent planners, in the situations of random runs.

Each run has goals, messages, failures, steps in which nothing is done, and resets, and is stopped
somewhere. Then each question why there is no plan is asked. An encoding with externals is asked for
the same by a fresh clingo; what the mailbot can reach is computed without a solver.

``SITUATIONS=300 python -m pytest rosoclingo_aspprograms/test/planning/test_why_situations.py``
makes so many draws. ``SITUATIONS_OF="robot.lp hospital.lp -c full=14"`` has further ones asked of
an encoding with externals ``event(S,C,T)``, by its files and options.
"""

from __future__ import annotations

import os
import random
import re
from dataclasses import replace
from pathlib import Path
from typing import (
    AbstractSet,
    Any,
    Callable,
    Dict,
    FrozenSet,
    Iterable,
    List,
    Optional,
    Sequence,
    Set,
    Tuple,
)

import clingo
import pytest
from clingo import ast
from draws import draws
from episode import DYN_RESET, MAILBOT, OFFICE, RECORDING, RESET
from instance_map import InstanceMap

from rosclingo.solver.options import Options, parse_options
from rosclingo.wire.term_text import last_number, split_term
from rosoclingo.encodings.alphabet import Alphabet, read_alphabet
from rosoclingo.in_process.answers import Answers
from rosoclingo.in_process.inputs import CANCEL, GOAL, Input, Moment
from rosoclingo.in_process.parts import EXAMPLES, make_parts
from rosoclingo.in_process.simulation import SimulatedSystem
from rosoclingo.loop.planner.demand import Pair
from rosoclingo.loop.situation import Situation
from rosoclingo.loop.values.atoms import PASSED, event
from rosoclingo.why.answers import WhyGoal, WhyNoPlan, later
from rosoclingo.why.explainer import Explainer
from rosoclingo.why.facts import Fact, FactKind, Facts, atoms
from rosoclingo.why.reason import MinimalReason

SECONDS = 600.0  # no more than a bound
STEPS = {"mailbot": 60}  # the last that modes plan for, and so the copies
FEWEST = 12
ENDS = "succeeded;canceled;aborted;rejected"
COURIER = Path(__file__).with_name("courier.lp")
TASKS = ["line", "courier", "rooms", "mailbot"]
TASKS += ["other"] if "SITUATIONS_OF" in os.environ else []


def options_of(task: str, seed: int, folder: Path) -> Options:
    """Returns the planner's command line of a task. Seeds vary batteries, and names of rules."""
    if task == "line":
        return Options((f"{EXAMPLES}/line.lp",))
    if task == "courier":
        battery = ["-c", "full=2"] if seed % 2 else []
        return parse_options(["-f", str(COURIER), *battery])
    if task == "mailbot":
        return Options((OFFICE, MAILBOT))
    if task == "rooms":
        file = folder / "robot.lp"
        text = Path(__file__).with_name("rooms.lp").read_text()
        text = text.replace("%!", "%") if seed % 2 else text
        file.write_text(text.replace("#program state", "way(island,islet).\n#program state", 1))
        return Options((str(file),))
    words = os.environ["SITUATIONS_OF"].split()
    files = [word for word in words if word.endswith(".lp")]
    return parse_options(
        [*(w for f in files for w in ("-f", f)), *(w for w in words if w not in files)]
    )


class Run(SimulatedSystem):
    """A run that is stopped somewhere, when the loop waits."""

    def __init__(
        self, pick: random.Random, options: Options, alphabet: Alphabet, steps: int
    ) -> None:
        self._left = pick.randint(1, 30)
        mode = pick.choice([RECORDING, RESET, DYN_RESET, DYN_RESET])
        constants = [f"steps={steps}", *(["r=3"] if mode == RESET else [])]
        parts = make_parts(mode, options, [w for c in constants for w in ("-c", c)])
        self.messages = some_messages(pick, alphabet)
        inputs = [
            Input(GOAL, pick.choice(alphabet.requests), Moment(number=pick.choice([0, 0, 3, 8])))
            for _ in range(pick.randint(1, 4))
        ]
        inputs += [
            Input(*pick.choice(self.messages), Moment(number=pick.randint(0, 10)))
            for _ in range(pick.randint(0, 6) if self.messages else 0)
        ]
        if pick.random() < 0.2:
            inputs.append(Input(CANCEL, "1", Moment(number=pick.randint(3, 9))))
        answers = Answers(fail_probability=pick.choice([0.0, 0.0, 0.2]), seed=pick.randint(0, 999))
        aborts = pick.random() < 0.8
        super().__init__(parts.loop, inputs, answers.next, abort_unreachable=aborts)

    def turn(self) -> bool:
        self._left -= 1
        return self._left > 0 and super().turn()


def some_messages(pick: random.Random, alphabet: Alphabet) -> List[Pair]:
    """Returns some messages, which may come again and again, most of them bad news."""
    bad = [m for m in alphabet.messages if split_term(m[1])[0] in ("close", "locked", "blocked")]
    good = [m for m in alphabet.messages if m not in bad and split_term(m[1])[0] != "lasts"]
    some = pick.sample(bad, min(len(bad), pick.randint(1, 6)))
    return some + pick.sample(good, min(len(good), pick.randint(0, 2)))


def situation_of(task: str, seed: int, options: Options) -> Optional[Situation]:
    """Returns the situation in which a random run is stopped; None if it has ended before.

    Often, that is when more has come than the planner has planned for.
    """
    pick = random.Random(f"{task} {seed}")
    steps = STEPS.get(task, FEWEST)
    run = Run(pick, options, _alphabet(options), steps)
    failure = run.run()
    situation = run.situation  # in which there was no plan
    if failure is None and (situation is None or pick.random() < 0.3):
        situation = Situation.of(run.loop.state)
    if situation is None:
        return None
    news = pick.sample(run.messages, min(len(run.messages), pick.randint(0, 3)))
    told = [event(source, value, situation.step) for source, value in news]
    told = [atom for atom in told if atom not in situation.told]
    return replace(situation, told=(*situation.told, *told)).up_to(steps)


_ALPHABETS: Dict[Options, Alphabet] = {}


def _alphabet(options: Options) -> Alphabet:
    if options not in _ALPHABETS:
        _ALPHABETS[options] = read_alphabet(options)
    return _ALPHABETS[options]


class Constraint:
    """A constraint as it is written: what names it, and where it stands."""

    def __init__(self, statement: ast.AST) -> None:
        begin = statement.location.begin
        rows = Path(begin.filename).read_text().splitlines()
        self.place = f"({Path(begin.filename).name}:{begin.line})"
        self.name = rows[begin.line - 2].partition("%! ")[2].rstrip(".")
        text = str(statement)
        self.can_go = not re.search(r"\bquery\(|event\(commit,|event\(info,passed,", text)

    @staticmethod
    def of(statement: ast.AST) -> Optional[Constraint]:
        """Returns that of a statement; None if it is no constraint."""
        is_rule = statement.ast_type is ast.ASTType.Rule
        return Constraint(statement) if is_rule and str(statement.head) == "#false" else None

    def is_one_of(self, rules: Iterable[Fact]) -> bool:
        """Whether one of some rules is this one."""
        return any(
            rule.content == self.name if self.name else rule.content.endswith(self.place)
            for rule in rules
        )


class FreshPlanner:
    """A clingo of its own, which is told some events, and asked for a plan.

    Attributes:
        skips: Says which constraints of the encoding do not hold.
    """

    def __init__(self, options: Options, situation: Situation) -> None:
        self._options = options
        self._situation = situation
        self.skips: Callable[[Constraint], bool] = lambda constraint: False
        control = self._grounded(0)
        declared = [str(atom.symbol) for atom in control.symbolic_atoms if atom.is_external]
        self.savable = [atom for atom in declared if atom.startswith("event(save,")]
        slots = control.symbolic_atoms.by_signature("rslot", 1)
        self.slots = [str(atom.symbol.arguments[0]) for atom in slots]

    def _grounded(self, last: int) -> clingo.Control:
        arguments = ["--opt-mode=ignore", *self._options.clingo]
        control = clingo.Control(arguments, logger=lambda *_: None)
        with ast.ProgramBuilder(control) as builder:

            def take(statement: ast.AST) -> None:
                constraint = Constraint.of(statement)
                if constraint is None or not self.skips(constraint):
                    builder.add(statement)

            ast.parse_files(list(self._options.files), take)
        control.ground([("base", []), *self._parts(0)])
        for step in range(1, last + 1):
            control.ground(self._parts(step))
        return control

    @staticmethod
    def _parts(step: int) -> List[Tuple[str, List[clingo.Symbol]]]:
        names = ("state", "transition", "query") if step else ("state", "query")
        return [(name, [clingo.Number(step)]) for name in names]

    def first(
        self, told: AbstractSet[str], goals: Iterable[str], last: Optional[int] = None
    ) -> Optional[int]:
        """Returns the first horizon with a plan in which the goals end; None if there is none."""
        last = self._situation.last if last is None else last
        control = self._grounded(last)
        rules = [":- not query(h)."]
        for slot in goals:
            since = begin(slot, told)
            rules.append(f":- not 1 {{ status({slot},({ENDS}),T) : T = {since}..h }}.")
        guard = "#external asked(h). " + " ".join(rule.replace(".", "", 0) for rule in rules)
        guard = guard.replace(":- not", ":- asked(h), not")
        control.add("asked", ["h"], guard)
        for atom in (*told, *self._situation.others):
            control.assign_external(clingo.parse_term(atom), True)
        for horizon in range(self._situation.step, last + 1):
            control.ground([("asked", [clingo.Number(horizon)])])
            own = [clingo.parse_term(f"{name}({horizon})") for name in ("query", "asked")]
            for atom in own:
                control.assign_external(atom, True)
            if control.solve().satisfiable:
                return horizon
            for atom in own:
                control.assign_external(atom, False)
        return None


def begin(slot: str, told: AbstractSet[str]) -> int:
    """Returns the step in which the last goal in a slot was told."""
    events = (split_term(atom)[1] for atom in told)
    return max((int(e[2]) for e in events if e[0] == slot and e[1] != "cancel"), default=0)


class Office:
    """A mailbot in the office, with its actions and possibilities computed without a solver."""

    savable = ()

    def __init__(self, situation: Situation) -> None:
        self._graph = InstanceMap.read(Path(OFFICE))
        self._situation = situation
        self.slots = ["1", "2", "3"]

    def first(
        self, told: AbstractSet[str], goals: Iterable[str], last: Optional[int] = None
    ) -> Optional[int]:
        """Returns some horizon if all goals have ended or can end; else None."""
        by_step: Dict[int, List[List[str]]] = {}
        for atom in told:
            events = by_step.setdefault(last_number(atom) or 0, [])
            events.append(split_term(atom)[1])
        self._place = self._graph.starts["mailbot"]
        self._load = ""
        self._blocked: Set[FrozenSet[str]] = set()
        self._open: Dict[str, List[str]] = {}
        self._back: Set[str] = set()
        self._ended: Set[str] = set()
        for step in range(max(by_step, default=0) + 1):
            self._take(by_step.get(step, []))
        can = all(slot in self._ended or self._can_end(slot) for slot in goals)
        return self._situation.step if can else None

    def _take(self, events: List[List[str]]) -> None:
        for source, content, _ in events:
            name, arguments = split_term(content)
            if source == "save":
                self._take_saved(name, arguments)
            elif name == "bring":
                self._open[source] = list(arguments)
                self._ended.discard(source)
        place = self._place
        answers = {source: content for source, content, _ in events if source == "mailbot"}
        for _, content, _ in (one for one in events if one[0] == "commit"):
            name, (argument,) = split_term(split_term(content)[1][1])
            if answers.get("mailbot") == "failure":
                if name == "go":
                    self._blocked.add(frozenset((place, argument)))
            elif name == "go":
                self._place = argument
            elif name == "pickup":
                self._load = argument
            else:
                self._load = ""
                self._open.pop(argument, None)
                self._back.discard(argument)
                self._ended.add(argument)
        for word in ("blocked", "unblocked"):
            for source, content, _ in events:
                name, arguments = split_term(content)
                if source == "info" and name == word == "blocked":
                    self._blocked.add(frozenset(arguments))
                elif source == "info" and name == word:
                    self._blocked.discard(frozenset(arguments))
        for source, content, _ in events:
            if content == "cancel" and source in self._open:
                if self._load == source:
                    self._back.add(source)
                else:
                    del self._open[source]
                    self._ended.add(source)

    def _take_saved(self, name: str, arguments: Sequence[str]) -> None:
        if name == "at":
            self._place = arguments[1]
        elif name == "carries":
            self._load = arguments[1]
        elif name == "blocked":
            self._blocked.add(frozenset(arguments))
        elif name == "canceled":
            self._back.add(arguments[0])
        elif name in ("origin", "destination"):
            ends = self._open.setdefault(arguments[0], ["", ""])
            ends[name == "destination"] = arguments[1]

    def _can_end(self, slot: str) -> bool:
        reachable = self._graph.distances(self._place, self._blocked)
        if self._load in self._open:
            origin, destination = self._open[self._load]
            if (origin if self._load in self._back else destination) not in reachable:
                return False  # it does nothing else
        if slot not in self._open:
            return False
        return slot == self._load or all(place in reachable for place in self._open[slot])


class Judge:
    """Compares answers with what planners say that are told the same."""

    def __init__(self, planner: Any, situation: Situation, pick: random.Random) -> None:
        self._planner = planner
        self._situation = situation
        self._pick = pick
        self._facts = Facts.of(situation, planner.slots, planner.savable)
        self._passed = frozenset(atom for atom in situation.told if atom.startswith(PASSED))
        self._requests = {fact.source: fact for fact in self._facts.free if is_request(fact)}
        self.count = {"a plan": 0, "horizon": 0, "reason": 0, "whatever": 0, "contradiction": 0}
        self.count.update({"names": 0, "quotes": 0})

    def judge(self, answer: WhyNoPlan, slot: str = "") -> None:
        """Checks an answer about all goals, or about the one in a slot."""
        answer = later(answer, -self._situation.offset)
        given = frozenset([self._requests[slot]] if slot in self._requests else [])
        everything = self._facts.all()
        found = self._first(everything, given, slot)
        if answer.reason is None:
            assert answer.plan is not None
            if answer.horizon is None:
                self.count["a plan"] += 1
                assert found == answer.plan.horizon or isinstance(self._planner, Office)
                assert found is not None
            else:
                self.count["horizon"] += 1
                assert found is None
                assert self._first(everything, given, slot, answer.horizon) == answer.horizon
            return
        assert found is None
        if answer.is_contradictory:
            self.count["contradiction"] += 1
            return
        self._judge_reason(answer.reason, given, slot)

    def _judge_reason(self, reason: MinimalReason, given: FrozenSet[Fact], slot: str) -> None:
        assert reason.is_complete
        known = reason.facts | given
        assert self._first(known, given, slot) is None
        self.count["reason" if reason.members else "whatever"] += 1
        for member in reason.members:
            assert member.without is not None
            first = self._first(known - {member.fact}, given, slot)
            assert first is not None, member.fact
            if not isinstance(self._planner, Office):
                assert first == member.without.horizon
        self._judge_rules(reason, known, given, slot)
        # Whatever else was told or not: the reason stands.
        others = sorted(frozenset(self._facts.free) - known, key=str)
        for _ in range(2):
            some = self._pick.sample(others, self._pick.randint(0, len(others)))
            if any(is_request(fact) for fact in some):
                continue  # other goals might end the plan sooner, or change what is asked for
            assert self._first(known.union(some), given, slot) is None

    def _judge_rules(
        self, reason: MinimalReason, known: FrozenSet[Fact], given: FrozenSet[Fact], slot: str
    ) -> None:
        """Checks what rules prevent a plan: that there is one without them, or none with them."""
        rules, planner = reason.rules, self._planner
        if not rules:
            return
        assert reason.is_examined
        assert isinstance(planner, FreshPlanner)

        def first(skips: Callable[[Constraint], bool]) -> Optional[int]:
            planner.skips = skips
            try:
                return self._first(known, given, slot)
            finally:
                planner.skips = lambda constraint: False

        if reason.relaxed is not None:
            self.count["names"] += 1
            found = first(lambda constraint: constraint.is_one_of(rules))
            assert found == reason.relaxed.horizon
            return
        self.count["quotes"] += 1
        assert first(lambda c: c.can_go and not c.is_one_of(rules)) is None
        for rule in rules:
            others = [other for other in rules if other is not rule]
            assert first(lambda c, kept=others: c.can_go and not c.is_one_of(kept)) is not None

    def _first(
        self, facts: FrozenSet[Fact], given: FrozenSet[Fact], slot: str, last: Optional[int] = None
    ) -> Optional[int]:
        facts |= given
        goals = [slot] if slot else self._goals(facts)
        return self._planner.first(atoms(facts) | self._passed, goals, last)  # type: ignore[no-any-return]

    def _goals(self, facts: FrozenSet[Fact]) -> List[str]:
        slots = [slot for slot, _ in self._situation.goals]
        return [s for s in slots if self._requests.get(s) in facts or s not in self._requests]


def is_request(fact: Fact) -> bool:
    return fact.kind is FactKind.REQUEST


@pytest.mark.costly
@pytest.mark.parametrize("task", TASKS)
def test_what_is_said_is_so(task: str, tmp_path: Path) -> None:
    counts: Dict[str, int] = {}
    seeds = draws((), 75, "SITUATIONS")  # none: up to the first one with a reason
    if "SITUATIONS" in os.environ:
        seeds = seeds[: len(seeds) // len(TASKS)]
    asked = 0
    for seed in seeds or range(75):
        if not seeds and counts.get("reason"):
            break
        options = options_of(task, seed, tmp_path)
        situation = situation_of(task, seed, options)
        if situation is None:
            continue
        asked += 1
        planner: Any = Office(situation) if task == "mailbot" else FreshPlanner(options, situation)
        judge = Judge(planner, situation, random.Random(seed))
        explainer = Explainer(options, situation, seconds=SECONDS)
        try:
            judge.judge(explainer.no_plan())
            for slot, _ in situation.goals:
                answer = explainer.goal(slot)
                assert isinstance(answer, WhyGoal)
                if answer.no_plan is not None:
                    judge.judge(answer.no_plan, slot)
        except AssertionError as err:
            raise AssertionError(f"{task} {seed}: {situation}") from err
        for word, number in judge.count.items():
            counts[word] = counts.get(word, 0) + number
    print(task, asked, counts)
    assert counts.get("reason")
