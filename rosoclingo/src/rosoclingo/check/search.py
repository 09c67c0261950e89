"""Runs by chance, and the smallest one in which something is wrong."""

from __future__ import annotations

import random
from dataclasses import dataclass, field, replace
from typing import Any, Callable, Dict, List, Optional, Set

from rosoclingo.check import twins
from rosoclingo.check.alphabet import Alphabet
from rosoclingo.check.findings import Finding, Words
from rosoclingo.check.invariants import findings
from rosoclingo.check.run import Run, Runner
from rosoclingo.check.twins import Inputs
from rosoclingo.desk.inputs import AFTER, CANCEL, GOAL, IN, STEP, Input, Moment
from rosoclingo.loop.journal import CommandDone

_ALONE = 6  # requests that are asked for alone
_MOST_GOALS, _MOST_OTHERS = 3, 2  # in an episode
_SPARE = 10  # steps, for what comes late
_SHRINKING = 150  # runs to shrink an episode


@dataclass(frozen=True)
class Episode:
    """What comes in a run, and when.

    Attributes:
        inputs: What comes.
        steps_to_reset: After how many steps the past is forgotten, in a second run; 0 for none.
    """

    inputs: Inputs
    steps_to_reset: int = 0


@dataclass
class Search:
    """Looks for runs in which something is wrong.

    Attributes:
        files: The files and options of the command line, as they were typed.
        alphabet: What can come.
        mode: Another mode than the usual one, as it was typed; empty for that.
        resets: The mode that forgets the past; empty if the encoding cannot do that.
        steps: The longest plan; 0 if that is not known yet.
        runner: Makes the runs.
        count: How many episodes there were.
        ignored: Checks that have found something already.
    """

    files: Words
    alphabet: Alphabet
    mode: str = ""
    resets: str = ""
    steps: int = 0
    runner: Runner = field(default_factory=Runner)
    count: int = 0
    ignored: Set[str] = field(default_factory=set)
    _judged: Dict[Episode, List[Finding]] = field(default_factory=dict)
    _last_moment: int = 8
    _last_command: int = 60

    def words(self, inputs: Inputs, mode: str = "") -> Words:
        """Returns the arguments of ``plan.py`` for a run."""
        mode = mode or self.mode
        typed = [*self.files, *(["--mode", *mode.split()] if mode else []), "--simulate"]
        if self.steps:
            typed += ["-c", f"steps={self.steps}"]
            typed += ["--most-steps", str(3 * self.steps)]
        at_first = [one for one in inputs if _is_goal_at_first(one)]
        typed += [word for one in at_first for word in ("--goal", one.value)]
        for one in inputs:
            if one not in at_first:
                typed += ["--at", str(one.moment), str(one)]
        return tuple(typed)

    def run(self, inputs: Inputs, mode: str = "") -> Run:
        """Makes a run."""
        return self.runner.run(self.words(inputs, mode))

    def alone(self) -> List[Finding]:
        """Asks for some requests alone, and learns how long plans are."""
        nothing = self.run(())
        found = self._new(findings(nothing))
        if not nothing.dynamic:
            self.alphabet = replace(self.alphabet, requests=())
        requests = self.alphabet.requests
        some = requests[:: max(1, len(requests) // _ALONE)][:_ALONE]
        longest = commands = 0
        for request in some:
            self.count += 1
            run = self.run((Input(GOAL, request),))
            found += self._new(findings(run))
            longest = max(longest, run.steps)
            commands = max(commands, sum(isinstance(event, CommandDone) for event in run.events))
        if not self.steps:
            self.steps = (_MOST_GOALS + 1) * (longest + 1) + _SPARE
        self._last_moment = longest + 4
        self._last_command = commands + 4
        return found

    def by_chance(self, episodes: int, seed: int) -> Optional[Finding]:
        """Makes random episodes until something is found, and shrinks the one.

        Args:
            episodes: How many, at most.
            seed: Start of the random numbers.
        """
        # It takes half a second, and who only looks at an encoding need not have it.
        from hypothesis import HealthCheck, Phase, Verbosity, find, settings  # noqa: PLC0415
        from hypothesis.errors import NoSuchExample  # noqa: PLC0415

        if not self.alphabet.requests:
            return None
        shrinker = _Shrinker(self.judge)
        try:
            smallest = find(
                _episodes(self.alphabet, self._last_moment, self._last_command, bool(self.resets)),
                shrinker.is_wrong,
                settings=settings(
                    max_examples=episodes,
                    database=None,
                    deadline=None,
                    phases=(Phase.generate, Phase.shrink),
                    suppress_health_check=list(HealthCheck),
                    verbosity=Verbosity.quiet,
                ),
                random=random.Random(seed),  # noqa: S311 (no secret)
            )
        except NoSuchExample:
            return None
        return self.judge(smallest)[0]

    def judge(self, episode: Episode) -> List[Finding]:
        """Returns what is wrong in an episode."""
        if episode not in self._judged:
            self.count += 1
            self._judged[episode] = self._judge(episode)
        return self._new(self._judged[episode])

    def _judge(self, episode: Episode) -> List[Finding]:
        run = self.run(episode.inputs)
        found = findings(run)
        if found:
            return found
        mode = f"{self.resets} -c r={episode.steps_to_reset}"

        def with_resets(inputs: Inputs) -> Run:
            return self.run(inputs, mode)

        resets = with_resets if self.resets and episode.steps_to_reset else None
        return twins.compare(episode.inputs, run, self.run, resets)

    def _new(self, found: List[Finding]) -> List[Finding]:
        return [finding for finding in found if finding.check not in self.ignored]


class _Shrinker:
    """Says what is as wrong as what was found first, for as long as that may take."""

    def __init__(self, judge: Callable[[Episode], List[Finding]]) -> None:
        self._judge = judge
        self._check = ""
        self._known: Dict[Episode, bool] = {}
        self._left = _SHRINKING

    def is_wrong(self, episode: Episode) -> bool:
        """Whether this episode shows what the first one has shown."""
        if episode in self._known:
            return self._known[episode]
        if self._check:
            self._left -= 1
            if self._left < 0:
                return False
        found = self._judge(episode)
        if found and not self._check:
            self._check = found[0].check
        self._known[episode] = bool(found) and found[0].check == self._check
        return self._known[episode]


def _episodes(alphabet: Alphabet, last: int, commands: int, resets: bool) -> Any:
    """Returns hypothesis's strategy of episodes."""
    from hypothesis import strategies as st  # noqa: PLC0415 (as above)

    steps = st.builds(Moment, st.just(STEP), st.integers(0, last))
    anywhere = st.one_of(
        steps, st.builds(Moment, st.sampled_from((IN, AFTER)), st.integers(1, commands))
    )
    begins = st.one_of(st.just(Moment()), st.just(Moment()), anywhere)

    def inputs(kind: Any, values: Any, moments: Any, most: int, least: int = 0) -> Any:
        one = st.tuples(kind, values, moments).map(lambda parts: Input(*parts))
        return st.lists(one, min_size=least, max_size=most)

    def pairs(known: Any, most: int, moments: Any) -> Any:
        if not known:
            return st.just([])
        one = st.tuples(st.sampled_from(list(known)), moments)
        return st.lists(one.map(lambda p: Input(p[0][0], p[0][1], p[1])), max_size=most)

    cancels = st.integers(1, _MOST_GOALS).map(str)
    later = st.builds(Moment, st.just(STEP), st.integers(1, last))
    parts = st.tuples(
        inputs(st.just(GOAL), st.sampled_from(list(alphabet.requests)), begins, _MOST_GOALS, 1),
        inputs(st.just(CANCEL), cancels, anywhere, _MOST_OTHERS)
        if alphabet.cancels else st.just([]),
        pairs(alphabet.failures, _MOST_OTHERS, later),
        pairs(alphabet.messages, _MOST_OTHERS, anywhere),
        st.integers(0, 3) if resets else st.just(0),
    )  # fmt: skip
    return parts.map(
        lambda drawn: Episode(
            twins.renumbered(tuple(one for part in drawn[:4] for one in part)), drawn[4]
        )
    )


def _is_goal_at_first(one: Input) -> bool:
    return one.kind == GOAL and (one.moment.kind, one.moment.number) == (STEP, 0)
