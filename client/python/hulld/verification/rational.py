"""Vectors, rotations, and convex hulls of a few points, in rational numbers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from itertools import combinations

import numpy as np
import numpy.typing as npt

from hulld.geometry.poses import PoseLike, pack_pose

Point = tuple[Fraction, Fraction, Fraction]
Quaternion = tuple[Fraction, Fraction, Fraction, Fraction]
ORIGIN: Point = (Fraction(0), Fraction(0), Fraction(0))


def dot(a: Point, b: Point) -> Fraction:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Point, b: Point) -> Point:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def minus(a: Point, b: Point) -> Point:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def exact_point(numbers: Sequence[float] | npt.NDArray[np.float64]) -> Point:
    return (Fraction(float(numbers[0])), Fraction(float(numbers[1])), Fraction(float(numbers[2])))


def pose_parts(pose: PoseLike) -> tuple[Quaternion, Point]:
    """The rotation and translation of a pose."""
    w, x, y, z, *translation = (Fraction(float(number)) for number in pack_pose(pose))
    return (w, x, y, z), (translation[0], translation[1], translation[2])


def rotation_form(a: Quaternion, b: Quaternion) -> tuple[tuple[Point, Point, Point], Fraction]:
    """Returns R(q) |q|^2 and |q|^2 if a = b = q, and otherwise the symmetric bilinear forms of
    these."""
    ww, xx, yy, zz = (p * q for p, q in zip(a, b))

    def twice(i: int, j: int) -> Fraction:
        return a[i] * b[j] + a[j] * b[i]

    rows = (
        (ww + xx - yy - zz, twice(1, 2) - twice(0, 3), twice(1, 3) + twice(0, 2)),
        (twice(1, 2) + twice(0, 3), ww - xx + yy - zz, twice(2, 3) - twice(0, 1)),
        (twice(1, 3) - twice(0, 2), twice(2, 3) + twice(0, 1), ww - xx - yy + zz),
    )
    return rows, ww + xx + yy + zz


class ExactPose:
    """A pose, exactly."""

    def __init__(self, rotation: Quaternion, translation: Point) -> None:
        self._rows, self._norm = rotation_form(rotation, rotation)
        self._translation = translation

    @classmethod
    def of(cls, pose: PoseLike) -> ExactPose:
        return cls(*pose_parts(pose))

    def __call__(self, point: Point) -> Point:
        x, y, z = (dot(row, point) / self._norm for row in self._rows)
        t = self._translation
        return (x + t[0], y + t[1], z + t[2])


def sign(a: Fraction, b: Fraction, c: Fraction) -> int:
    """The sign of a + b sqrt(c); c is not negative."""

    def sign(number: Fraction) -> int:
        return (number > 0) - (number < 0)

    if b == 0 or sign(a) == sign(b):
        return sign(a)
    return sign(b) if a == 0 else sign(a) * sign(a * a - b * b * c)


def holds_origin(points: Sequence[Point]) -> bool:
    """True if the convex hull of the points contains 0 (Caratheodory: some simplex does)."""
    if any(p == ORIGIN for p in points):
        return True
    for p, q in combinations(points, 2):
        if cross(p, q) == ORIGIN and dot(p, q) < 0:
            return True
    for p, q, r in combinations(points, 3):
        n = cross(minus(q, p), minus(r, p))
        if n == ORIGIN or dot(n, p) != 0:
            continue
        if all(dot(n, cross(a, b)) >= 0 for a, b in ((p, q), (q, r), (r, p))):
            return True
    for p, q, r, s in combinations(points, 4):
        # Six times each volume, with 0 in place of each corner.
        volume = dot(minus(q, p), cross(minus(r, p), minus(s, p)))
        parts = (
            dot(q, cross(r, s)),
            -dot(p, cross(r, s)),
            dot(p, cross(q, s)),
            -dot(p, cross(q, r)),
        )
        if volume != 0 and all(part * volume >= 0 for part in parts):
            return True
    return False


def surrounds_origin(points: Sequence[Point]) -> bool:
    """True if 0 is strictly inside the convex hull: no half-space through 0 contains all points.
    If the points span space, such a half-space could be turned until two of them, independent, lie
    on its boundary."""
    spans = any(dot(a, cross(b, c)) != 0 for a, b, c in combinations(points, 3))
    if not spans:
        return False
    for a, b in combinations(points, 2):
        n = cross(a, b)
        if n == ORIGIN:
            continue
        sides = [dot(n, p) for p in points]
        if min(sides) >= 0 or max(sides) <= 0:
            return False
    return True


def squared_distances(points: Sequence[Point]) -> Iterator[Fraction]:
    """Squared distances from 0 to points of the convex hull: the vertices, and the feet of
    perpendiculars on edges and triangles. If 0 is not inside, the nearest point is among them."""
    for p in points:
        yield dot(p, p)
    for p, q in combinations(points, 2):
        e, moment = minus(q, p), cross(p, q)
        if dot(p, e) < 0 < dot(q, e):
            yield dot(moment, moment) / dot(e, e)
    for p, q, r in combinations(points, 3):
        n = cross(minus(q, p), minus(r, p))
        if n == ORIGIN:
            continue
        if all(dot(n, cross(a, b)) >= 0 for a, b in ((p, q), (q, r), (r, p))):
            yield dot(n, p) ** 2 / dot(n, n)
