"""Points whose hulls enclose boxes, cylinders, spheres, and capsules."""

from __future__ import annotations

import functools
import math

import numpy as np
import numpy.typing as npt

from hulld.robot.description import Shape

Points = npt.NDArray[np.float64]

CYLINDER_SIDES = 32
# Proven: the at most 64 operations of a coordinate lose less than 2^-46 of a length.
_OUTWARD = 1 + 2.0**-46


def primitive_points(shape: Shape) -> tuple[Points, float]:
    """n x 3 points in the frame of the shape, which is no mesh, and the excess: their hull contains
    the shape and extends at most this far beyond it, up to the rounding of this number.

    A box is exact. A cylinder becomes a prism of 32 sides, a sphere a geodesic polyhedron of 162
    vertices, a capsule the hull of two of these.
    """
    if shape.kind == "box":
        x, y, z = (size / 2 for size in shape.size)
        corners = [(a, b, c) for c in (-z, z) for b in (-y, y) for a in (-x, x)]
        return np.array(corners), 0.0
    radius = shape.size[0]
    if shape.kind == "cylinder":
        # The sides of a regular polygon are nearer to its center than its corners, by this factor.
        reach = _OUTWARD * radius / math.cos(math.pi / CYLINDER_SIDES)
        half = shape.size[1] / 2
        angles = [2 * math.pi * side / CYLINDER_SIDES for side in range(CYLINDER_SIDES)]
        sides = [
            (reach * math.cos(angle), reach * math.sin(angle), z)
            for angle in angles
            for z in (-half, half)
        ]
        return np.array(sides), reach - radius
    ball = _ball()
    excess = radius * (float(np.linalg.norm(ball, axis=1).max()) - 1)
    if shape.kind == "sphere":
        return radius * ball, excess
    # Adding the radius to half the length has a rounding error relative to the sum, not to the
    # radius.
    half = shape.size[1] / 2
    cap = (1 + 2.0**-51 * (1 + half / radius)) * radius * ball
    return np.concatenate([cap + (0, 0, half), cap - (0, 0, half)]), excess


@functools.cache
def _ball() -> Points:
    """The vertices of a polyhedron that contains the unit ball: an icosahedron with each triangle
    split twice into four. Its triangles form a closed surface that each ray from the origin meets
    once, and no point of it is nearer than the nearest plane."""
    g = (1 + math.sqrt(5)) / 2
    corners = np.array(
        [(s, t * g, 0) for t in (1, -1) for s in (-1, 1)]
        + [(0, s, t * g) for t in (1, -1) for s in (-1, 1)]
        + [(t * g, 0, s) for t in (1, -1) for s in (-1, 1)]
    )
    triangles = np.array(
        [
            (0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11),
            (1, 5, 9), (5, 11, 4), (11, 10, 2), (10, 7, 6), (7, 1, 8),
            (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9),
            (4, 9, 5), (2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1),
        ]
    )  # fmt: skip
    faces = _unit(corners)[triangles]
    for _ in range(2):
        a, b, c = faces[:, 0], faces[:, 1], faces[:, 2]
        ab, bc, ca = _unit(a + b), _unit(b + c), _unit(c + a)
        parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        faces = np.concatenate([np.stack(part, axis=1) for part in parts])
    normals = _unit(np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0]))
    nearest = np.abs((normals * faces[:, 0]).sum(axis=1)).min()
    vertices: Points = np.unique(faces.reshape(-1, 3), axis=0) * (_OUTWARD / nearest)
    return vertices


def _unit(vectors: Points) -> Points:
    unit: Points = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
    return unit
