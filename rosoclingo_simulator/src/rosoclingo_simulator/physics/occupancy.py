"""Reads an occupancy map in map_server's format: a YAML file and a picture."""

from __future__ import annotations

import io
import math
import re
import struct
from pathlib import Path
from typing import Any, Dict, Tuple

import numpy as np
import yaml
from PIL import Image, UnidentifiedImageError
from scipy.ndimage import distance_transform_edt

from rosclingo import strict_yaml
from rosclingo.errors import shorten
from rosoclingo_simulator.errors import MapError
from rosoclingo_simulator.physics.grid import CellGrid
from rosoclingo_simulator.world.description import MOST_CELLS

FREE, OCCUPIED, UNKNOWN = 0, 100, -1

_EXACT_CELLS = 8  # up to so many cells away, a distance is measured instead of estimated
_FINEST = 0.001  # metres per pixel; with less, a robot has more cells than there is memory
_MOST_BYTES = 16  # of a pixel in a file
# All that Pillow raises at pictures that are damaged.
_UNREADABLE = (
    OSError, ValueError, SyntaxError, TypeError, LookupError, ArithmeticError, AttributeError,
    EOFError, RuntimeError, MemoryError, struct.error, Image.DecompressionBombError,
)  # fmt: skip
_NEIGHBOURS = np.arange(-_EXACT_CELLS - 2, _EXACT_CELLS + 3)


class OccupancyMap:
    """An occupancy grid of a floor. Immutable; thread-safe.

    What is not free is solid, and so is all that is outside of the map.

    Attributes:
        grid: Where the cells are.
        cells: Each is ``FREE``, ``OCCUPIED`` or ``UNKNOWN``, as in ``nav_msgs/OccupancyGrid``.
        framed: The cells, with a frame of solid ones around them.
        solid: Which cells of ``framed`` are solid.
        distances: From the centre of each cell of ``framed`` to that of the next solid one, in
            metres.
    """

    def __init__(self, cells: np.ndarray, resolution: float, x: float, y: float) -> None:
        """Makes a map.

        Args:
            cells: As the attribute; row 0 is at the least y.
            resolution: Width of a cell, in metres.
            x: The left edge, in metres.
            y: The lower edge, in metres.
        """
        self.cells = cells.astype(np.int8)
        rows, columns = cells.shape
        self.grid = CellGrid(x, y, resolution, rows, columns)
        self.framed = CellGrid(x - resolution, y - resolution, resolution, rows + 2, columns + 2)
        self.solid = np.pad(self.cells != FREE, 1, constant_values=True)
        self.distances = _distances(self.solid) * resolution

    def distances_at(self, points: np.ndarray) -> np.ndarray:
        """Returns how far points are from what is solid, in metres, give or take a cell."""
        return self.distances[self.framed.cells(points)]

    def clearance(self, x: float, y: float) -> float:
        """Returns how far a point is from what is solid, in metres; 0 inside of it.

        That is exact up to eight cells, and from there on not more than the true distance.
        """
        grid = self.framed
        resolution = grid.resolution
        column, row = (x - grid.x) / resolution, (y - grid.y) / resolution
        if not (0 <= column < grid.columns and 0 <= row < grid.rows):
            return 0.0
        middle_row, middle_column = int(row), int(column)
        estimate = float(self.distances[middle_row, middle_column])
        if estimate > _EXACT_CELLS * resolution:
            return estimate - math.sqrt(2) * resolution
        # How far the nearest point of each cell around is, along each axis.
        rows, columns = middle_row + _NEIGHBOURS, middle_column + _NEIGHBOURS
        below = np.maximum(0.0, np.abs(rows + 0.5 - row) - 0.5) ** 2
        aside = np.maximum(0.0, np.abs(columns + 0.5 - column) - 0.5) ** 2
        solid = self.solid[
            np.clip(rows, 0, grid.rows - 1)[:, None], np.clip(columns, 0, grid.columns - 1)
        ]
        squares = np.where(solid, below[:, None] + aside, np.inf)
        return math.sqrt(float(squares.min())) * resolution


def _distances(solid: np.ndarray) -> np.ndarray:
    """Returns how far the centre of each cell is from that of the next solid one, in cells.

    ``distance_transform_edt`` does so, too, but takes a gigabyte for the largest map.
    """
    rows, columns = distance_transform_edt(~solid, return_distances=False, return_indices=True)
    rows -= np.arange(rows.shape[0], dtype=rows.dtype)[:, None]
    columns -= np.arange(columns.shape[1], dtype=columns.dtype)
    return np.hypot(rows, columns).astype(np.float32)


def read_map(file: Path) -> OccupancyMap:
    """Reads a map.

    Args:
        file: The YAML file, which names the picture.

    Raises:
        MapError: It cannot be read, or is no map of this kind.
    """
    values = _read_yaml(file)
    picture = values.get("image")
    if not isinstance(picture, str):
        raise MapError(f"{file}: image: expected the name of a picture: {picture!s:.80}")
    resolution = _number(file, values, "resolution")
    if resolution < _FINEST:
        raise MapError(
            f"{file}: resolution: expected metres per pixel, from {_FINEST} on: {resolution}"
        )
    occupied = _number(file, values, "occupied_thresh")
    free = _number(file, values, "free_thresh")
    if not 0 <= free <= occupied <= 1:
        raise MapError(
            f"{file}: expected 0 <= free_thresh <= occupied_thresh <= 1: {free}, {occupied}"
        )
    negate = values.get("negate", 0)
    if negate not in (0, 1):
        raise MapError(f"{file}: negate: expected 0 or 1: {negate!s:.80}")
    mode = values.get("mode", "trinary")
    if mode != "trinary":
        raise MapError(f"{file}: mode: expected trinary: {mode!s:.80}")
    origin = values.get("origin")
    if not (isinstance(origin, list) and len(origin) == 3 and all(map(_is_number, origin))):
        raise MapError(f"{file}: origin: expected [x, y, yaw]: {origin!s:.80}")
    if origin[2] != 0:
        raise MapError(f"{file}: origin: expected a yaw of 0: {origin[2]}")
    try:
        pixels, white = _read_picture(file.parent / picture)
    except MapError as err:
        raise MapError(f"{file}: image: {err}") from err
    grey = np.arange(white + 1) / white
    probability = grey if negate else 1.0 - grey
    kinds = np.full(white + 1, UNKNOWN, np.int8)
    kinds[probability > occupied] = OCCUPIED
    kinds[probability < free] = FREE
    cells = kinds[np.clip(pixels, 0, white)]
    return OccupancyMap(cells[::-1], resolution, float(origin[0]), float(origin[1]))


def _read_yaml(file: Path) -> Dict[str, Any]:
    try:
        values = strict_yaml.load(file.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as err:
        raise MapError(f"cannot read the map {file}: {err}") from err
    except yaml.YAMLError as err:
        raise MapError(f"the map {file} is not YAML: {err}") from err
    if not isinstance(values, dict):
        raise MapError(f"{file}: expected the keys of a map, such as image and resolution")
    return values


def _read_picture(file: Path) -> Tuple[np.ndarray, int]:
    """Returns how bright the pixels are, as integers, and the brightness of white."""
    try:
        if file.stat().st_size > MOST_CELLS * _MOST_BYTES:
            raise ValueError(f"it has more than {MOST_CELLS * _MOST_BYTES} bytes")
        data = file.read_bytes()
        with Image.open(io.BytesIO(data)) as picture:  # Pillow reads no more of that than there is
            pixels = picture.width * picture.height
            if pixels > MOST_CELLS:
                raise ValueError(f"{pixels} pixels are too many, there can be {MOST_CELLS}")
            _check_length(data, pixels)
            if picture.mode.startswith("I"):  # 16 bits, which Pillow does not scale
                return np.asarray(picture), 65535
            return np.asarray(picture.convert("L")), 255
    except UnidentifiedImageError as err:
        raise MapError(f"{file}: expected a picture such as a PGM file of kind P5 or P2") from err
    except _UNREADABLE as err:
        text = shorten(str(err), 500) or type(err).__name__
        raise MapError(f"cannot read the picture {shorten(str(file), 1000)}: {text}") from err


def _check_length(data: bytes, pixels: int) -> None:
    """Refuses a picture of kind P2 that is cut off; Pillow before 9.5 makes up the rest."""
    if data.startswith(b"P2") and len(re.sub(b"#.*", b"", data).split()) < 4 + pixels:
        raise ValueError("the picture is cut off")


def _number(file: Path, values: Dict[str, Any], key: str) -> float:
    value = values.get(key)
    if not _is_number(value):
        raise MapError(f"{file}: {key}: expected a number: {value!s:.80}")
    return float(value)  # type: ignore[arg-type]  # it is a number


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
