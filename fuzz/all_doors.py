"""Finds a door by its name."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path
from typing import Dict, List

from fuzzing import Door

_ROOT = Path(__file__).resolve().parents[1]
# Makers of bags and of requests, which the unit tests have.
for _folder in ("test", "rosoclingo/test/kit", "rosoclingo_console/test/unit"):
    if str(_ROOT / _folder) not in sys.path:
        sys.path.append(str(_ROOT / _folder))

_NAMES = {
    "xml_doors": "control assumptions replies",
    "loop_doors": "goals messages tokens policies actions",
    "yaml_doors": "waypoints observers adapters faults worlds maps pictures",
    "store_doors": "stores rows ledgers",
    "file_doors": "bags pddl about",
    "console_doors": "requests port",
}
DOORS: Dict[str, str] = {name: module for module, names in _NAMES.items() for name in names.split()}
"""The modules of the doors, by their names."""


def find_door(name: str) -> Door:
    """Returns a door, of whose module it imports what that needs."""
    doors: List[Door] = importlib.import_module(DOORS[name]).doors()
    return next(door for door in doors if door.name == name)
