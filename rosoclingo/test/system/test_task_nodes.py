"""Random episodes over ROS of domains of ``actions.lp``, with kills; bags are replayed exactly.

TASK_NODES=10 in the environment plays so many. Needs a sourced workspace.
"""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from draws import draws
from terminals import Terminals, terminals
from test_replay import replays_exactly

__all__ = ["terminals"]

pytestmark = pytest.mark.costly

HERE = Path(__file__).resolve().parent
DOMAINS = {
    "errands": ["errands.lp"],
    "kitchen": ["kitchen.lp"],
    "trucks": ["trucks.lp"],
    "tugs": ["tugs.lp"],
}
SEEDS = draws((0, 5), 8, "TASK_NODES")


@pytest.mark.parametrize("seed", SEEDS)
def test_a_random_episode(seed: int, terminals: Terminals, tmp_path: Path) -> None:
    """Three nodes, or one, in turn."""
    name = list(DOMAINS)[seed // 2 % len(DOMAINS)]
    files = [str(HERE.parent / "encodings" / file) for file in DOMAINS[name]]
    bag = tmp_path / "run.bag"
    form, nodes = "single", ["/rosoclingo"]
    mode = []
    if seed % 2:
        form, nodes = "rosoclingo", ["/rosoclingo", "/controller", "/planner"]
        mode = ["mode:=dynamic.incremental.dyn_reset", "steps:=400"]
    launch = terminals.start(
        "roslaunch", "rosoclingo", f"{form}.launch", f"encoding:={' '.join(files)}", *mode,
        f"options:=-c slots={1 if name == 'tugs' else 2}",
        f"store:={tmp_path / 'run.store'}", f"record:={bag}",
    )  # fmt: skip
    terminals.wait_until_hears("/recorder", "/rosoclingo/journal", "/rosoclingo/dispatch")
    judge = terminals.start(sys.executable, str(HERE / "task_nodes.py"), name, str(seed), *nodes)
    assert judge.wait() == 0, judge.output
    launch.interrupt()
    launch.wait()
    replays_exactly(terminals, bag, "--kill", said="")
