"""Plans, and executes the plan in a simulation: the command ``plan.py``. Needs no ROS.

``python3 -m rosoclingo.tools.plan`` is ``rosrun rosoclingo plan.py`` without ROS.
"""

from __future__ import annotations

import argparse
import json
import sys
import threading
from functools import lru_cache, partial
from typing import TYPE_CHECKING, Any, Callable, Dict, List, NoReturn, Optional, Sequence, Tuple

from rosclingo.errors import RosclingoError
from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.solver.programs import parse_files
from rosclingo.terminal import PROGRESS, ProgressPrinter, lines, say
from rosoclingo.drawing.errors import picture_errors
from rosoclingo.engine.task import PlanningTask
from rosoclingo.errors import ControllerError
from rosoclingo.in_process.parts import make_parts
from rosoclingo.in_process.simulation import SimulatedSystem
from rosoclingo.in_process.system import Request
from rosoclingo.loop import journal
from rosoclingo.loop.diagnosis import ELSEWHERE, NO_PLAN
from rosoclingo.loop.loop import Loop
from rosoclingo.loop.values.ids import GOAL
from rosoclingo.loop.values.phrases import TermPhrases
from rosoclingo.loop.values.snapshot import encode
from rosoclingo.tools.plan.command_line import parse, simulated
from rosoclingo.tools.plan.outcome import (
    DROPPED,
    ShownPlan,
    current_plan,
    reasons,
    refused,
    unreached,
)

# What only some options need is imported with them: all of it takes as long as a small task.
if TYPE_CHECKING:
    from rosoclingo.tools.plan.story import RunStory
    from rosoclingo.tools.profile.measuring import SolverTrace
    from rosoclingo.tools.profile.text import Profile
    from rosoclingo.why.question import WhyAnswer

_PROGRAM = "plan.py"


def main(arguments: Optional[Sequence[str]] = None) -> NoReturn:
    """Runs the command and ends the process.

    Args:
        arguments: The command line without the program's name; by default that of the process.
    """
    try:
        sys.exit(run(sys.argv[1:] if arguments is None else arguments))
    except (RosclingoError, OSError) as err:
        say(_PROGRAM, str(err))
        sys.exit(2)


def run(arguments: Sequence[str]) -> int:
    """Runs the command and returns its exit status.

    Args:
        arguments: The command line without the program's name.

    Raises:
        RosclingoError: The command line or a file is wrong.
        OSError: The picture cannot be written.
    """
    chosen = parse(arguments)
    if chosen.seed_planner is not None:
        say("warning", "--seed-planner has no effect any more: first plans come from rosoclingo")
    trace: Optional[SolverTrace] = None
    make_engine: Callable[..., Engine] = Engine
    if chosen.profile:
        from rosoclingo.tools.profile.measuring import MeasuredEngine, SolverTrace  # noqa: PLC0415

        trace = SolverTrace()
        make_engine = partial(MeasuredEngine, trace=trace)
    parts = make_parts(
        chosen.mode, chosen.options, chosen.mode_options, log=_warn, engine=make_engine
    )
    simulation = ShownSimulation(parts.loop, chosen)
    is_cut_off = threading.Event()

    def cut_off() -> None:
        is_cut_off.set()
        simulation.close()

    limit = threading.Timer(chosen.profile_seconds, cut_off)
    limit.name = "time limit"
    limit.daemon = True
    if trace is not None and chosen.profile_seconds > 0:
        limit.start()
    with ProgressPrinter(lambda: _place(simulation)):
        failure = simulation.run()
        simulation.take_situation(failure)
    limit.cancel()
    if is_cut_off.is_set():
        wrong, why, answers = [], [_cut_off(chosen, simulation)], []  # type: _Said
    else:
        wrong, why, answers = _judge(chosen, simulation, failure)
    profile = _profile(chosen.options, trace) if trace is not None else None
    simulation.finish(wrong, why, answers, profile)
    if chosen.picture is not None and simulation.plan is not None:
        _draw(chosen, simulation, simulation.plan)
    return 2 if wrong else 1 if why else 0


_Said = Tuple[List[str], List[str], List["WhyAnswer"]]


def _judge(
    chosen: argparse.Namespace, simulation: ShownSimulation, failure: Optional[RosclingoError]
) -> _Said:
    """Collects faults, and why goals were not reached, with explanations by questions."""
    wrong = refused(simulation, failure)
    if not (simulation.loop.dynamic or isinstance(failure, ControllerError)):
        messages = [one for one in chosen.inputs if one.kind != GOAL]
        wrong += [
            f"{one}: the controller's mode is static: it takes no messages" for one in messages
        ]
    lost = unreached(simulation, simulation.plan)
    if chosen.simulate:
        lost = [goal for goal in simulation.goals if not goal.ended]
    why = reasons(simulation, lost, failure)
    answers: List[WhyAnswer] = []
    if why and simulation.situation is not None and not wrong and chosen.why_seconds > 0:
        from rosoclingo.tools.plan.why import explain  # noqa: PLC0415 (see above)

        with ProgressPrinter(lambda: "looking why there is no plan"):
            answers, unanswered = explain(simulation.situation, chosen, lost)
        if answers:
            why = [simulation.in_short(text) for text in why]
        why += [answer.text for answer in answers] + unanswered
    return wrong, why, answers


def _cut_off(chosen: argparse.Namespace, simulation: ShownSimulation) -> str:
    """Says that the time for a profile was over."""
    what = "the simulation was" if simulation.plan else "planning was"
    return (
        f"{what} ended with a horizon of {simulation.loop.state.horizon} steps, after "
        f"{chosen.profile_seconds:g} s, as --profile-seconds says; the profile is of what was done "
        "until then"
    )


def _profile(options: Options, trace: SolverTrace) -> Profile:
    from rosoclingo.tools.profile.counting import count  # noqa: PLC0415 (see above)
    from rosoclingo.tools.profile.text import Profile  # noqa: PLC0415

    with ProgressPrinter(lambda: "counting what was grounded"):
        return Profile(trace, count(options, trace.commands))


def _phrases(chosen: argparse.Namespace) -> TermPhrases:
    return TermPhrases.read(parse_files(chosen.options.files).texts.values())


def _place(simulation: ShownSimulation) -> str:
    """Says how far the loop is."""
    return f"step {simulation.loop.state.step}, horizon {simulation.loop.state.horizon}"


class ShownSimulation(SimulatedSystem):
    """A simulation that shows the plan as soon as there is one, and then what happens.

    Attributes:
        plan: The first plan.
    """

    def __init__(self, make: Callable[..., Loop], chosen: argparse.Namespace) -> None:
        self.plan: Optional[ShownPlan] = None
        self._chosen = chosen
        self._is_shown = False
        self._story = self._begin_story() if self._tells else None
        super().__init__(make, **simulated(chosen))
        if chosen.task and not chosen.json:
            self.loop.state.planner.show_tasks(self._print_task)

    def _begin_story(self) -> RunStory:
        from rosoclingo.tools.plan.story import RunStory  # noqa: PLC0415 (see above)

        return RunStory(
            lambda line: _print(self.in_short(line)),
            commands=self._chosen.commands,
            phrases=lru_cache(maxsize=1)(lambda: _phrases(self._chosen)),
        )

    def turn(self) -> bool:
        """Shows the plan when the loop waits for the first time; goes on in a simulation."""
        if not self._is_shown:
            self._show()
        return bool(self._chosen.simulate) and super().turn()

    def note(self, record: journal.Record) -> None:
        """Narrates the run, once the plan is shown."""
        super().note(record)
        if self._is_shown and self._story is not None:
            self._story.hear(self.journal[-1])

    def finish(
        self,
        wrong: Sequence[str],
        why: Sequence[str],
        answers: Sequence[WhyAnswer],
        profile: Optional[Profile] = None,
    ) -> None:
        """Says how it has ended.

        Args:
            wrong: What of the input is wrong.
            why: Why goals were not reached.
            answers: What of that was found out by asking.
            profile: Where the time has gone, if that is wanted.
        """
        if not self._is_shown:  # the loop has ended before it could wait
            self._tell_all()
        if self._chosen.json:
            values = self._values(wrong, why)
            values["why"] = [json.loads(encode(answer)) for answer in answers]
            if profile is not None:
                values["profile"] = profile.values()
            print(json.dumps(values, indent=1))
        elif self._chosen.simulate:
            _print(f"after {self.elapsed} steps, at {self.clock:g} s")
            for goal in self.goals:
                _print(f"    {_name(goal)}: {_status(goal)}")
        if profile is not None and not self._chosen.json:
            _print(f"\n{profile.describe()}\n")
        for warning in self.warnings:
            if not warning.startswith(DROPPED):  # which is among what is wrong
                say("warning", self.in_short(warning) if answers else warning)
        for text in (*wrong, *why):
            say(_PROGRAM, text)

    def in_short(self, text: str) -> str:
        """Returns a reason without another horizon as a remedy: whether it is, the answer says."""
        is_asked = NO_PLAN in text and self._chosen.why_seconds > 0
        return text.replace(ELSEWHERE, "") if is_asked else text

    @property
    def _tells(self) -> bool:
        return self._chosen.simulate and not self._chosen.json

    def _show(self) -> None:
        self.plan = current_plan(self)
        if self.plan is not None and not self._chosen.json and not self._refuses_all:
            self._print_plan(self.plan)
        self._tell_all()

    def _tell_all(self) -> None:
        self._is_shown = True
        if self._story is not None:
            for entry in self.journal:
                self._story.hear(entry)

    @property
    def _refuses_all(self) -> bool:
        """True if all goals were rejected."""
        return {goal.status for goal in self.goals} == {journal.Status.REJECTED}

    def _print_task(self, task: PlanningTask) -> None:
        """Prints the task of the first search that has one."""
        self.loop.state.planner.show_tasks(lambda _: None)
        for line in task.lines():
            _print(line)

    def _print_plan(self, plan: ShownPlan) -> None:
        searches = "1 search" if plan.searches == 1 else f"{plan.searches} searches"
        last = max(plan.steps, default=0)
        size = f"{last} step{'' if last == 1 else 's'}" if last else "nothing to do"
        _print(f"plan: {size}, found in {plan.seconds:.3f} s after {searches}")
        for step, actions in plan.steps.items():
            _print(f"{step:6}  {', '.join(f'{a.actuator}: {a.name}' for a in actions)}")
        for goal in self.goals:
            if goal.id in plan.succeeds:
                _print(f"{_name(goal)}, succeeds in step {plan.succeeds[goal.id]}")
            elif not goal.ended and goal.id not in plan.slots:
                _print(f"{_name(goal)}, waits for a slot; the encoding has {len(plan.slots)}")

    def _values(self, wrong: Sequence[str], why: Sequence[str]) -> Dict[str, Any]:
        """Returns the run's values for JSON."""
        plan = self.plan
        return {
            "plan": None if plan is None else {
                "horizon": plan.horizon,
                "searches": plan.searches,
                "seconds": plan.seconds,
                "actions": [[a.step, a.actuator, a.name] for a in plan.actions],
                "succeeds": plan.succeeds,
            },
            "goals": [
                {
                    "number": int(goal.id),
                    "request": goal.request,
                    "status": _status(goal),
                    "reason": str(goal.reason),
                }
                for goal in self.goals
            ],
            "wrong": list(wrong),
            "reasons": list(why),
            "warnings": self.warnings,
            "journal": [
                {
                    "clock": entry.seconds,
                    "step": entry.step,
                    "horizon": entry.horizon,
                    **journal.encode(entry.event)._asdict(),
                }
                for entry in (self.journal if self._chosen.simulate else ())
            ],
        }  # fmt: skip


def _draw(chosen: argparse.Namespace, simulation: ShownSimulation, plan: ShownPlan) -> None:
    title = " ".join(goal.request for goal in simulation.goals) or "plan"
    with picture_errors(chosen.picture):
        # It takes a second, and who wants no picture need not have matplotlib.
        from rosoclingo.tools.plan.picture import draw_plan, draw_run  # noqa: PLC0415 (see above)

        if chosen.simulate:
            draw_run(simulation, title, chosen.picture)
        else:
            draw_plan(simulation, plan, chosen.options, title, chosen.picture)
    if not chosen.json:
        _print(f"wrote {chosen.picture}")


def _name(goal: Request) -> str:
    return f"goal {goal.id}, {goal.request}"


def _status(goal: Request) -> str:
    return goal.words[-1] if goal.words else "waiting"


def _warn(text: str) -> None:
    if "warning:" in text or "error:" in text:  # and not what only may be of interest
        say("clingo", text)


def _print(text: str) -> None:
    PROGRESS.print(lines(text), sys.stdout)
