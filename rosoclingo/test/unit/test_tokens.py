"""Actions have tokens, which stay the same, and each action is answered once."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, Callable, List, Mapping, Sequence, Tuple

import pytest
from resuming import resume, snapshot_of

from rosclingo.solver.options import Options
from rosoclingo.in_process.parts import EXAMPLES, SINGLE, make_parts
from rosoclingo.in_process.system import System
from rosoclingo.loop import journal
from rosoclingo.loop.execution.executions import Executions
from rosoclingo.loop.inputs.inbox import Item
from rosoclingo.loop.journal import AnswerArrived, Control, ControlArrived, MessageArrived
from rosoclingo.loop.loop import Loop
from rosoclingo.loop.values.atoms import Action
from rosoclingo.loop.values.environment import Environment
from rosoclingo.loop.values.execution import Execution
from rosoclingo.loop.values.goals import Goal, Goals
from rosoclingo.loop.values.served import ServedGoals
from rosoclingo.ros.copies import AnswerCopies

LINE = f"{EXAMPLES}/line.lp"
ERRANDS = str(Path(__file__).parents[1] / "encodings/errands.lp")
MODE = "dynamic.incremental.dyn_reset"

# With this, a move of which nobody knows whether it was made ends all goals.
KNOWS_UNKNOWN = """
#program state(t).
#external event(robot,unknown,t).
#program transition(t).
status(ID,aborted,t) :- event(robot,unknown,t), asked(ID,_,t).
"""


class Robot(System):
    """Answers with tokens, as ``play`` says, which is called whenever the loop waits."""

    def __init__(
        self, make: Callable[..., Loop], play: Callable[[Robot], None], **parameters: Any
    ) -> None:
        self.shown: List[Tuple[str, List[Execution]]] = []
        self.copies = AnswerCopies()
        self._play = play
        super().__init__(make, **parameters)

    @property
    def told(self) -> Execution:
        """What the robot was told last."""
        return next(told for told in self.shown[-1][1] if told.actuator == "robot")

    def put(self, item: Item) -> None:
        """Something comes in, as over ROS."""
        executions = self.loop.state.executions
        told = {one.actuator: one.number for _, shown in self.shown for one in shown}
        if isinstance(item, AnswerArrived) and self.copies.is_copy(item, executions, told):
            return
        if isinstance(item, MessageArrived):
            if self.copies.repeats_token(item, told):
                return
            item = replace(item, sender="")
        super().put(item)

    def reply(self, value: str, number: int = 0, run: str = "", sender: str = "/node") -> None:
        """Answers the last action, or that with a number."""
        self.put(AnswerArrived(run or self.shown[-1][0], number or self.told.number, value, sender))

    def turn(self) -> bool:
        """Lets the robot answer what it was told and has not answered."""
        if self.acting:
            self.acting.clear()
            self._play(self)
        return bool(self._items)

    def show_executions(self, run: str, executions: Sequence[Execution]) -> None:
        assert run
        self.shown.append((run, list(executions)))

    @property
    def dropped(self) -> List[str]:
        """Why messages were dropped, by the journal."""
        events = [entry.event for entry in self.journal]
        return [event.reason for event in events if isinstance(event, journal.MessageDropped)]

    @property
    def messages(self) -> List[Tuple[str, str]]:
        """What was taken, by the journal."""
        events = [entry.event for entry in self.journal]
        return [(e.source, e.value) for e in events if isinstance(e, journal.MessageArrived)]


def test_a_run_shows_itself_before_it_has_an_action() -> None:
    """Who has answered an action of another run learns that it is not awaited."""
    one = robot(lambda _: None)
    one.run()
    assert one.shown == [(one.loop.state.executions.run, [])]
    two = robot(lambda _: None)
    resume(two.loop, snapshot_of(one.loop), lambda _: one.new_goal("none", (), "none"))
    assert two.shown == one.shown


def robot(
    play: Callable[[Robot], None],
    *files: str,
    mode: str = MODE,
    line: str = LINE,
    **parameters: Any,
) -> Robot:
    options = Options((line, *files))
    constants = () if mode == SINGLE else ("-c", "steps=30")
    return Robot(make_parts(mode, options, constants).loop, play, **parameters)


def visit(made: Robot, cell: int) -> List[str]:
    """Asks the robot for a visit and returns what the goal's client is told."""
    goal = made.request(f"visit({cell})")
    assert made.run() is None
    return goal.words


@pytest.mark.parametrize("mode", [MODE, SINGLE])
def test_an_answer_with_its_token(mode: str) -> None:
    made = robot(lambda robot: robot.reply("success"), mode=mode)
    assert visit(made, 4) == ["accepted", "succeeded"]
    assert [action for _, action in made.published] == ["go(2)", "go(3)", "go(4)"]
    assert made.messages == [("robot", "success")] * 3
    assert made.dropped == made.warnings == []
    # Each action is shown before it is published, and the last answer in the end.
    told = [(one.number, one.action, one.answer) for _, [one] in made.shown[1:]]
    assert told == [
        (1, "go(2)", None), (2, "go(3)", None), (3, "go(4)", None), (3, "go(4)", "success"),
    ]  # fmt: skip
    assert len({run for run, _ in made.shown}) == 1
    # After a reset, numbers go on.
    assert visit(made, 3) == ["accepted", "succeeded"]
    assert made.told.number == 4


@pytest.mark.parametrize("mode", [MODE, SINGLE])
@pytest.mark.parametrize("held", [{"ask_before": ["go(3)"]}, {}], ids=["approval", "hold"])
def test_an_answer_is_confirmed_while_the_next_action_is_held(
    mode: str, held: Mapping[str, Any]
) -> None:
    """An interface by the letter repeats its answer until ``~dispatch`` says that it was taken."""
    made = robot(lambda robot: robot.reply("success"), mode=mode, **held)
    if not held:
        made._play = hold
    assert visit(made, 3) == ["accepted"]
    assert [action for _, action in made.published] == ["go(2)"]
    assert [(one.number, one.answer) for one in made.shown[-1][1]] == [(1, "success")]
    made.put(ControlArrived(Control.APPROVE if held else Control.RELEASE, "robot"))
    made._play = lambda robot: robot.reply("success")
    assert made.run() is None
    assert [action for _, action in made.published] == ["go(2)", "go(3)"]
    assert made.goals[0].words == ["accepted", "succeeded"]
    assert made.dropped == made.warnings == []


def hold(made: Robot) -> None:
    """Puts the robot on hold, which answers."""
    made.put(ControlArrived(Control.HOLD, "robot"))
    made.reply("success")


def test_a_failure_is_confirmed_in_the_pause_before_the_retry() -> None:
    def play(made: Robot) -> None:
        made.reply("failure")

    made = robot(play, policies={"go(*)": {"retries": 1, "pause": 5}})
    made.own_moments = list  # type: ignore[method-assign] # the pause goes on
    assert visit(made, 2) == ["accepted"]
    for _ in range(3):
        made.reply("failure", number=1)
        assert made.run() is None
    assert [(one.number, one.answer) for one in made.shown[-1][1]] == [(1, "failure")]
    made.reply("success", number=1)
    made.clock += 6.0
    made._play = lambda robot: robot.reply("success")
    assert made.run() is None
    made.run()
    assert made.goals[0].words == ["accepted", "succeeded"]
    assert made.dropped == ["answer success to action 1: robot has answered failure already"]


def test_what_a_held_action_has_replaced_is_over() -> None:
    """Its answer is not awaited: ``~dispatch`` says so, and an interface stops repeating it."""
    executions = Executions(Environment())
    executions.begin(Action("robot", "go(2)", 1))
    executions.begin(Action("robot", "go(3)", 2), is_held=True)
    assert [(one.number, one.is_open) for one in executions.dispatched] == [(1, False)]
    executions.dispatch("robot")
    assert [(one.action, one.is_open) for one in executions.dispatched] == [("go(3)", True)]


def test_two_runs_have_two_ids() -> None:
    runs = [robot(lambda robot: robot.reply("success")) for _ in range(2)]
    assert [visit(made, 2) for made in runs] == [["accepted", "succeeded"]] * 2
    assert runs[0].shown[0][0] != runs[1].shown[0][0]


def test_answers_to_old_tokens() -> None:
    """They are dropped with a note, and change nothing."""

    def play(made: Robot) -> None:
        if made.told.action == "go(3)":
            made.reply("failure", number=1)
            made.reply("failure", run="another")
            made.reply("failure", number=77)
            made.reply("failure", number=0xFFFFFFFF)
        made.reply("success")

    made = robot(play)
    assert visit(made, 4) == ["accepted", "succeeded"]
    assert [action for _, action in made.published] == ["go(2)", "go(3)", "go(4)"]
    run = made.shown[0][0]
    reasons = [
        "answer failure to action 1: its actuator was told something else since then",
        f"answer failure to action 2: it is of the run another, and this is {run}",
        "answer failure to action 77: there is none",
        "answer failure to action 4294967295: there is none",
    ]
    assert made.dropped == reasons
    assert made.warnings == [f"dropped a message: {reason}" for reason in reasons]
    assert made.messages == [("robot", "success")] * 3


def test_a_late_answer_that_is_dropped_ends_no_wait() -> None:
    def play(made: Robot) -> None:
        made.reply("success" if len(made.published) == 1 else "failure", number=1)

    made = robot(play)
    assert visit(made, 4) == ["accepted"]  # the robot never answers its second action
    assert [action for _, action in made.published] == ["go(2)", "go(3)"]


@pytest.mark.parametrize("order", ["in first", "token first", "in later"])
def test_who_answers_on_both_is_counted_once(order: str) -> None:
    def play(made: Robot) -> None:
        number, message = made.told.number, MessageArrived("robot", "success", sender="/node")
        if order == "in later" and number > 2:
            made.put(message)  # to the action before: the robot is still at this one
        if number == 4:
            return
        if order == "in first":
            made.put(message)
        made.reply("success")
        if order == "token first" or (order == "in later" and number == 1):
            made.put(message)

    made = robot(play)
    assert visit(made, 6) == ["accepted"]
    assert [action for _, action in made.published] == [f"go({cell})" for cell in (2, 3, 4, 5)]
    assert made.messages == [("robot", "success")] * 3
    assert made.dropped == made.warnings == []


def test_a_node_that_answers_now_so_and_now_so() -> None:
    """Each of its answers counts."""

    def play(made: Robot) -> None:
        number = made.told.number
        if number in (1, 2, 4):
            made.reply("success")
        if number in (2, 3, 5):
            made.put(MessageArrived("robot", "success", sender="/node"))

    made = robot(play)
    assert visit(made, 6) == ["accepted", "succeeded"]
    assert made.messages == [("robot", "success")] * 5
    assert made.dropped == made.warnings == []


@pytest.mark.parametrize("mode", [MODE, SINGLE])
def test_copies_of_answers_that_were_taken(mode: str) -> None:
    """They are no news: while the loop is busy, and when the next action has begun, for ever."""

    def play(made: Robot) -> None:
        for number in range(1, made.told.number + 1):
            for _ in range(3):
                made.reply("success", number=number)

    made = robot(play, mode=mode)
    assert visit(made, 6) == ["accepted", "succeeded"]
    assert visit(made, 2) == ["accepted", "succeeded"]
    assert made.messages == [("robot", "success")] * 9
    assert made.dropped == made.warnings == []


@pytest.mark.parametrize("mode", [MODE, SINGLE])
def test_copies_after_a_crash(mode: str) -> None:
    """What was taken before it is known, and so is what was stored and not taken."""
    constants = () if mode == SINGLE else ("-c", "steps=30")
    make = make_parts(mode, Options((LINE,)), constants).loop
    made = Robot(make, lambda robot: robot.reply("success") if robot.told.number < 3 else None)
    goal: Any = made.request("visit(5)")
    assert made.run() is None
    made.reply("success")
    saved, waiting = snapshot_of(made.loop), made.take()
    made.loop = make(made, made)
    resume(made.loop, saved, lambda identifier: goal)
    made.copies = AnswerCopies()
    made.copies.restore(made.loop.state.executions, waiting)
    for item in waiting:
        made.add(item)
    for number in (1, 2, 3):
        made.reply("success", number=number)
    made._play = lambda robot: robot.reply("success")
    made._is_prepared = True
    assert made.run() is None
    assert goal.words == ["accepted", "succeeded"]
    assert made.messages == [("robot", "success")] * 4
    assert made.dropped == made.warnings == []


def test_an_answer_that_came_before_its_action() -> None:
    """It is dropped, and is none to the action that gets its number later."""

    def play(made: Robot) -> None:
        if made.told.number == 1:
            made.reply("success", number=2)
        made.reply("success")

    made = robot(play)
    assert visit(made, 4) == ["accepted", "succeeded"]
    assert made.dropped == ["answer success to action 2: there is none"]


def test_answers_on_the_old_topic() -> None:
    """They count as before, also of an actuator of which another node answers with tokens."""

    def play(made: Robot) -> None:
        if made.told.number % 2:
            made.reply("success")
        else:
            made.put(MessageArrived("robot", "success", sender="/old"))

    made = robot(play)
    assert visit(made, 5) == ["accepted", "succeeded"]
    assert made.dropped == []
    assert made.told.answer == "success"


def test_a_second_answer() -> None:
    def play(made: Robot) -> None:
        for value in ("success", "success", "failure"):
            made.reply(value)

    made = robot(play)
    assert visit(made, 2) == ["accepted", "succeeded"]
    assert made.dropped == ["id robot, value failure: it has answered success already"]
    made.reply("success")
    made.reply("failure")
    assert made.run() is None
    assert len(made.dropped) == 1, "each answer is dropped once"
    made.reply("unknown")
    assert made.run() is None
    assert made.dropped[1:] == ["answer unknown to action 1: robot has answered success already"]


def test_an_answer_that_is_wrong() -> None:
    def play(made: Robot) -> None:
        made.reply("nonsense(")
        made.reply("success")

    made = robot(play)
    assert visit(made, 2) == ["accepted", "succeeded"]
    assert len(made.dropped) == 1
    assert "'nonsense(' is not a ground term" in made.dropped[0]


@pytest.mark.parametrize("example", ["line.lp", "line_demand.lp"])
def test_an_encoding_that_does_not_know_unknown(example: str) -> None:
    """It is told that the action has failed: the robot is where it was, and tries again."""
    answers = ["unknown", "unknown", "success", "success"]
    file = f"{EXAMPLES}/{example}"
    made = robot(lambda robot: robot.reply(answers[robot.told.number - 1]), line=file)
    assert visit(made, 3) == ["accepted", "succeeded"]
    assert [action for _, action in made.published] == ["go(2)", "go(2)", "go(2)", "go(3)"]
    warning = (
        "whether robot has done its action is unknown, and the planner is told that it failed, "
        "because its encoding does not declare #external event(robot,unknown,t)"
    )
    assert made.warnings == [warning] * 2
    assert made.messages[0] == ("robot", "unknown")
    assert made.dropped == []


def test_an_encoding_that_knows_unknown(tmp_path: Path) -> None:
    file = tmp_path / "unknown.lp"
    file.write_text(KNOWS_UNKNOWN)
    made = robot(lambda robot: robot.reply("unknown"), str(file))
    assert visit(made, 3) == ["accepted", "aborted"]
    assert made.warnings == made.dropped == []
    ends = [e.event for e in made.journal if isinstance(e.event, journal.StatusSet)]
    assert ends[-1].reason.endswith(": whether robot has done go(2) is unknown")


def test_unknown_without_failure(tmp_path: Path) -> None:
    """An encoding that knows neither is told nothing, which is said."""
    text = Path(LINE).read_text().replace("(success;failure)", "success")
    file = tmp_path / "line.lp"
    file.write_text(text)
    made = robot(lambda robot: robot.reply("unknown"), line=str(file))
    assert visit(made, 2) == ["accepted", "succeeded"]
    assert ["robot has answered unknown: that ends its action" in w for w in made.warnings] == [
        True
    ]


def test_a_token_stays_the_same() -> None:
    """A loop that goes on elsewhere publishes its last action with the same token."""
    make = make_parts(MODE, Options((LINE,)), ("-c", "steps=30")).loop
    made = Robot(make, lambda robot: None)
    goal: Any = made.request("visit(3)")
    assert made.run() is None
    saved, before = snapshot_of(made.loop), made.shown[-1]
    made.loop = make(made, made)
    resume(made.loop, saved, lambda identifier: goal)
    assert made.shown[-1] == before
    made._play = lambda robot: robot.reply("success")
    made.reply("success")
    assert made.run() is None
    assert [one.number for _, [one] in made.shown[-2:]] == [2, 2]
    assert goal.words == ["accepted", "succeeded"]


def test_an_abort() -> None:
    """What is to stop keeps its token, and is still to be answered."""
    first = f"{EXAMPLES}/line_1.0.lp"
    made = robot(lambda robot: robot.tell("info", "close(2)"), line=first, mode=SINGLE)
    goal = made.request("visit(2)")
    assert made.run() is None
    assert [action for _, action in made.published] == ["go(2)", "abort"]
    made.reply("failure")
    made.tell("info", "open(2)")
    made._play = lambda robot: robot.reply("success")
    assert made.run() is None
    assert goal.words == ["accepted", "succeeded"]
    told = [(one.number, one.action, one.aborted, one.answer) for _, [one] in made.shown[1:]]
    assert told[:2] == [(1, "go(2)", False, None), (1, "go(2)", True, None)]
    assert told[-1] == (2, "go(2)", False, "success")


def _answer_all(made: Robot) -> None:
    for one in made.shown[-1][1]:
        if one.is_open:
            made.reply("success", one.number)


def test_an_action_serves_the_goal_whose_slot_it_names() -> None:
    served: List[Tuple[int, List[Any]]] = []
    made = robot(_answer_all, line=ERRANDS)
    made.show_served = lambda _, number, goals: served.append((number, list(goals)))  # type: ignore[method-assign]
    goals = [made.request(f"visit({place})") for place in (0, 5)]
    assert made.run() is None
    assert [goal.words[-1] for goal in goals] == ["succeeded"] * 2
    assert served[0] == (0, [])
    actions = {one.number: one.action for _, shown in made.shown for one in shown}
    looks = {
        one.request: one
        for _, all_served in served
        for one in all_served
        if actions[one.number] == f"look({one.slot})"
    }
    assert sorted(looks) == ["visit(0)", "visit(5)"]
    for goal in goals:
        one = looks[goal.request]
        assert (one.goal_id, one.information) == (goal.id, goal.information)
    assert all(one.number <= number for number, all_served in served for one in all_served)


def test_a_slot_that_has_another_goal_meanwhile() -> None:
    """A restarted loop does not take a later goal for the one that an action was done for."""
    goals = Goals()
    goals.set_slots(["1"])
    goals.add(Goal("later", identifier="b"))
    [(_, goal)] = goals.place()
    goal.came = 10.0
    for began, number in ((5.0, 0), (15.0, 1)):
        one = Execution(1, 1, "robot", "pick(1)", world_began=began)
        assert len(ServedGoals().update([one], goals, is_resumed=True)) == number
        assert len(ServedGoals().update([one], goals)) == 1
