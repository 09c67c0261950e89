"""Generates all files of a world's description: the command ``generate_world.py``."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Dict, NoReturn, Optional

from rosoclingo_simulator.errors import WorldError
from rosoclingo_simulator.world.description import World
from rosoclingo_simulator.world.gazebo import gazebo_world
from rosoclingo_simulator.world.geometry import Grid
from rosoclingo_simulator.world.instance import instance
from rosoclingo_simulator.world.marker_file import marker_file
from rosoclingo_simulator.world.mujoco_model import mujoco_model
from rosoclingo_simulator.world.occupancy import map_file, map_image
from rosoclingo_simulator.world.reader import read_world
from rosoclingo_simulator.world.waypoint_file import waypoint_file


def generate(world: World, folder: Optional[Path] = None) -> Dict[Path, bytes]:
    """Makes the contents of all files; the same description gives the same bytes.

    Args:
        world: The description.
        folder: Where all files are to go; without it, each goes to where the description says.
    """
    grid = Grid(world)
    files = {kind: folder / path.name if folder else path for kind, path in world.files.items()}
    image = files["map"].with_suffix(".pgm")
    texts = {
        files["instance"]: instance(world),
        files["waypoints"]: waypoint_file(world),
        files["map"]: map_file(world, image.name),
        files["gazebo"]: gazebo_world(world, grid),
        files["mujoco"]: mujoco_model(world, grid),
        files["markers"]: marker_file(world, grid),
    }
    contents = {path: text.encode() for path, text in texts.items()}
    contents[image] = map_image(grid)
    if len(contents) <= len(files):
        raise WorldError(f"{world.path}: files: two of them have the same path; rename one")
    return contents


def write(contents: Dict[Path, bytes]) -> None:
    """Writes files, and makes the folders that they need.

    Raises:
        WorldError: A file cannot be written.
    """
    for path, content in contents.items():
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
        except OSError as err:
            raise WorldError(
                f"cannot write {path}: {err.strerror}; --output FOLDER writes elsewhere"
            ) from err


def main() -> NoReturn:
    """Writes the files that are made from a building's description.

    The exit status is 0, or 2 if the command line or the description is wrong.
    """
    parser = argparse.ArgumentParser(
        prog="generate_world.py",
        description="Makes instance, waypoints, map, Gazebo world, MuJoCo model and rviz markers "
        "of a building from one description. The package's README says how to write one.",
    )
    parser.add_argument("description", type=Path, metavar="FILE", help="the description, YAML")
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        metavar="FOLDER",
        help="write all files into this folder, and not to where the description says",
    )
    options = parser.parse_args()
    try:
        contents = generate(read_world(options.description), options.output)
        write(contents)
    except WorldError as err:
        print(f"generate_world.py: {err}", file=sys.stderr)
        sys.exit(2)
    for path in contents:
        print(path)
    sys.exit(0)
