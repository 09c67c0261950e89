"""Generates the building's model for MuJoCo, in MJCF; a robot is to be added to it."""

from __future__ import annotations

from xml.sax.saxutils import quoteattr

from rosoclingo_simulator.world.description import Area, World
from rosoclingo_simulator.world.geometry import Grid
from rosoclingo_simulator.world.text import FLOORS, WALL, numbers, origin

_FLOOR_HEIGHT = 0.005  # m; enough for the floors' colours to be above the ground


def mujoco_model(world: World, grid: Grid) -> str:
    """Returns the model: light, ground, walls, and coloured floors that nothing touches."""
    centre, size = numbers(*world.floor.centre), world.floor.size
    lines = [
        f"<!-- {origin(world)} -->",
        f"<mujoco model={quoteattr(world.name)}>",
        '  <compiler angle="radian"/>',
        f'  <statistic center="{centre} 0" extent="{numbers(max(size))}"/>',
        "  <default>",
        f'    <default class="wall"><geom type="box" rgba="{numbers(*WALL, 1)}"/></default>',
    ]
    for kind, colour in FLOORS.items():
        lines.append(
            f'    <default class="{kind} floor"><geom type="box" contype="0" conaffinity="0" '
            f'group="1" rgba="{numbers(*colour, 1)}"/></default>'
        )
    half = numbers(*(length / 2 for length in size))
    lines += [
        "  </default>",
        "  <worldbody>",
        f'    <light name="sun" directional="true" pos="{centre} 10" dir="-0.4 0.3 -0.9" '
        'castshadow="false"/>',
        f'    <geom name="ground" type="plane" pos="{centre} 0" size="{half} 0.1" '
        'rgba="0.5 0.5 0.5 1"/>',
    ]
    for index, wall in enumerate(grid.boxes()):
        lines.append(_box("wall", f"wall {index}", wall, world.height))
    for room in world.rooms:
        for index, area in enumerate((*room.areas, *room.doors)):
            name = f"floor of {room.name} {index}"
            lines.append(_box(f"{room.kind} floor", name, area, _FLOOR_HEIGHT))
    return "\n".join([*lines, "  </worldbody>", "</mujoco>", ""])


def _box(kind: str, name: str, area: Area, height: float) -> str:
    half = (length / 2 for length in (*area.size, height))
    return (
        f'    <geom class="{kind}" name={quoteattr(name)} '
        f'pos="{numbers(*area.centre, height / 2)}" size="{numbers(*half)}"/>'
    )
