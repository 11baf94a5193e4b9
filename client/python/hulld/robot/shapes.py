"""Rounded hulls of boxes, cylinders, spheres, and capsules."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from hulld.robot.description import Shape

Points = npt.NDArray[np.float64]

CYLINDER_SIDES = 32
# Proven: the at most 64 operations of a coordinate lose less than 2^-46 of a length.
_OUTWARD = 1 + 2.0**-46


def primitive_points(shape: Shape) -> tuple[Points, float, float]:
    """The rounded hull of a shape other than a mesh: n x 3 points in the frame of the shape, the
    radius, and the excess. The rounded hull contains the shape and extends at most the excess
    beyond it, up to the rounding of this number.

    A box, a sphere (its center), and a capsule (its segment) are exact. A cylinder becomes a prism
    of 32 sides.
    """
    if shape.kind == "box":
        x, y, z = (size / 2 for size in shape.size)
        corners = [(a, b, c) for c in (-z, z) for b in (-y, y) for a in (-x, x)]
        return np.array(corners), 0.0, 0.0
    radius = shape.size[0]
    if shape.kind == "sphere":
        return np.zeros((1, 3)), radius, 0.0
    half = shape.size[1] / 2
    if shape.kind == "capsule":
        return np.array([(0, 0, -half), (0, 0, half)]), radius, 0.0
    # Ratio of the distance of a regular polygon's sides from its center to that of its corners.
    reach = _OUTWARD * radius / math.cos(math.pi / CYLINDER_SIDES)
    angles = [2 * math.pi * side / CYLINDER_SIDES for side in range(CYLINDER_SIDES)]
    sides = [
        (reach * math.cos(angle), reach * math.sin(angle), z)
        for angle in angles
        for z in (-half, half)
    ]
    return np.array(sides), 0.0, reach - radius
