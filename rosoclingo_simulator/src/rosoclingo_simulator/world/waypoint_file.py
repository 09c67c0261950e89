"""Generates the waypoint file of the interface of move_base."""

from __future__ import annotations

from rosoclingo_simulator.world.description import World
from rosoclingo_simulator.world.text import numbers, origin


def waypoint_file(world: World) -> str:
    """Returns YAML: the frame, and x, y (m) and theta (rad) of each waypoint."""
    lines = [f"# Where the waypoints of the {world.name} are: x and y in m, theta in rad."]
    lines += [f"# {origin(world)}", "frame: map", "waypoints:"]
    for point in world.waypoints.values():
        x, y, theta = numbers(point.x, point.y, point.theta).split()
        lines.append(f"  {point.name}: {{x: {x}, y: {y}, theta: {theta}}}")
    return "\n".join(lines) + "\n"
