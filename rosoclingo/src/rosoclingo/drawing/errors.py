"""Errors of pictures. Needs no matplotlib."""

from __future__ import annotations

from contextlib import contextmanager
from pathlib import Path
from typing import Iterator

from rosclingo.errors import RosclingoError


class PictureError(RosclingoError):
    """A picture cannot be drawn."""


class GraphError(RosclingoError):
    """An instance that cannot be read or drawn; the message names file, atom and remedy."""


@contextmanager
def picture_errors(file: Path, option: str) -> Iterator[None]:
    """Returns a context in which matplotlib is imported, and a picture drawn with it.

    Args:
        file: The picture.
        option: The option of the command line that requests it.

    Raises:
        PictureError: matplotlib is missing, or draws no pictures of this ending.
    """
    try:
        yield
    except ImportError as err:
        raise PictureError(f"{file}: {err}; pip install 'matplotlib>=3.6', or no {option}") from err
    except ValueError as err:
        raise PictureError(f"{file}: {err}; .png is a good ending") from err
