"""Generates the world for Gazebo, in SDF."""

from __future__ import annotations

from typing import Iterator, Optional
from xml.sax.saxutils import quoteattr

from rosoclingo_simulator.world.description import Area, World
from rosoclingo_simulator.world.geometry import Grid
from rosoclingo_simulator.world.text import FLOORS, WALL, TextColour, numbers, origin

_FLOOR_HEIGHT = 0.002  # m; enough for the floors' colours to be above the ground

# Everything is in the file: Gazebo would download the models of sun and ground.
_HEAD = """\
    <gravity>0 0 -9.8</gravity>
    <scene>
      <ambient>0.5 0.5 0.5 1</ambient>
      <background>0.75 0.8 0.85 1</background>
      <shadows>false</shadows>
    </scene>
    <light name="sun" type="directional">
      <pose>0 0 10 0 0 0</pose>
      <diffuse>0.8 0.8 0.8 1</diffuse>
      <specular>0.2 0.2 0.2 1</specular>
      <direction>-0.4 0.3 -0.9</direction>
    </light>
    <model name="ground">
      <static>true</static>
      <link name="link">
        <collision name="collision">
          <geometry><plane><normal>0 0 1</normal><size>{size}</size></plane></geometry>
        </collision>
        <visual name="visual">
          <geometry><plane><normal>0 0 1</normal><size>{size}</size></plane></geometry>
          <material><ambient>0.5 0.5 0.5 1</ambient><diffuse>0.5 0.5 0.5 1</diffuse></material>
        </visual>
      </link>
    </model>"""


def gazebo_world(world: World, grid: Grid) -> str:
    """Returns the world: sun, ground, and one static model with walls and coloured floors."""
    size = numbers(*(2 * length for length in world.floor.size))
    lines = [
        '<?xml version="1.0"?>',
        f"<!-- {origin(world)} -->",
        '<sdf version="1.6">',
        f"  <world name={quoteattr(world.name)}>",
        _HEAD.format(size=size),
        f"    <model name={quoteattr(f'{world.name} building')}>",
        "      <static>true</static>",
        '      <link name="link">',
    ]
    for index, wall in enumerate(grid.boxes()):
        lines += _box("collision", f"wall {index}", wall, world.height)
        lines += _box("visual", f"wall {index}", wall, world.height, WALL)
    for room in world.rooms:
        for index, area in enumerate((*room.areas, *room.doors)):
            colour = FLOORS[room.kind]
            lines += _box("visual", f"floor of {room.name} {index}", area, _FLOOR_HEIGHT, colour)
    lines += ["      </link>", "    </model>", "  </world>", "</sdf>", ""]
    return "\n".join(lines)


def _box(
    element: str, name: str, area: Area, height: float, colour: Optional[TextColour] = None
) -> Iterator[str]:
    yield f"        <{element} name={quoteattr(name)}>"
    yield f"          <pose>{numbers(*area.centre, height / 2, 0, 0, 0)}</pose>"
    size = numbers(*area.size, height)
    yield f"          <geometry><box><size>{size}</size></box></geometry>"
    if colour is not None:
        rgba = numbers(*colour, 1)
        yield f"          <material><ambient>{rgba}</ambient><diffuse>{rgba}</diffuse></material>"
    yield f"        </{element}>"
