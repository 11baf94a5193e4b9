"""Bounds of the motion of a robot between two configurations, while the values of all joints change
linearly.

client/robot/joint_motion.cc derives them; names and constants are the same. Each bound is a number
or an array over motions, computed in floating point; `travel` and `deviation` add the rounding
errors.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hulld.robot.description import Description, Joint, PoseNumbers
from hulld.robot.kinematics import Columns

#: Motions that turn by more than this in a span, in radians, have no bound.
MAX_TURN = 2.0

_UNIT = sys.float_info.epsilon / 2
_ROUNDED_UP = 1 + 2.0**-20
# In units of roundoff. Sine and cosine of numpy err by up to 4 ulp, 8 units.
_QUATERNION_PRODUCT = 9
_AXIS_QUATERNION = 16
_NORMALIZATION = 4
_TURNED_OFFSET = 40
_INTERPOLATION = 3


@dataclass(frozen=True)
class MotionBound:
    """turn: the sum of the rates of all rotations on the path from the root, in radians. speed,
    bend: first and second derivative of the origin. distance: of the origin from the world's.
    quaternion_rounding, rounding: rounding errors of a computed pose."""

    turn: Any = 0.0
    speed: Any = 0.0
    bend: Any = 0.0
    distance: Any = 0.0
    quaternion_rounding: Any = 0.0
    rounding: Any = 0.0

    def travel(self, duration: Any, reach: Any) -> Any:
        """The path length of every point within `reach` of the origin, in a span of this
        duration."""
        length = duration * (self.speed + self.turn * reach)
        return _ROUNDED_UP * length + sys.float_info.min

    def deviation(self, duration: Any, reach: Any) -> Any:
        """The distance of every point within `reach` of the origin from its place in the motion of
        Placement.end_pose between the computed poses at the ends of a span of this duration.
        Requires duration * turn <= MAX_TURN."""
        curved = duration * duration / 8 * (self.bend + reach * self.turn * self.turn / 2)
        rounded = self.rounding + 2 * reach * (self.quaternion_rounding + _NORMALIZATION * _UNIT)
        return _ROUNDED_UP * (curved + rounded) + sys.float_info.min

    def at(self, *index: Any) -> MotionBound:
        """The bounds of some motions."""
        return MotionBound(*(column[index] for column in vars(self).values()))

    def fixed(self, X: PoseNumbers) -> MotionBound:
        """The bound of a frame that is fixed in this one."""
        return self._offset(math.hypot(*X[4:]), 0.0, 0.0)._rotated(0.0, 0.0)

    def moved(self, joint: Joint, start: Columns, end: Columns) -> MotionBound:
        """The bound of the frame after a joint."""
        if joint.kind in ("revolute", "continuous"):
            return self._turned(start[0], end[0])
        if joint.kind == "prismatic":
            factor = math.hypot(*joint.axis)
            ends = ([start[0]], [end[0]])
            return self._shifted(*ends, factor, _INTERPOLATION + 1)._rotated(0.0, 0.0)
        if joint.kind == "planar":
            steps = _INTERPOLATION + _TURNED_OFFSET
            return self._shifted(start[:2], end[:2], 1.0, steps)._turned(start[2], end[2])
        if joint.kind == "floating":
            return self._shifted(start[4:], end[4:], 1.0, _INTERPOLATION)._interpolated(start, end)
        return self

    def _offset(self, length: Any, speed: Any, rounding: Any) -> MotionBound:
        distance = self.distance + length
        return replace(
            self,
            bend=self.bend + self.turn * (self.turn * length + 2 * speed),
            speed=self.speed + self.turn * length + speed,
            distance=distance,
            rounding=self.rounding
            + 2 * self.quaternion_rounding * length
            + _TURNED_OFFSET * _UNIT * length
            + rounding
            + _UNIT * distance,
        )

    def _rotated(self, rate: Any, rounding: Any) -> MotionBound:
        product = _QUATERNION_PRODUCT * _UNIT
        return replace(
            self,
            turn=self.turn + rate,
            quaternion_rounding=self.quaternion_rounding + rounding + product,
        )

    def _turned(self, start: Any, end: Any) -> MotionBound:
        # The angle enters the quaternion by its half.
        of_angle = _INTERPOLATION / 2 * _UNIT * np.maximum(np.abs(start), np.abs(end))
        return self._rotated(np.abs(end - start), of_angle + _AXIS_QUATERNION * _UNIT)

    def _shifted(
        self, start: Sequence[Any], end: Sequence[Any], factor: float, steps: int
    ) -> MotionBound:
        length = factor * np.maximum(_length(start), _length(end))
        speed = factor * _length([b - a for a, b in zip(start, end)])
        return self._offset(length, speed, 2 * steps * _UNIT * length)

    def _interpolated(self, start: Columns, end: Columns) -> MotionBound:
        a, b = _length(start[:4]), _length(end[:4])
        speed = _length([q - p for p, q in zip(start[:4], end[:4])])
        least = a * (b / np.hypot(a, b))
        return self._rotated(2.2 * speed / least, _INTERPOLATION * _UNIT * (a + b) / least)


def _length(columns: Sequence[Any]) -> Any:
    length = np.abs(columns[0])
    for column in columns[1:]:
        length = np.hypot(length, column)
    return length


def stacked_bounds(bounds: Sequence[MotionBound], count: int) -> MotionBound:
    """The bounds of several frames in `count` motions as arrays, frames x motions."""
    columns = zip(*(vars(bound).values() for bound in bounds))
    return MotionBound(
        *(np.stack([np.broadcast_to(one, count) for one in column]) for column in columns)
    )


def bound_motions(
    robot: Description, X_WB: Sequence[float], start: Sequence[Columns], end: Sequence[Columns]
) -> list[MotionBound]:
    """The bound of each link's frame, for results of joint_values that align_turns aligned."""
    base = MotionBound(distance=math.hypot(*X_WB[4:]))
    bounds: list[MotionBound] = []
    for link in robot.links:
        if link.parent_joint < 0:
            bounds.append(base)
            continue
        joint = robot.joints[link.parent_joint]
        bound = bounds[joint.parent].fixed(joint.X_PJ)
        bounds.append(bound.moved(joint, start[link.parent_joint], end[link.parent_joint]))
    return bounds


def align_turns(robot: Description, values: list[list[Any]]) -> None:
    """Negates quaternions of floating joints where that shortens the rotation from the previous
    waypoint. values: of joint_values, arrays over waypoints."""
    for joint, value in zip(robot.joints, values):
        if joint.kind != "floating":
            continue
        cosines = sum(one[:-1] * one[1:] for one in value[:4])
        signs = np.cumprod(np.concatenate([[1.0], np.where(cosines < 0, -1.0, 1.0)]))
        value[:4] = [one * signs for one in value[:4]]
