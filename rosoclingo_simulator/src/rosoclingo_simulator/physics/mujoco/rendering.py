"""Renders the images of the robot's camera by MuJoCo. Needs no ROS."""

from __future__ import annotations

import math
from typing import Tuple

import numpy as np

from rosoclingo_simulator.physics.mujoco.headless import OpenGLError, mujoco, open_gl
from rosoclingo_simulator.physics.mujoco.mujoco_physics import MujocoPhysics

FARTHEST = 10.0
"""How far the depth camera sees, in metres."""

_CAMERA = "camera"
_MOST_SHAPES = 2000  # far more than a world has


class Eye:
    """Renders camera images. Belongs to the thread that makes it.

    MuJoCo's own class for this renders twice for colour and depth, which takes twice as long, and
    loads OpenGL when it is imported.
    """

    def __init__(self, physics: MujocoPhysics, width: int, height: int) -> None:
        """Opens OpenGL.

        Args:
            physics: The world with the robot.
            width: Of the pictures, in pixels.
            height: Of the pictures, in pixels.

        Raises:
            OpenGLError: There is no OpenGL.
        """
        model = physics.model
        model.vis.global_.offwidth, model.vis.global_.offheight = width, height
        self._physics = physics
        self._near, self._far = (
            float(distance) * model.stat.extent
            for distance in (model.vis.map.znear, model.vis.map.zfar)
        )
        self._rectangle = mujoco.MjrRect(0, 0, width, height)
        self._options = mujoco.MjvOption()
        self._nudge = mujoco.MjvPerturb()
        self._camera = mujoco.MjvCamera()
        self._camera.type = mujoco.mjtCamera.mjCAMERA_FIXED
        self._camera.fixedcamid = model.camera(_CAMERA).id
        self._scene = mujoco.MjvScene(model, maxgeom=_MOST_SHAPES)
        # They cost more than all else, and a depth camera does not see them.
        for flag in (mujoco.mjtRndFlag.mjRND_SHADOW, mujoco.mjtRndFlag.mjRND_REFLECTION):
            self._scene.flags[flag] = 0
        self._gl = open_gl(width, height)
        try:
            self._context = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100.value)
        except mujoco.FatalError as err:
            raise OpenGLError(f"OpenGL cannot make pictures of {width} x {height}: {err}") from err
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, self._context)
        # Near is 1 and far is 0: floating-point numbers are then fine enough far away, too.
        self._context.readDepthMap = mujoco.mjtDepthMap.mjDEPTH_ZEROFAR

    def look(self) -> Tuple[np.ndarray, np.ndarray]:
        """Renders the camera's current images.

        Returns:
            Red, green and blue of each pixel, by row and column; and its distance along the
            camera's axis in metres, not a number where there is nothing within the range.
        """
        model, data = self._physics.model, self._physics.data
        self._gl.make_current()
        mujoco.mjv_updateScene(
            model, data, self._options, self._nudge, self._camera,
            mujoco.mjtCatBit.mjCAT_ALL.value, self._scene,
        )  # fmt: skip
        mujoco.mjr_render(self._rectangle, self._scene, self._context)
        rows, columns = self._rectangle.height, self._rectangle.width
        color = np.empty((rows, columns, 3), np.uint8)
        buffer = np.empty((rows, columns), np.float32)
        mujoco.mjr_readPixels(color, buffer, self._rectangle, self._context)
        near, far = self._near, self._far
        depth = near * far / (near + buffer.astype(np.float64) * (far - near))
        depth[depth > FARTHEST] = np.nan
        # OpenGL's first row is the lowest one.
        return color[::-1], depth[::-1].astype(np.float32)

    def close(self) -> None:
        """Gives OpenGL back; to be called by the same thread."""
        self._gl.make_current()
        self._context.free()
        self._gl.free()


def focal_length(physics: MujocoPhysics, height: int) -> float:
    """Returns the camera's focal length in pixels, for pictures of a height in pixels."""
    across = math.radians(float(physics.model.camera(_CAMERA).fovy[0]))
    return height / 2 / math.tan(across / 2)


def mounting(physics: MujocoPhysics) -> Tuple[np.ndarray, np.ndarray]:
    """Returns where the camera is on the robot.

    Returns:
        Its place as x, y and z in metres, and its direction as a quaternion x, y, z and w; its
        x-axis leads to the right, its y-axis down, and its z-axis to what it looks at.
    """
    camera = physics.model.camera(_CAMERA)
    turned = np.empty(4)
    # MuJoCo's cameras look along their negative z-axis, with the y-axis up.
    mujoco.mju_mulQuat(turned, camera.quat, np.array([0.0, 1.0, 0.0, 0.0]))
    return camera.pos.copy(), np.roll(turned, -1)
