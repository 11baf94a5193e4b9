"""Checks certificates by exact arithmetic, from vertices and poses alone.

Everything is a rational number (fractions.Fraction), so nothing is rounded: a vertex, a translation
and the components of a quaternion are doubles, and the rotation of a quaternion q is a matrix of
integers in these, divided by |q|^2. The server is trusted only for the hulls and bodies that it
stores, at the revisions that the answer names.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction
from itertools import combinations
from typing import Protocol, Union

import numpy as np
import numpy.typing as npt

from hulld.answers.bodies import Body, BodyInfo
from hulld.answers.collisions import (
    Batch,
    Certificate,
    Collision,
    FirstContact,
    HullVersion,
    PieceCertificate,
    Relation,
    Scene,
    SeparatedInterval,
    StreamAnswer,
)
from hulld.answers.hulls import Header, HullInfo, HullMesh
from hulld.errors import NotFoundError
from hulld.geometry.placements import (
    Placement,
    PlacementLike,
    Placements,
    PlacementsLike,
    as_moving,
)
from hulld.geometry.poses import ORTHOGONALITY_TOLERANCE, Pose, PoseLike, pack_pose

_Point = tuple[Fraction, Fraction, Fraction]
_Quaternion = tuple[Fraction, Fraction, Fraction, Fraction]
_ORIGIN: _Point = (Fraction(0), Fraction(0), Fraction(0))
Rows = Union[Batch, Scene, StreamAnswer]
#: Of Wanted.max_time_error in the contract.
DEFAULT_MAX_TIME_ERROR = 2.0**-30


class VerificationError(Exception):
    """A certificate does not prove the answer, or cannot be checked. moved: the hull or body has
    changed since, or is gone; a new answer may be checked."""

    def __init__(self, reason: str, *, moved: bool = False) -> None:
        super().__init__(reason)
        self.moved = moved


class _Source(Protocol):
    """The methods of a client that a Verifier calls."""

    def get_hull_mesh(self, hull_id: str) -> HullMesh:
        ...

    def get_body(self, body_id: str) -> Body:
        ...


def _dot(a: _Point, b: _Point) -> Fraction:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: _Point, b: _Point) -> _Point:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def _minus(a: _Point, b: _Point) -> _Point:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def _point(numbers: Sequence[float] | npt.NDArray[np.float64]) -> _Point:
    return (Fraction(float(numbers[0])), Fraction(float(numbers[1])), Fraction(float(numbers[2])))


def _parts(pose: PoseLike) -> tuple[_Quaternion, _Point]:
    """The rotation and translation of a pose."""
    w, x, y, z, *translation = (Fraction(float(number)) for number in pack_pose(pose))
    return (w, x, y, z), (translation[0], translation[1], translation[2])


def _form(a: _Quaternion, b: _Quaternion) -> tuple[tuple[_Point, _Point, _Point], Fraction]:
    """R(q) times |q|^2, and |q|^2, if both are q; otherwise these as symmetric bilinear forms."""
    ww, xx, yy, zz = (p * q for p, q in zip(a, b))

    def twice(i: int, j: int) -> Fraction:
        return a[i] * b[j] + a[j] * b[i]

    rows = (
        (ww + xx - yy - zz, twice(1, 2) - twice(0, 3), twice(1, 3) + twice(0, 2)),
        (twice(1, 2) + twice(0, 3), ww - xx + yy - zz, twice(2, 3) - twice(0, 1)),
        (twice(1, 3) - twice(0, 2), twice(2, 3) + twice(0, 1), ww - xx - yy + zz),
    )
    return rows, ww + xx + yy + zz


class _Motion:
    """A pose, exactly."""

    def __init__(self, rotation: _Quaternion, translation: _Point) -> None:
        self._rows, self._norm = _form(rotation, rotation)
        self._translation = translation

    @classmethod
    def of(cls, pose: PoseLike) -> _Motion:
        return cls(*_parts(pose))

    def __call__(self, point: _Point) -> _Point:
        x, y, z = (_dot(row, point) / self._norm for row in self._rows)
        t = self._translation
        return (x + t[0], y + t[1], z + t[2])


class _Piece:
    """A rounded hull where it stands; its vertices are moved when they are needed first. radii:
    their sum is the radius."""

    def __init__(
        self,
        vertices: npt.NDArray[np.float64],
        motions: Sequence[_Motion],
        radii: Sequence[float | Fraction],
        in_any_order: bool = False,
    ) -> None:
        self.radius = sum((Fraction(radius) for radius in radii), Fraction(0))
        self._vertices = vertices
        self._motions = motions
        self._in_any_order = in_any_order
        self._points: list[_Point] | None = None
        self._box: list[tuple[Fraction, Fraction]] | None = None

    @property
    def points(self) -> list[_Point]:
        if self._points is None:
            moved = [_point(vertex) for vertex in self._vertices]
            for motion in self._motions:
                moved = [motion(point) for point in moved]
            self._points = moved
        return self._points

    def moved(self, index: int, vertex: npt.NDArray[np.float64]) -> _Point:
        """The vertex of a certificate, by its index or, among the points of an inline shape, by its
        coordinates."""
        if self._in_any_order:
            places = np.flatnonzero((self._vertices == vertex).all(axis=1))
            if not places.size:
                raise VerificationError("a vertex pair names a point that its shape does not have")
            index = int(places[0])
        if index >= len(self.points):
            raise VerificationError("a vertex pair names a vertex that does not exist")
        if not (self._vertices[index] == vertex).all():
            raise VerificationError(f"a vertex pair gives other coordinates of vertex {index}")
        return self.points[index]

    def box(self) -> list[tuple[Fraction, Fraction]]:
        """The least box along the axes of the world. Requires points."""
        if self._box is None:
            self._box = [
                (
                    min(p[axis] for p in self.points) - self.radius,
                    max(p[axis] for p in self.points) + self.radius,
                )
                for axis in range(3)
            ]
        return self._box


def _holds_origin(points: Sequence[_Point]) -> bool:
    """True if the convex hull of the points holds 0 (Caratheodory: some simplex does)."""
    if any(p == _ORIGIN for p in points):
        return True
    for p, q in combinations(points, 2):
        if _cross(p, q) == _ORIGIN and _dot(p, q) < 0:
            return True
    for p, q, r in combinations(points, 3):
        n = _cross(_minus(q, p), _minus(r, p))
        if n == _ORIGIN or _dot(n, p) != 0:
            continue
        if all(_dot(n, _cross(a, b)) >= 0 for a, b in ((p, q), (q, r), (r, p))):
            return True
    for p, q, r, s in combinations(points, 4):
        # Six volumes each: with 0 in the place of each corner.
        volume = _dot(_minus(q, p), _cross(_minus(r, p), _minus(s, p)))
        parts = (
            _dot(q, _cross(r, s)),
            -_dot(p, _cross(r, s)),
            _dot(p, _cross(q, s)),
            -_dot(p, _cross(q, r)),
        )
        if volume != 0 and all(part * volume >= 0 for part in parts):
            return True
    return False


def _surrounds_origin(points: Sequence[_Point]) -> bool:
    """True if 0 is strictly inside the convex hull: no half-space through 0 holds all points. If
    the points span space, such a half-space could be turned until two of them, independent, lie on
    its boundary."""
    spans = any(_dot(a, _cross(b, c)) != 0 for a, b, c in combinations(points, 3))
    if not spans:
        return False
    for a, b in combinations(points, 2):
        n = _cross(a, b)
        if n == _ORIGIN:
            continue
        sides = [_dot(n, p) for p in points]
        if min(sides) >= 0 or max(sides) <= 0:
            return False
    return True


def _squared_distances(points: Sequence[_Point]) -> Iterator[Fraction]:
    """Squared distances of 0 from points of the convex hull, among them the nearest one if 0 is not
    inside: of vertices, and of the feet of perpendiculars in edges and triangles."""
    for p in points:
        yield _dot(p, p)
    for p, q in combinations(points, 2):
        e, moment = _minus(q, p), _cross(p, q)
        if _dot(p, e) < 0 < _dot(q, e):
            yield _dot(moment, moment) / _dot(e, e)
    for p, q, r in combinations(points, 3):
        n = _cross(_minus(q, p), _minus(r, p))
        if n == _ORIGIN:
            continue
        if all(_dot(n, _cross(a, b)) >= 0 for a, b in ((p, q), (q, r), (r, p))):
            yield _dot(n, p) ** 2 / _dot(n, n)


def _check_gap(relation: Relation, n: _Point, gap: Fraction, radius: Fraction) -> None:
    """Checks the direction of hulls with radii. gap: min n.B - max n.A. radius: their sum."""
    more = gap * gap - radius * radius * _dot(n, n)
    if n == _ORIGIN or gap < 0 or more < 0 or (relation == Relation.SEPARATED and more == 0):
        raise VerificationError("the gap along the direction is too small for the radii")


def _check_nearness(relation: Relation, differences: Sequence[_Point], radius: Fraction) -> None:
    """Checks the vertex pairs of hulls with radii that touch or overlap. radius: their sum, not
    0."""
    is_touching = relation == Relation.TOUCHING
    if len(differences) > (4 if is_touching else 6):
        raise VerificationError("the certificate has too many vertex pairs")
    limit = radius * radius
    is_near = any(
        squared < limit or (squared == limit and is_touching)
        for squared in _squared_distances(differences)
    )
    if not is_near and not _surrounds_origin(differences):
        raise VerificationError("the vertex pairs are too far apart for the radii")


def _direction(given: Sequence[float] | Sequence[int] | None) -> _Point:
    if given is None:
        raise VerificationError("the certificate has no direction")
    try:
        return (Fraction(given[0]), Fraction(given[1]), Fraction(given[2]))
    except (ValueError, OverflowError):
        raise VerificationError("the direction holds a number that is not finite") from None


def _differences(certificate: Certificate, a: _Piece, b: _Piece) -> list[_Point]:
    return [
        _minus(a.moved(pair.index_a, pair.vertex_a), b.moved(pair.index_b, pair.vertex_b))
        for pair in certificate.pairs
    ]


def _gap(n: _Point, a: _Piece, b: _Piece) -> Fraction:
    return min(_dot(n, p) for p in b.points) - max(_dot(n, p) for p in a.points)


def _check(relation: Relation, certificate: Certificate, a: _Piece, b: _Piece) -> None:
    """Checks that the certificate proves the relation of two hulls."""
    differences = _differences(certificate, a, b)
    radius = a.radius + b.radius
    if relation == Relation.OVERLAPPING:
        if radius > 0:
            _check_nearness(relation, differences, radius)
        elif not _surrounds_origin(differences):
            raise VerificationError("the differences of the vertex pairs do not surround 0")
        return
    n = _direction(certificate.direction)
    if not a.points or not b.points:
        raise VerificationError("a hull is empty, and needs no certificate")
    gap = _gap(n, a, b)
    if radius > 0:
        _check_gap(relation, n, gap, radius)
        if relation == Relation.TOUCHING:
            _check_nearness(relation, differences, radius)
        return
    if relation == Relation.SEPARATED:
        if gap <= 0:
            raise VerificationError("the direction does not separate: max n.A >= min n.B")
        return
    if n == _ORIGIN or gap < 0:
        raise VerificationError("the direction does not keep the insides apart: max n.A > min n.B")
    if len(differences) > 4 or not _holds_origin(differences):
        raise VerificationError("the vertex pairs show no common point")


# The version of an inline shape.
_NO_VERSION = HullVersion("", 0, 0, "")
_STRENGTH = {Relation.SEPARATED: 0, Relation.TOUCHING: 1, Relation.OVERLAPPING: 2}


def _settled_by_boxes(a: _Piece, b: _Piece) -> bool:
    if not a.points or not b.points:
        return True
    return any(
        high_a < low_b or high_b < low_a
        for (low_a, high_a), (low_b, high_b) in zip(a.box(), b.box())
    )


def _check_pieces(
    relation: Relation,
    certificates: Sequence[PieceCertificate],
    a: Sequence[_Piece],
    b: Sequence[_Piece],
) -> None:
    proven: dict[tuple[int, int], Relation] = {}
    for one in certificates:
        name = f"pieces {one.piece_a} of A and {one.piece_b} of B"
        if one.piece_a >= len(a) or one.piece_b >= len(b) or (one.piece_a, one.piece_b) in proven:
            raise VerificationError(f"{name} do not exist, or have two certificates")
        if one.relation not in _STRENGTH or _STRENGTH[one.relation] > _STRENGTH[relation]:
            raise VerificationError(f"{name} are {one.relation.name}, the bodies {relation.name}")
        try:
            _check(one.relation, one.certificate, a[one.piece_a], b[one.piece_b])
        except VerificationError as error:
            raise VerificationError(f"{name}: {error}") from None
        proven[one.piece_a, one.piece_b] = one.relation
    if relation != Relation.SEPARATED and relation not in proven.values():
        raise VerificationError(f"no certificate shows that the bodies are {relation.name}")
    if relation == Relation.OVERLAPPING:
        return
    for i, piece_a in enumerate(a):
        for j, piece_b in enumerate(b):
            if (i, j) not in proven and not _settled_by_boxes(piece_a, piece_b):
                raise VerificationError(
                    f"pieces {i} of A and {j} of B have no certificate, and boxes do not settle "
                    "them"
                )


def _check_deciding(
    relation: Relation, shown: Sequence[PieceCertificate], deciding: tuple[int, ...]
) -> None:
    """Checks that the pieces which the answer names are among those shown to be in contact."""
    if relation == Relation.SEPARATED or deciding in [(one.piece_a, one.piece_b) for one in shown]:
        return
    raise VerificationError(
        f"the answer says that pieces {deciding[0]} of A and {deciding[1]} of B decided, but no "
        "certificate shows that"
    )


# Directions and offsets at both ends of an interval, linear in between.
_Plane = tuple[tuple[_Point, Fraction], tuple[_Point, Fraction]]


def _mixed(table: Sequence[Sequence[Fraction]]) -> tuple[Fraction, ...]:
    """The Bernstein coefficients of the product of two quadratic polynomials, from the products of
    their coefficients."""
    return (
        table[0][0],
        (table[0][1] + table[1][0]) / 2,
        (table[0][2] + 4 * table[1][1] + table[2][0]) / 6,
        (table[1][2] + table[2][1]) / 2,
        table[2][2],
    )


def _product(f: Sequence[Fraction], g: Sequence[Fraction]) -> tuple[Fraction, ...]:
    return _mixed([[x * y for y in g] for x in f])


class _MovingPiece:
    """A hull in motion, or a piece of a body in motion."""

    def __init__(
        self,
        placement: Placement,
        vertices: npt.NDArray[np.float64],
        piece: Placement | None = None,
    ) -> None:
        self._vertices = vertices
        self._in_any_order = placement.shape is not None
        self.radius = Fraction(placement.radius)
        self._inner: list[_Motion] = []
        if piece is not None:
            self.radius += Fraction(piece.radius)
            self._inner = [_Motion.of(Pose() if piece.pose is None else piece.pose)]
        end = placement.pose if placement.end_pose is None else placement.end_pose
        self._ends = (_parts(placement.pose), _parts(end))

    def is_empty(self) -> bool:
        return len(self._vertices) == 0

    def _parts_at(self, time: Fraction) -> tuple[_Quaternion, _Point]:
        """The rotation and translation at a time."""
        (q0, x0), (q1, x1) = self._ends
        w, x, y, z = ((1 - time) * p + time * q for p, q in zip(q0, q1))
        tx, ty, tz = ((1 - time) * p + time * q for p, q in zip(x0, x1))
        return (w, x, y, z), (tx, ty, tz)

    def at(self, time: float) -> _Piece:
        motion = _Motion(*self._parts_at(Fraction(time)))
        motions = [*self._inner, motion]
        return _Piece(self._vertices, motions, [self.radius], self._in_any_order)

    def keeps_rotation(self) -> bool:
        """True if one quaternion is a positive multiple of the other."""
        q0, q1 = self._ends[0][0], self._ends[1][0]
        parallel = all(q0[i] * q1[j] == q0[j] * q1[i] for i, j in combinations(range(4), 2))
        return parallel and sum(p * q for p, q in zip(q0, q1)) > 0

    def is_below(self, plane: _Plane, begin: float, until: float, may_end: bool) -> bool:
        """True if n.p + radius |n| < offset for all vertices p over the interval, with the longer
        of both ends for |n|; if may_end, they may be equal at its end. |q(t)|^2 times the
        difference is a polynomial in t of degree 4. It is negative if no Bernstein coefficient is
        positive and the outer ones are negative."""
        (q0, x0), (q1, x1) = self._parts_at(Fraction(begin)), self._parts_at(Fraction(until))
        (n0, offset0), (n1, offset1) = plane
        forms = _form(q0, q0), _form(q0, q1), _form(q1, q1)
        norms = [norm for _, norm in forms]
        crossed = (_dot(n0, x1) + _dot(n1, x0) - offset0 - offset1) / 2
        constants = _product(norms, (_dot(n0, x0) - offset0, crossed, _dot(n1, x1) - offset1))
        # For each axis of the hull: its dot product with each direction, turned by each form.
        middle = (n0[0] + n1[0]) / 2, (n0[1] + n1[1]) / 2, (n0[2] + n1[2]) / 2
        directions = [
            [
                [_dot(n, (rows[0][k], rows[1][k], rows[2][k])) for n in (n0, middle, n1)]
                for rows, _ in forms
            ]
            for k in range(3)
        ]
        by_axis = [_mixed(table) for table in directions]
        points = [_point(vertex) for vertex in self._vertices]
        for motion in self._inner:
            points = [motion(point) for point in points]
        heights = [
            constant + max(sum(d * x for d, x in zip(direction, point)) for point in points)
            for constant, direction in zip(constants, zip(*by_axis))
        ]
        grown = _product(norms, (Fraction(1), Fraction(1), Fraction(1)))
        longest = max(_dot(n0, n0), _dot(n1, n1))
        signs = [_sign(plain, self.radius * more, longest) for plain, more in zip(heights, grown)]
        end_is_right = signs[-1] < 0 or (may_end and signs[-1] == 0)
        return signs[0] < 0 and all(sign <= 0 for sign in signs[1:-1]) and end_is_right


def _sign(a: Fraction, b: Fraction, c: Fraction) -> int:
    """The sign of a + b sqrt(c); c is not negative."""

    def sign(number: Fraction) -> int:
        return (number > 0) - (number < 0)

    if b == 0 or sign(a) == sign(b):
        return sign(a)
    return sign(b) if a == 0 else sign(a) * sign(a * a - b * b * c)


def _gap_sign(n: _Point, a: _Piece, b: _Piece) -> int:
    """The sign of min n.B - max n.A - r |n|, r the sum of the radii."""
    return _sign(_gap(n, a, b), -(a.radius + b.radius), _dot(n, n))


def _check_interval(
    interval: SeparatedInterval, begin: float, a: _MovingPiece, b: _MovingPiece, may_end: bool
) -> None:
    n = _direction(interval.direction)
    if n == _ORIGIN:
        raise VerificationError("the direction is zero")
    has_end = interval.end_direction is not None
    if has_end != (interval.end_offset is not None) or (has_end and interval.offset is None):
        raise VerificationError("the end of a plane needs a direction, and offsets at both ends")
    until = interval.until
    if interval.offset is None:
        if not (a.keeps_rotation() and b.keeps_rotation()):
            raise VerificationError("there is no offset, which only translations do without")
        at_end = _gap_sign(n, a.at(until), b.at(until))
        at_begin = _gap_sign(n, a.at(begin), b.at(begin))
        if at_begin <= 0 or at_end < 0 or (at_end == 0 and not may_end):
            raise VerificationError("the direction does not separate at both ends")
        return
    end_direction = n if interval.end_direction is None else _direction(interval.end_direction)
    end_offset = interval.offset if interval.end_offset is None else interval.end_offset
    if not (np.isfinite(interval.offset) and np.isfinite(end_offset)):
        raise VerificationError("the offset is not finite")
    if end_direction == _ORIGIN:
        raise VerificationError("the direction is zero")
    plane = ((n, Fraction(interval.offset)), (end_direction, Fraction(end_offset)))
    opposite = tuple((_minus(_ORIGIN, m), -offset) for m, offset in plane)
    if not a.is_below(plane, begin, until, may_end):
        raise VerificationError("A does not stay on its side of the plane")
    if not b.is_below((opposite[0], opposite[1]), begin, until, may_end):
        raise VerificationError("B does not stay on its side of the plane")


def _check_times(relation: Relation, contact: FirstContact, max_time_error: float) -> None:
    until, time = contact.separated_until, contact.contact_time
    if relation == Relation.SEPARATED:
        if until != 1 or time is not None:
            raise VerificationError("the pair is SEPARATED, but not until 1, or it has a contact")
        return
    if time is None or not 0 <= until <= time <= 1:
        raise VerificationError(f"the bracket of the contact is {until} to {time}")
    widest = Fraction(until) + Fraction(max_time_error)
    if Fraction(time) > widest and time > np.nextafter(until, 2):
        raise VerificationError(f"the bracket {until} to {time} is wider than {max_time_error}")


def _check_contact(
    relation: Relation,
    contact: FirstContact,
    certificate: Certificate | None,
    a: _MovingPiece,
    b: _MovingPiece,
) -> None:
    """Checks that the pair is in contact at contact_time, or, for translations, by then."""
    if certificate is None or contact.contact_time is None:
        raise VerificationError("the answer has no certificate of the contact")
    places = a.at(contact.contact_time), b.at(contact.contact_time)
    is_rounded = a.radius + b.radius > 0
    if is_rounded or not (a.keeps_rotation() and b.keeps_rotation()):
        _check(relation, certificate, *places)
        return
    if certificate.direction is not None:
        _check(Relation.TOUCHING, certificate, *places)
        return
    differences = _differences(certificate, *places)
    if len(differences) <= 6 and _surrounds_origin(differences):
        if relation == Relation.TOUCHING:
            raise VerificationError("the hulls overlap, so they do not only touch")
        return
    # All differences of vertices move alike: their hulls at both times span those in between.
    until = contact.separated_until
    differences += _differences(certificate, a.at(until), b.at(until))
    if len(certificate.pairs) > 4 or not _holds_origin(differences):
        raise VerificationError("the vertex pairs show no common point up to contact_time")


def _check_first_contact(
    relation: Relation,
    contact: FirstContact | None,
    certificate: Certificate | None,
    a: _MovingPiece,
    b: _MovingPiece,
    max_time_error: float,
) -> None:
    if contact is None:
        raise VerificationError("the answer is about a motion, but has no first contact")
    _check_times(relation, contact, max_time_error)
    if a.is_empty() or b.is_empty():
        if relation != Relation.SEPARATED:
            raise VerificationError("a hull is empty, and so separated from everything")
        return
    _check_intervals(contact.intervals, contact, a, b)
    if relation != Relation.SEPARATED:
        _check_contact(relation, contact, certificate, a, b)


def _check_intervals(
    intervals: Sequence[SeparatedInterval], contact: FirstContact, a: _MovingPiece, b: _MovingPiece
) -> None:
    begin = 0.0
    meets = contact.contact_time is not None
    for index, interval in enumerate(intervals):
        if not begin < interval.until <= contact.separated_until:
            raise VerificationError(f"interval {index} ends at {interval.until}")
        may_end = meets and interval.until == contact.separated_until
        try:
            _check_interval(interval, begin, a, b, may_end)
        except VerificationError as error:
            raise VerificationError(f"interval {index}: {error}") from None
        begin = interval.until
    if begin != contact.separated_until:
        raise VerificationError(f"the intervals end at {begin}, before separated_until")


def _check_moving_pieces(
    relation: Relation,
    contact: FirstContact | None,
    proof: Sequence[PieceCertificate],
    a: Sequence[_MovingPiece],
    b: Sequence[_MovingPiece],
    max_time_error: float,
) -> None:
    """Each pair of pieces needs intervals up to separated_until, and one of them the contact."""
    if contact is None:
        raise VerificationError("the answer is about a motion, but has no first contact")
    _check_times(relation, contact, max_time_error)
    proven = set()
    shown = Relation.SEPARATED
    for one in proof:
        pair = (one.piece_a, one.piece_b)
        name = f"pieces {one.piece_a} of A and {one.piece_b} of B"
        if one.piece_a >= len(a) or one.piece_b >= len(b) or pair in proven:
            raise VerificationError(f"{name} do not exist, or have two certificates")
        proven.add(pair)
        pieces = a[one.piece_a], b[one.piece_b]
        if pieces[0].is_empty() or pieces[1].is_empty():
            raise VerificationError(f"{name}: a hull is empty")
        try:
            _check_intervals(one.intervals, contact, *pieces)
            if one.relation != Relation.SEPARATED:
                if one.relation not in _STRENGTH:
                    raise VerificationError(f"{one.relation.name} has no certificate")
                _check_contact(one.relation, contact, one.certificate, *pieces)
                if _STRENGTH[one.relation] > _STRENGTH[shown]:
                    shown = one.relation
        except VerificationError as error:
            raise VerificationError(f"{name}: {error}") from None
    # A translation that touches first may overlap later, which no certificate shows.
    may_overlap = (relation, shown) == (Relation.OVERLAPPING, Relation.TOUCHING) and all(
        piece.radius == 0 and piece.keeps_rotation() for piece in (*a, *b)
    )
    if shown != relation and not may_overlap:
        raise VerificationError(f"the certificates show {shown.name}, not {relation.name}")
    if contact.separated_until == 0:
        return
    for i, piece_a in enumerate(a):
        for j, piece_b in enumerate(b):
            if (i, j) not in proven and not (piece_a.is_empty() or piece_b.is_empty()):
                raise VerificationError(f"pieces {i} of A and {j} of B have no certificate")


class Verifier:
    """Checks answers with certificates against hulls and bodies, which a client fetches and keeps.
    Cost: about 0.2 milliseconds for each vertex of each hull or piece that is placed, and some
    microseconds for each pair of pieces."""

    def __init__(self, client: _Source) -> None:
        self._client = client
        # The latest ones, each with its version; for the ID of a hull, no body.
        self._meshes: dict[str, tuple[HullVersion, npt.NDArray[np.float64]]] = {}
        self._bodies: dict[str, tuple[HullVersion, Body | None]] = {}

    def check(
        self,
        a: PlacementLike,
        b: PlacementLike,
        answer: Collision,
        *,
        to_a: PoseLike = None,
        to_b: PoseLike = None,
        max_time_error: float = DEFAULT_MAX_TIME_ERROR,
        orthogonality_tolerance: float = ORTHOGONALITY_TOLERANCE,
    ) -> None:
        """Checks that the certificate of check_collision(a, b, certificate=True) proves its
        relation; of a motion, also when the pair meets first, within max_time_error.
        VerificationError: it does not, or cannot be checked."""
        pair = Placements.of(
            [as_moving(a, to_a), as_moving(b, to_b)],
            orthogonality_tolerance=orthogonality_tolerance,
        )
        self._check(
            pair[0],
            pair[1],
            answer.relation,
            answer.certificate,
            (answer.hull_a, answer.hull_b),
            answer.piece_certificates if answer.piece_hulls else None,
            answer.piece_hulls,
            answer.first_contact,
            max_time_error,
            (
                0 if answer.piece_a is None else answer.piece_a.index,
                0 if answer.piece_b is None else answer.piece_b.index,
            ),
        )

    def check_row(
        self,
        placements: PlacementsLike,
        found: Rows,
        row: int,
        *,
        max_time_error: float = DEFAULT_MAX_TIME_ERROR,
        orthogonality_tolerance: float = ORTHOGONALITY_TOLERANCE,
    ) -> None:
        """Checks row `row` of a batch, a scene, or a step of a stream about these placements with
        certificate=True."""
        packed = Placements.of(placements, orthogonality_tolerance=orthogonality_tolerance)
        a, b = (packed[int(index)] for index in found.pairs[row])
        answers = found.answers
        versions = [
            found.hulls.get(one.id) if one.id is not None else _NO_VERSION for one in (a, b)
        ]
        if versions[0] is None or versions[1] is None:
            if int(answers.relations[row]) == 0:
                raise VerificationError("the row has no answer")
            raise VerificationError(
                "this step names no revisions; check the first one, or one that refreshes hulls"
            )
        self._check(
            a,
            b,
            Relation(int(answers.relations[row])),
            answers.certificates[row] if answers.certificates else None,
            (versions[0], versions[1]),
            answers.piece_proofs.get(row),
            found.piece_hulls,
            answers[row].first_contact,
            max_time_error,
            # -1 for a hull.
            (0, 0) if answers.pieces is None else tuple(answers.pieces[row].clip(0).tolist()),
        )

    def _check(
        self,
        a: Placement,
        b: Placement,
        relation: Relation,
        certificate: Certificate | None,
        versions: tuple[HullVersion, HullVersion],
        proof: Sequence[PieceCertificate] | None,
        piece_hulls: Mapping[str, HullVersion],
        contact: FirstContact | None,
        max_time_error: float,
        deciding: tuple[int, ...],
    ) -> None:
        if relation not in _STRENGTH:
            raise VerificationError(f"{relation.name} has no certificate")
        if (a.id or "", b.id or "") != (versions[0].hull_id, versions[1].hull_id):
            raise VerificationError("the answer is about different hulls")
        if a.end_pose is not None or b.end_pose is not None:
            if proof is not None:
                of_a = self._moving_pieces(a, versions[0], piece_hulls)
                of_b = self._moving_pieces(b, versions[1], piece_hulls)
                _check_moving_pieces(relation, contact, proof, of_a, of_b, max_time_error)
                shown = [one for one in proof if one.relation != Relation.SEPARATED]
                _check_deciding(relation, shown, deciding)
                return
            moving = (self._moving(a, versions[0]), self._moving(b, versions[1]))
            _check_first_contact(relation, contact, certificate, *moving, max_time_error)
            return
        if proof is None:
            if certificate is None:
                raise VerificationError("the answer has no certificate")
            _check(relation, certificate, self._hull(a, versions[0]), self._hull(b, versions[1]))
            return
        _check_pieces(
            relation,
            proof,
            self._pieces(a, versions[0], piece_hulls),
            self._pieces(b, versions[1], piece_hulls),
        )
        _check_deciding(relation, [one for one in proof if one.relation == relation], deciding)

    def _points(self, placement: Placement, version: HullVersion) -> npt.NDArray[np.float64]:
        if placement.shape is None:
            return self._vertices(version)
        return placement.shape.astype(np.float64)

    def _hull(self, placement: Placement, version: HullVersion) -> _Piece:
        motions = [_Motion.of(placement.pose)]
        in_any_order = placement.shape is not None
        return _Piece(self._points(placement, version), motions, [placement.radius], in_any_order)

    def _moving(self, placement: Placement, version: HullVersion) -> _MovingPiece:
        return _MovingPiece(placement, self._points(placement, version))

    def _pieces(
        self, placement: Placement, version: HullVersion, piece_hulls: Mapping[str, HullVersion]
    ) -> list[_Piece]:
        body = self._body(version) if placement.shape is None else None
        if body is None:
            return [self._hull(placement, version)]
        pieces = []
        outer = _Motion.of(placement.pose)
        for piece, vertices in self._parts(placement, body, piece_hulls):
            inner = _Motion.of(Pose() if piece.pose is None else piece.pose)
            pieces.append(_Piece(vertices, [inner, outer], [placement.radius, piece.radius]))
        return pieces

    def _moving_pieces(
        self, placement: Placement, version: HullVersion, piece_hulls: Mapping[str, HullVersion]
    ) -> list[_MovingPiece]:
        body = self._body(version) if placement.shape is None else None
        if body is None:
            return [self._moving(placement, version)]
        parts = self._parts(placement, body, piece_hulls)
        return [_MovingPiece(placement, vertices, piece) for piece, vertices in parts]

    def _parts(
        self, placement: Placement, body: Body, piece_hulls: Mapping[str, HullVersion]
    ) -> Iterator[tuple[Placement, npt.NDArray[np.float64]]]:
        """The pieces of a body and their vertices."""
        for index in range(len(body.pieces)):
            piece = body.pieces[index]
            if piece.id is None or piece.id not in piece_hulls:
                raise VerificationError(
                    f"piece {index} of body {placement.id} is hull {piece.id}, whose revision "
                    "the answer does not state"
                )
            yield piece, self._vertices(piece_hulls[piece.id])

    def _vertices(self, version: HullVersion) -> npt.NDArray[np.float64]:
        known = self._meshes.get(version.hull_id)
        if known is None or known[0] != version:
            try:
                mesh = self._client.get_hull_mesh(version.hull_id)
            except NotFoundError:
                raise VerificationError(f"hull {version.hull_id} is gone", moved=True) from None
            _expect(version, mesh.info, mesh.header)
            known = self._meshes[version.hull_id] = (version, mesh.vertices)
        return known[1]

    def _body(self, version: HullVersion) -> Body | None:
        """None: a hull has the ID."""
        known = self._bodies.get(version.hull_id)
        if known is None or known[0] != version:
            try:
                body = self._client.get_body(version.hull_id)
                _expect(version, body.info, body.header)
            except NotFoundError:
                body = None
            known = self._bodies[version.hull_id] = (version, body)
        return known[1]


def _expect(version: HullVersion, info: HullInfo | BodyInfo, header: Header) -> None:
    """Checks that a hull or body is still at the version of an answer."""
    if header.store_id != version.store_id:
        raise VerificationError("the server's store differs from the answer's")
    if (info.create_revision, info.revision) != (version.create_revision, version.revision):
        raise VerificationError(
            f"{version.hull_id} is at revision {info.revision}; the answer is from revision "
            f"{version.revision}",
            moved=True,
        )
