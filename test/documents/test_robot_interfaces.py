"""The README of rosoclingo_interfaces."""

from __future__ import annotations

import subprocess
import sys

import pytest
from page import ASP, OFFICE, Page, of
from readmes import check_output
from terminals import package

from rosclingo.solver.options import Options
from rosoclingo.encodings.alphabet import read_alphabet
from rosoclingo.loop.values.ids import type_event
from rosoclingo_interfaces.adapters.adapter_file import read_adapter
from rosoclingo_interfaces.navigation.waypoints import read_waypoints
from rosoclingo_interfaces.observation.observers import read_observers
from rosoclingo_interfaces.observation.transforms import TransformTree
from rosoclingo_interfaces.observation.vocabulary import unknown_terms
from rosoclingo_interfaces.ros.message_types import slots

ROBOT = '''
class base:
    """A robot that is everywhere at once."""
    has_arrived = True
    drive_to = stop = is_at = staticmethod(lambda *_: True)
'''


@pytest.mark.costly
@of("rosoclingo_interfaces/README.md", "rosoclingo_interfaces")
def test_interfaces(page: Page) -> None:
    fulfill = page.type("fulfill.py")
    published = page.type("rostopic pub")
    fulfill.wait_for("mailbot: go(c3): success")
    check_output("rosoclingo_interfaces/README.md", "rosoclingo_interfaces", fulfill.output)
    fulfill.interrupt()
    fulfill.wait()
    first, _, rest = page.block("python").partition("\n")
    script = page.folder / "robot.py"
    script.write_text(f"{first}\n{ROBOT}\n{rest}")
    robot = page.terminals.start(sys.executable, str(script))
    robot.wait_for("mailbot: go(c3): success")
    published.interrupt()


@of("rosoclingo_interfaces/README.md", "fulfill.py")
def test_fulfill(page: Page) -> None:
    action = ("rostopic", "pub", "/rosoclingo/out", "rosoclingo/ROSoClingoOut", "mailbot", "go(c3)")
    page.terminals.start(*action)
    page.type("fulfill.py").wait_for("mailbot: go(c3): failure")


@of("rosoclingo_interfaces/README.md", "move_base_interface.py")
def test_move_base_interface(page: Page) -> None:
    page.type("move_base_interface.py")
    page.sees("/move_base_interface")
    (page.folder / "places.yaml").write_text(page.block("yaml"))
    assert set(read_waypoints(page.folder / "places.yaml").places) == {"c3", "c(4)"}


@of("rosoclingo_interfaces/README.md", "After a crash")
def test_what_follows_a_crash(page: Page) -> None:
    """A class of the README's, and what its table says of actions."""
    program = (
        "import clingo\nfrom rosoclingo_interfaces.interface import ActionInterface\n"
        f"{page.block('python')}\n"
        "class Any(Mailbot):\n    def __init__(self): pass\n"
        "for name in 'greet', 'charge', 'go(c3)', 'pickup(1)':\n"
        "    print(Any().outcome_after_crash(clingo.parse_term(name)))\n"
    )
    said = subprocess.run(
        [sys.executable, "-c", program], check=True, stdout=subprocess.PIPE, text=True
    )
    assert said.stdout.split() == ["fail", "again", "again", "unknown"]


@of("rosoclingo_interfaces/README.md", "Heartbeats")
def test_progress(page: Page) -> None:
    """A class of the README's says how far it is while it executes an action."""
    program = (
        "from rosoclingo_interfaces.executor import Executor\n"
        "from rosoclingo_interfaces.interface import ActionInterface\n"
        f"{page.block('python')}\n"
        "executor, said = Executor(Mailbot()), []\n"
        "executor.begin('mailbot', 'sweep(hall)', print)\n"
        "(running,) = executor.running\n"
        "while len(said) < 2:\n"
        "    if running.progress is not None and running.progress not in said:\n"
        "        said.append(running.progress)\n"
        "print(*said)\n"
    )
    said = subprocess.run(
        [sys.executable, "-c", program], check=True, stdout=subprocess.PIPE, text=True, timeout=180
    )
    assert said.stdout.split() == ["0.0", "0.1"]


@of("rosoclingo_interfaces/README.md", "Methods")
def test_the_goal_of_an_action(page: Page) -> None:
    """A method of the README's knows the request of the goal in the slot."""
    program = (
        "from rosoclingo.loop.values.served import ServedGoal\n"
        "from rosoclingo_interfaces.executor import Executor\n"
        "from rosoclingo_interfaces.interface import ActionInterface\n"
        "class Waiter(ActionInterface):\n"
        f"{page.block('python')}\n"
        "        return request\n"
        "executor = Executor(Waiter())\n"
        "served = (ServedGoal(1, '1', 'dish(t3)', 'id'),)\n"
        "executor.begin('waiter', 'pick(1)', print, find_served=lambda: served)\n"
        "for running in executor.running:\n"
        "    running.ended.wait(180)\n"
    )
    said = subprocess.run(
        [sys.executable, "-c", program], check=True, stdout=subprocess.PIPE, text=True, timeout=180
    )
    assert said.stdout.strip() == "dish(t3)"


@of("rosoclingo_interfaces/README.md", "adapter.py")
def test_adapter(page: Page) -> None:
    node = page.type("adapter.py")
    page.type("rostopic pub")
    node.wait_for("waiting for a subscriber of /door_o1/command; is it started?")
    door = page.type("rostopic echo")
    door.wait_for('data: "open"')
    page.type("rostopic pub")
    node.wait_for("mailbot: open(o1): success")
    check_output("rosoclingo_interfaces/README.md", "adapter.py", node.output)
    config = package("rosoclingo_interfaces") / "config"
    assert page.block("yaml") == (config / "adapter.yaml").read_text().partition("\n")[2]


@of("rosoclingo_interfaces/README.md", "Answers")
def test_answers_of_an_adapter(page: Page) -> None:
    file = page.folder / "adapter.yaml"
    file.write_text(
        "actions:\n  - action: reach\n    service: arm\n    type: rosoclingo/Why\n"
        + page.block("yaml").replace("state: aborted, field: code", "field: status")
    )
    rules = read_adapter(file, slots, TransformTree()).actions[0].rules
    assert [rule.answer for rule in rules] == ["stuck", "empty", "success"]


@of("rosoclingo_interfaces/README.md", "observe.py")
def test_observe(page: Page) -> None:
    node = page.type("observe.py")
    page.type("rostopic pub")
    node.wait_for("told blocked(c1,o1)")
    check_output("rosoclingo_interfaces/README.md", "observe.py", node.output)
    config = package("rosoclingo_interfaces") / "config"
    known = read_alphabet(Options((str(ASP / "mailbot.lp"), str(OFFICE)))).messages
    shipped = read_observers(config / "observers.yaml", TransformTree())
    assert not list(unknown_terms(shipped, [type_event(*one) for one in known]))
    (page.folder / "graph_wg.yaml").write_text((config / "graph_wg.yaml").read_text())
    (page.folder / "observers.yaml").write_text(page.block("yaml"))
    observers = read_observers(page.folder / "observers.yaml", TransformTree())
    assert [one.terms[-1] for one in observers] == [
        "at(mailbot,o14)", "battery(ok)", "unblocked(c1,o1)", "unblocked(c4,c5)", "lost", "blind",
    ]  # fmt: skip


@of("rosoclingo_interfaces/README.md", "Faults")
def test_faults_of_an_interface(page: Page) -> None:
    fulfill = page.type("fulfill.py")
    page.terminals.publish(
        "/rosoclingo/out", "rosoclingo/ROSoClingoOut", "{id: mailbot, action: pickup(1)}"
    )
    fulfill.wait_for("mailbot: pickup(1): success")
    assert "as ~faults says" not in fulfill.output


@pytest.mark.costly
@of("rosoclingo_interfaces/README.md", "un_block.py")
def test_un_block(page: Page) -> None:
    heard = page.terminals.start("rostopic", "echo", "/rosoclingo/in")
    page.run("un_block.py", lines="u c3 c4\n")
    page.run('echo "b c3 c4"')
    for value in ("unblocked(c3,c4)", "blocked(c3,c4)"):
        heard.wait_for(f'value: "{value}"')


@pytest.mark.costly
@of("rosoclingo_interfaces/README.md", "mailbot_interfaces.launch")
def test_mailbot_interfaces(page: Page) -> None:
    for node in ("/move_base_interface", "/fulfill_go"):
        page.type("mailbot_interfaces.launch")
        page.sees(node)
        page.sees("/pickup_deliver")
        page.interrupt()
    page.type("fleet_interfaces.launch")
    for robot in ("mailbot", "mailbot2"):
        page.sees(f"/move_base_interface_{robot}")
