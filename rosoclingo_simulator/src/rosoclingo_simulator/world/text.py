"""Formats generated files: numbers, colours, and the line that names their source."""

from __future__ import annotations

from typing import Dict, Tuple

from rosoclingo_simulator.world.description import World

TextColour = Tuple[float, float, float]

WALL: TextColour = (0.62, 0.64, 0.66)
FLOORS: Dict[str, TextColour] = {
    "open": (0.93, 0.9, 0.8),
    "corridor": (0.87, 0.91, 0.94),
    "office": (0.96, 0.96, 0.94),
}
"""The floor's colour in each kind of room."""


def origin(world: World) -> str:
    """Returns a line for the head of a file."""
    return f"Made by generate_world.py from {world.path.name}, which is to be changed instead."


def numbers(*values: float) -> str:
    """Returns numbers as text with spaces between them, such as ``0.2 1 -3``."""
    # Adding 0 makes 0 of -0.
    return " ".join(f"{round(value, 6) + 0:g}" for value in values)
