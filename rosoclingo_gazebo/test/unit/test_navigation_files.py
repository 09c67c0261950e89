"""The files of ROS's own navigation have no value of which its nodes warn, or which they change."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from rosclingo import strict_yaml

FILES = Path(__file__).resolve().parents[2] / "config" / "navigation"


def load(name: str) -> Any:
    return strict_yaml.load((FILES / name).read_text(encoding="utf-8"))


def test_the_weights_of_the_laser_model_sum_to_one() -> None:
    weights = {key: value for key, value in load("amcl.yaml").items() if key[:8] == "laser_z_"}
    assert len(weights) == 4
    assert sum(weights.values()) == pytest.approx(1.0)


def test_each_direction_has_a_sample() -> None:
    """With none, dwa_local_planner warns and takes one."""
    planner = load("planner.yaml")["DWAPlannerROS"]
    samples = {key: value for key, value in planner.items() if key.endswith("_samples")}
    assert samples.keys() == {"vx_samples", "vy_samples", "vth_samples"}
    assert min(samples.values()) >= 1
