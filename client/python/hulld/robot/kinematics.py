"""Poses of links for many configurations at once.

A pose is seven columns w x y z x y z, each a number or an array of n numbers: the quaternion, which
need not be normalized, and the translation. The operations are the same as hullctl's, in the same
order, so that both check the same poses up to the rounding of sine and cosine.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from hulld.robot.description import NO_MOTION, Description, Joint

Columns = Sequence[Any]


def compose(X_AB: Columns, X_BC: Columns) -> list[Any]:
    """X_AC = X_AB X_BC. Requires that no quaternion of X_AB is zero."""
    w, x, y, z = X_AB[:4]
    a, b, c, d = X_BC[:4]
    p, q, r = X_BC[4:]
    rotation = [
        w * a - (x * b + y * c + z * d),
        w * b + a * x + (y * d - z * c),
        w * c + a * y + (z * b - x * d),
        w * d + a * z + (x * c - y * b),
    ]
    if all(isinstance(one, float) and one == 0 for one in (p, q, r)):
        return rotation + list(X_AB[4:])
    # p + 2 (w v x p + v x (v x p)) / |q|^2
    scale = 2 / (w * w + x * x + y * y + z * z)
    i, j, k = y * r - z * q, z * p - x * r, x * q - y * p
    return rotation + [
        X_AB[4] + (p + scale * (w * i + (y * k - z * j))),
        X_AB[5] + (q + scale * (w * j + (z * i - x * k))),
        X_AB[6] + (r + scale * (w * k + (x * j - y * i))),
    ]


def _rotation_about(axis: Sequence[float], angle: Any) -> list[Any]:
    sine = np.sin(angle / 2) / math.hypot(*axis)
    return [np.cos(angle / 2), *(sine * one if one else 0.0 for one in axis), 0.0, 0.0, 0.0]


def _motion_of(joint: Joint, value: Columns) -> Columns:
    if joint.kind in ("revolute", "continuous"):
        return _rotation_about(joint.axis, value[0])
    if joint.kind == "prismatic":
        return [1.0, 0.0, 0.0, 0.0, *(value[0] * one for one in joint.axis)]
    if joint.kind == "floating":
        return value
    if joint.kind == "fixed":
        return NO_MOTION
    # The shortest rotation from z to the normal, about z x n; for -z, half a turn about x. x and y
    # of a planar joint run along the images of these axes, and theta turns about the normal.
    x, y, z = joint.axis
    turn = [1 + z, -y if 1 + z else 1.0, x, 0.0, 0.0, 0.0, 0.0]
    moved = compose(turn, [1.0, 0.0, 0.0, 0.0, value[0], value[1], 0.0])
    return _rotation_about(joint.axis, value[2])[:4] + moved[4:]


def joint_values(robot: Description, q: npt.NDArray[np.float64]) -> list[list[Any]]:
    """The value of each joint, seven columns; for one configuration, seven numbers. q: n x dof.
    Mimic joints follow theirs."""
    values: list[list[Any]] = [[0.0] * 7 for _ in robot.joints]
    for column, variable in enumerate(robot.variables):
        one = float(q[0, column]) if len(q) == 1 else np.ascontiguousarray(q[:, column])
        values[variable.joint][variable.place] = one
    for index, joint in enumerate(robot.joints):
        multiplier, offset, leader = 1.0, 0.0, index
        # A joint may mimic one that mimics another; the reader rejects cycles.
        while joint.mimics >= 0:
            offset += multiplier * joint.offset
            multiplier *= joint.multiplier
            leader = joint.mimics
            joint = robot.joints[leader]
        if leader != index:
            values[index][0] = multiplier * values[leader][0] + offset
    return values


def link_poses(
    robot: Description, X_WB: Sequence[float], values: Sequence[Columns]
) -> list[Columns]:
    """X_WL of each link, for the root at X_WB and the results of joint_values."""
    poses: list[Columns] = []
    for link in robot.links:
        if link.parent_joint < 0:
            poses.append(X_WB)
            continue
        joint = robot.joints[link.parent_joint]
        X_WJ = compose(poses[joint.parent], joint.X_PJ)
        if joint.kind != "fixed":
            X_WJ = compose(X_WJ, _motion_of(joint, values[link.parent_joint]))
        poses.append(X_WJ)
    return poses


def stacked(poses: Sequence[Columns], count: int) -> npt.NDArray[np.float64]:
    """count x len(poses) x 7 numbers."""
    array = np.empty((count, len(poses), 7))
    for index, pose in enumerate(poses):
        for column in range(7):
            array[:, index, column] = pose[column]
    return array
