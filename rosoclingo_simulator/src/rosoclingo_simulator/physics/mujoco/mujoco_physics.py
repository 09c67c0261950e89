"""Physics with wheels, friction and contacts, by MuJoCo. Needs no ROS."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, Dict, Optional, Sequence, Tuple
from xml.sax.saxutils import quoteattr

import numpy as np
import rospkg

from rosoclingo_simulator.errors import ObstacleError, PhysicsError
from rosoclingo_simulator.physics import physics
from rosoclingo_simulator.physics.mujoco.headless import mujoco
from rosoclingo_simulator.physics.physics import Box, Pose, between

BOXES = 8
"""How many boxes there can be at a time: MuJoCo's models do not grow."""

_WHEEL_RADIUS = 0.035  # metres; like the distance of the wheels, it is the model's number

# How far what is asked of the wheels may be ahead of what they do, in m/s and rad/s. Without a
# limit, wheels that a wall has stopped go on pushing after they were told to turn back.
_LINEAR_LEAD = 0.1
_ANGULAR_LEAD = 0.5

# How fast the robot is at most when it touches something: no faster than it drives itself.
# Of its base along and around three axes, and of its wheels.
_WHEEL_SPEED = (
    physics.LINEAR_SPEED + physics.ANGULAR_SPEED * physics.WHEEL_DISTANCE / 2
) / _WHEEL_RADIUS
_PUSHED = np.array([physics.LINEAR_SPEED] * 3 + [physics.ANGULAR_SPEED] * 3 + [_WHEEL_SPEED] * 2)

# A box that is not there is under the floor, and invisible, which the laser sees through.
_NO_BOX = Box(0.0, 0.0, 0.0, 0.1, 0.1, height=-10.0)
_INVISIBLE = (0.0, 0.0, 0.0, 0.0)
_COLOR = (0.6, 0.4, 0.2, 1.0)


class MujocoPhysics:
    """A robot with two driven wheels in a world; one thread uses it.

    Attributes:
        model: MuJoCo's model of the world, the robot and the boxes.
        data: MuJoCo's state of it.
        touches: Whether the robot has touched a wall or a box in the last step.
    """

    def __init__(self, world: Path, pose: Pose, robot: Optional[Path] = None) -> None:
        """Loads a world and puts the robot there.

        Args:
            world: A MuJoCo model (MJCF) whose floor is at height 0.
            pose: Where the robot is at first.
            robot: The robot's model; the package's own if there is none.

        Raises:
            PhysicsError: A file cannot be read, or is not a model.
        """
        self.model = _load(world, robot or _own_robot())
        self.data = mujoco.MjData(self.model)
        self._step = self.model.opt.timestep
        self._body = self.model.body("robot").id
        self._hull = self.model.geom("hull").id
        joints = [self.model.joint(name) for name in ("robot", "wheel_left", "wheel_right")]
        self._place = slice(joints[0].qposadr[0], joints[0].qposadr[0] + 7)
        self._speeds = slice(joints[0].dofadr[0], joints[0].dofadr[0] + len(_PUSHED))
        self._wheels = [joint.dofadr[0] for joint in joints[1:]]
        self._motors = [self.model.actuator(name).id for name in ("wheel_left", "wheel_right")]
        self._free = [f"box_{number}" for number in range(BOXES)]
        self._taken: Dict[str, str] = {}
        self.reset(pose)

    def reset(self, pose: Pose) -> None:
        """Puts the robot somewhere, standing still; boxes stay."""
        boxes = self.data.mocap_pos.copy(), self.data.mocap_quat.copy()
        mujoco.mj_resetData(self.model, self.data)
        self.data.mocap_pos[:], self.data.mocap_quat[:] = boxes
        self.data.qpos[self._place] = (pose.x, pose.y, 0.0, *_quaternion(pose.theta))
        self._asked = (0.0, 0.0)
        self._owed = 0.0
        mujoco.mj_forward(self.model, self.data)
        self.touches = self._hull in self.data.contact.geom

    def step(self, linear: float, angular: float, seconds: float) -> None:
        """Lets time pass, in steps of the model; what is left over passes the next time.

        Args:
            linear: Wanted speed, in m/s.
            angular: Wanted speed of turning, in rad/s.
            seconds: How much time passes.
        """
        linear = between(linear, -physics.LINEAR_SPEED, physics.LINEAR_SPEED)
        angular = between(angular, -physics.ANGULAR_SPEED, physics.ANGULAR_SPEED)
        self._owed += seconds
        steps = int(self._owed / self._step + 1e-6)
        self._owed -= steps * self._step
        touches = False
        for _ in range(steps):
            self._ask(linear, angular)
            mujoco.mj_step(self.model, self.data)
            if self._hull in self.data.contact.geom:
                touches = True
                # A box that is put onto the robot would throw it through the office.
                speed = self.data.qvel[self._speeds]
                np.clip(speed, -_PUSHED, _PUSHED, out=speed)
        if steps:
            self.touches = touches

    def _ask(self, linear: float, angular: float) -> None:
        """Tells the wheels how fast to turn in the next step, within the robot's acceleration."""
        (asked_linear, asked_angular), (real_linear, real_angular) = self._asked, self.velocity
        faster = physics.LINEAR_ACCELERATION * self._step
        quicker = physics.ANGULAR_ACCELERATION * self._step
        asked_linear = _towards(asked_linear, linear, faster, real_linear, _LINEAR_LEAD)
        asked_angular = _towards(asked_angular, angular, quicker, real_angular, _ANGULAR_LEAD)
        self._asked = asked_linear, asked_angular
        turning = asked_angular * physics.WHEEL_DISTANCE / 2
        left, right = self._motors
        self.data.ctrl[left] = (asked_linear - turning) / _WHEEL_RADIUS
        self.data.ctrl[right] = (asked_linear + turning) / _WHEEL_RADIUS

    @property
    def pose(self) -> Pose:
        """The true pose of the robot in the map."""
        x, y, _, qw, qx, qy, qz = self.data.qpos[self._place]
        theta = math.atan2(2 * (qw * qz + qx * qy), 1 - 2 * (qy * qy + qz * qz))
        return Pose(float(x), float(y), theta)

    @property
    def robots(self) -> Tuple[Pose, ...]:
        """The pose of the only robot of the world."""
        return (self.pose,)

    @property
    def velocity(self) -> Tuple[float, float]:
        """The true velocity of the robot by its wheels, in m/s and rad/s."""
        left, right = (float(self.data.qvel[wheel]) * _WHEEL_RADIUS for wheel in self._wheels)
        return (left + right) / 2, (right - left) / physics.WHEEL_DISTANCE

    def put(self, name: str, box: Box) -> None:
        """Puts a box into the world, in place of the one of the same name if there is one.

        Raises:
            ObstacleError: There are as many boxes as there can be.
        """
        if name not in self._taken:
            if not self._free:
                raise ObstacleError(
                    f"there is no box left for {name!r}: remove one of {', '.join(self._taken)} "
                    f"first, as there can be {BOXES} at a time"
                )
            self._taken[name] = self._free.pop()
        self._place_box(self._taken[name], box, _COLOR)

    def remove(self, name: str) -> None:
        """Takes a box away; does nothing if there is none of the name."""
        if name in self._taken:
            self._free.append(self._taken.pop(name))
            self._place_box(self._free[-1], _NO_BOX, _INVISIBLE)

    def _place_box(self, name: str, box: Box, color: Sequence[float]) -> None:
        """Gives a box of the model another place, size and color."""
        model, data = self.model, self.data
        geom, body = model.geom(name).id, model.body(name)
        size = np.abs([box.length, box.width, box.height]) / 2
        radius = np.linalg.norm(size)
        model.geom_size[geom] = size
        model.geom_rgba[geom] = color
        # What MuJoCo's compiler derives of the size, to tell early what is too far away to touch.
        model.geom_rbound[geom] = radius
        model.geom_aabb[geom, 3:] = size
        model.bvh_aabb[model.body_bvhadr[body.id], 3:] = radius  # along any axes
        data.mocap_pos[body.mocapid[0]] = (box.x, box.y, box.height / 2)
        data.mocap_quat[body.mocapid[0]] = _quaternion(box.theta)
        mujoco.mj_forward(model, data)
        self.touches = self._hull in data.contact.geom

    def ranges(self, angles: np.ndarray, longest: float) -> np.ndarray:
        """Returns the ranges of a laser; see :class:`.physics.Physics`."""
        pose = self.pose
        start = np.array([pose.x, pose.y, physics.LASER_HEIGHT])
        ahead = angles + pose.theta
        directions = np.stack((np.cos(ahead), np.sin(ahead), np.zeros_like(ahead)), axis=-1)
        hit = np.zeros(1, dtype=np.int32)
        # One by one: the arguments of mj_multiRay are not the same in all of MuJoCo's versions.
        found = np.array(
            [
                mujoco.mj_ray(self.model, self.data, start, direction, None, 1, self._body, hit)
                for direction in directions
            ]
        )
        found[(found < 0) | (found > longest)] = np.inf
        return found


def _own_robot() -> Path:
    return Path(rospkg.RosPack().get_path("rosoclingo_simulator")) / "models" / "turtlebot.xml"


def _load(world: Path, robot: Path) -> Any:
    """Returns a model of a world with a robot and with boxes that are not there."""
    for file in (world, robot):
        if not file.is_file():  # MuJoCo would leave a log in the working directory
            raise PhysicsError(f"there is no file {file}")
    boxes = "".join(
        f'<body name="box_{number}" mocap="true" pos="0 0 {_NO_BOX.height / 2}">'
        f'<geom name="box_{number}" type="box" size="0.05 0.05 0.05" rgba="0 0 0 0" '
        'contype="1" conaffinity="1" group="0" condim="3"/></body>'
        for number in range(BOXES)
    )
    includes = "".join(f"<include file={quoteattr(str(p.resolve()))}/>" for p in (world, robot))
    try:
        return mujoco.MjModel.from_xml_string(
            f"<mujoco>{includes}<worldbody>{boxes}</worldbody></mujoco>"
        )
    except ValueError as err:
        raise PhysicsError(
            f"MuJoCo cannot load the world {world} with the robot {robot}: {err}"
        ) from err


def _quaternion(theta: float) -> Tuple[float, float, float, float]:
    """Returns a turn around the vertical axis as w, x, y, z."""
    return math.cos(theta / 2), 0.0, 0.0, math.sin(theta / 2)


def _towards(asked: float, wanted: float, change: float, real: float, lead: float) -> float:
    """Returns the next setpoint: nearer to the wanted velocity, and not far from the true one."""
    asked = between(asked, -abs(real) - lead, abs(real) + lead)
    return between(wanted, asked - change, asked + change)
