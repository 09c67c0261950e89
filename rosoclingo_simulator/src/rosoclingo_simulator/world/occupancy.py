"""Generates the map for navigation, in map_server's format."""

from __future__ import annotations

import numpy as np

from rosoclingo_simulator.world.description import World
from rosoclingo_simulator.world.geometry import Grid
from rosoclingo_simulator.world.text import numbers, origin

_FREE, _WALL, _UNKNOWN = 254, 0, 205  # grey values, as map_saver writes them


def map_image(grid: Grid) -> bytes:
    """Returns the map as a binary PGM image, one pixel for each cell."""
    image = np.full(grid.wall.shape, _UNKNOWN, dtype=np.uint8)
    image[grid.free] = _FREE
    image[grid.wall] = _WALL
    height, width = grid.wall.shape
    return b"P5\n%d %d\n255\n" % (width, height) + image[::-1].tobytes()  # north is above


def map_file(world: World, image: str) -> str:
    """Returns the YAML file that belongs to the image of a name."""
    west, south = numbers(world.floor.west, world.floor.south).split()
    return f"""\
# The map of the {world.name}, for map_server.
# {origin(world)}
image: {image}
resolution: {numbers(world.resolution)}
origin: [{west}, {south}, 0]
negate: 0
occupied_thresh: 0.65
free_thresh: 0.196
mode: trinary
"""
