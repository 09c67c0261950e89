"""Errors of pictures. Needs no matplotlib."""

from __future__ import annotations

from contextlib import contextmanager
from pathlib import Path
from typing import Iterator

from rosclingo.errors import RosclingoError
from rosclingo.libraries import install_command

_MATPLOTLIB = "matplotlib>=3.6"


class PictureError(RosclingoError):
    """A picture cannot be drawn."""


@contextmanager
def picture_errors(file: Path) -> Iterator[None]:
    """Returns a context in which matplotlib is imported, and a picture drawn with it.

    Args:
        file: The picture.

    Raises:
        PictureError: matplotlib is missing, or draws no pictures of this ending.
    """
    try:
        yield
    except ImportError as err:
        raise PictureError(
            f"{file}: pictures need matplotlib, which cannot be loaded ({err}); install it: "
            f"{install_command(_MATPLOTLIB)}"
        ) from err
    except ValueError as err:
        raise PictureError(f"{file}: {err}; .png is a good ending") from err
