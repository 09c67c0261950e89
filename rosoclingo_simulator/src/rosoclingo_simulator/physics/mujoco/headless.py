"""MuJoCo, imported without OpenGL, and a way to OpenGL where pictures are wanted."""

from __future__ import annotations

import importlib
import os
from typing import Any

from rosclingo.errors import RosclingoError

# What the variable MUJOCO_GL asks for decides what `import mujoco` loads, and it fails with what is
# not there. Physics needs no OpenGL.
_WANTED = os.environ.get("MUJOCO_GL", "")
os.environ["MUJOCO_GL"] = "disable"
try:
    import mujoco
finally:
    if _WANTED:
        os.environ["MUJOCO_GL"] = _WANTED
    else:
        del os.environ["MUJOCO_GL"]

__all__ = ["OpenGLError", "mujoco", "open_gl"]

_KINDS = ("egl", "osmesa")  # need no display; the first is the default


class OpenGLError(RosclingoError):
    """OpenGL is missing, so that pictures cannot be rendered; the message says what helps."""


def open_gl(width: int, height: int) -> Any:
    """Returns a new OpenGL context of MuJoCo's for this thread, which is its current one.

    Args:
        width: Of the pictures, in pixels.
        height: Of the pictures, in pixels.

    Raises:
        OpenGLError: There is no OpenGL.
    """
    kind = _WANTED.lower().strip() or _KINDS[0]
    try:
        if kind not in _KINDS:
            raise ValueError(f"MUJOCO_GL is {_WANTED!r}, and not one of {', '.join(_KINDS)}")
        context = importlib.import_module(f"mujoco.{kind}").GLContext(width, height)
        context.make_current()
    # A missing library shows as any of ImportError, AttributeError, OSError and OpenGL's errors.
    except Exception as err:
        raise OpenGLError(
            f"there is no OpenGL by {kind}: {err}; install the apt packages libegl1, libgl1 and "
            "libgl1-mesa-dri, and leave the environment variable MUJOCO_GL unset"
        ) from err
    return context
