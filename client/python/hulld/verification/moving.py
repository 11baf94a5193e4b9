"""Checks the certificates of first contacts of motions."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from itertools import combinations

import numpy as np
import numpy.typing as npt

from hulld.answers.collisions import (
    Certificate,
    FirstContact,
    PieceCertificate,
    Relation,
    SeparatedInterval,
)
from hulld.geometry.placements import Placement
from hulld.geometry.poses import Pose
from hulld.verification.error import VerificationError
from hulld.verification.rational import (
    ORIGIN,
    ExactPose,
    Point,
    Quaternion,
    dot,
    exact_point,
    holds_origin,
    minus,
    pose_parts,
    rotation_form,
    sign,
    surrounds_origin,
)
from hulld.verification.resting import (
    STRENGTH,
    Piece,
    check_pair,
    differences_of,
    direction_of,
    gap_along,
)

# Directions and offsets at both ends of an interval, linear in between.
_Plane = tuple[tuple[Point, Fraction], tuple[Point, Fraction]]


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


class MovingPiece:
    """A hull, or a piece of a body, in motion or at rest."""

    def __init__(
        self,
        placement: Placement,
        vertices: npt.NDArray[np.float64],
        piece: Placement | None = None,
    ) -> None:
        self._vertices = vertices
        self._in_any_order = placement.shape is not None
        self.radius = Fraction(placement.radius)
        self._inner: list[ExactPose] = []
        if piece is not None:
            self.radius += Fraction(piece.radius)
            self._inner = [ExactPose.of(Pose() if piece.pose is None else piece.pose)]
        start = pose_parts(placement.pose)
        end = start if placement.end_pose is None else pose_parts(placement.end_pose)
        self._ends = (start, end)

    def is_empty(self) -> bool:
        return len(self._vertices) == 0

    def _parts_at(self, time: Fraction) -> tuple[Quaternion, Point]:
        """The rotation and translation at a time."""
        (q0, x0), (q1, x1) = self._ends
        w, x, y, z = ((1 - time) * p + time * q for p, q in zip(q0, q1))
        tx, ty, tz = ((1 - time) * p + time * q for p, q in zip(x0, x1))
        return (w, x, y, z), (tx, ty, tz)

    def at(self, time: float) -> Piece:
        poses = [*self._inner, ExactPose(*self._parts_at(Fraction(time)))]
        return Piece(self._vertices, poses, self.radius, self._in_any_order)

    def keeps_rotation(self) -> bool:
        """True if one quaternion is a positive multiple of the other."""
        q0, q1 = self._ends[0][0], self._ends[1][0]
        parallel = all(q0[i] * q1[j] == q0[j] * q1[i] for i, j in combinations(range(4), 2))
        return parallel and sum(p * q for p, q in zip(q0, q1)) > 0

    def is_below(self, plane: _Plane, begin: float, until: float, may_end: bool) -> bool:
        """True if n.p + radius |n| < offset for all vertices p over the interval, where the longer
        of the two directions replaces |n|. may_end: allows equality at the end of the interval.
        |q(t)|^2 times the difference is a polynomial in t of degree 4. It is negative if no
        Bernstein coefficient is positive and the outer ones are negative."""
        (q0, x0), (q1, x1) = self._parts_at(Fraction(begin)), self._parts_at(Fraction(until))
        (n0, offset0), (n1, offset1) = plane
        forms = rotation_form(q0, q0), rotation_form(q0, q1), rotation_form(q1, q1)
        norms = [norm for _, norm in forms]
        crossed = (dot(n0, x1) + dot(n1, x0) - offset0 - offset1) / 2
        constants = _product(norms, (dot(n0, x0) - offset0, crossed, dot(n1, x1) - offset1))
        # For each axis of the hull: its dot product with each direction, rotated by each form.
        middle = (n0[0] + n1[0]) / 2, (n0[1] + n1[1]) / 2, (n0[2] + n1[2]) / 2
        directions = [
            [
                [dot(n, (rows[0][k], rows[1][k], rows[2][k])) for n in (n0, middle, n1)]
                for rows, _ in forms
            ]
            for k in range(3)
        ]
        by_axis = [_mixed(table) for table in directions]
        points = [exact_point(vertex) for vertex in self._vertices]
        for pose in self._inner:
            points = [pose(point) for point in points]
        heights = [
            constant + max(sum(d * x for d, x in zip(direction, point)) for point in points)
            for constant, direction in zip(constants, zip(*by_axis))
        ]
        grown = _product(norms, (Fraction(1), Fraction(1), Fraction(1)))
        longest = max(dot(n0, n0), dot(n1, n1))
        signs = [sign(plain, self.radius * more, longest) for plain, more in zip(heights, grown)]
        end_is_right = signs[-1] < 0 or (may_end and signs[-1] == 0)
        return signs[0] < 0 and all(sign <= 0 for sign in signs[1:-1]) and end_is_right


def _gap_sign(n: Point, a: Piece, b: Piece) -> int:
    """The sign of min n.B - max n.A - r |n|, where r is the sum of the radii."""
    return sign(gap_along(n, a, b), -(a.radius + b.radius), dot(n, n))


def _check_interval(
    interval: SeparatedInterval, begin: float, a: MovingPiece, b: MovingPiece, may_end: bool
) -> None:
    n = direction_of(interval.direction)
    if n == ORIGIN:
        raise VerificationError("the direction is zero")
    has_end = interval.end_direction is not None
    if has_end != (interval.end_offset is not None) or (has_end and interval.offset is None):
        raise VerificationError("the end of a plane needs a direction, and offsets at both ends")
    until = interval.until
    if interval.offset is None:
        if not (a.keeps_rotation() and b.keeps_rotation()):
            raise VerificationError("the offset is missing, which is allowed only for translations")
        at_end = _gap_sign(n, a.at(until), b.at(until))
        at_begin = _gap_sign(n, a.at(begin), b.at(begin))
        if at_begin <= 0 or at_end < 0 or (at_end == 0 and not may_end):
            raise VerificationError("the direction does not separate at both ends")
        return
    end_direction = n if interval.end_direction is None else direction_of(interval.end_direction)
    end_offset = interval.offset if interval.end_offset is None else interval.end_offset
    if not (np.isfinite(interval.offset) and np.isfinite(end_offset)):
        raise VerificationError("the offset is not finite")
    if end_direction == ORIGIN:
        raise VerificationError("the direction is zero")
    plane = ((n, Fraction(interval.offset)), (end_direction, Fraction(end_offset)))
    opposite = tuple((minus(ORIGIN, m), -offset) for m, offset in plane)
    if not a.is_below(plane, begin, until, may_end):
        raise VerificationError("A does not stay on its side of the plane")
    if not b.is_below((opposite[0], opposite[1]), begin, until, may_end):
        raise VerificationError("B does not stay on its side of the plane")


def _check_times(relation: Relation, contact: FirstContact, max_time_error: float) -> None:
    until, time = contact.separated_until, contact.contact_time
    if relation == Relation.SEPARATED:
        if until != 1 or time is not None:
            raise VerificationError(
                "the pair is SEPARATED, but separated_until is not 1, or there is a contact_time"
            )
        return
    if time is None or not 0 <= until <= time <= 1:
        raise VerificationError(f"the bracket of the contact is invalid: {until} to {time}")
    widest = Fraction(until) + Fraction(max_time_error)
    if Fraction(time) > widest and time > np.nextafter(until, 2):
        raise VerificationError(f"the bracket {until} to {time} is wider than {max_time_error}")


def _check_contact(
    relation: Relation,
    contact: FirstContact,
    certificate: Certificate | None,
    a: MovingPiece,
    b: MovingPiece,
) -> None:
    """Checks that the pair is in contact at contact_time or, for translations, by that time."""
    if certificate is None or contact.contact_time is None:
        raise VerificationError("the answer has no certificate of the contact")
    places = a.at(contact.contact_time), b.at(contact.contact_time)
    is_rounded = a.radius + b.radius > 0
    if is_rounded or not (a.keeps_rotation() and b.keeps_rotation()):
        check_pair(relation, certificate, *places)
        return
    if certificate.direction is not None:
        check_pair(Relation.TOUCHING, certificate, *places)
        return
    differences = differences_of(certificate, *places)
    if len(differences) <= 6 and surrounds_origin(differences):
        if relation == Relation.TOUCHING:
            raise VerificationError("the hulls overlap; they do not merely touch")
        return
    # All differences of vertices move alike: their hulls at both times span those in between.
    until = contact.separated_until
    differences += differences_of(certificate, a.at(until), b.at(until))
    if len(certificate.pairs) > 4 or not holds_origin(differences):
        raise VerificationError("the vertex pairs show no common point up to contact_time")


def check_first_contact(
    relation: Relation,
    contact: FirstContact | None,
    certificate: Certificate | None,
    a: MovingPiece,
    b: MovingPiece,
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
    intervals: Sequence[SeparatedInterval], contact: FirstContact, a: MovingPiece, b: MovingPiece
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


def check_moving_bodies(
    relation: Relation,
    contact: FirstContact | None,
    proof: Sequence[PieceCertificate],
    a: Sequence[MovingPiece],
    b: Sequence[MovingPiece],
    max_time_error: float,
) -> None:
    """Each pair of pieces needs intervals up to separated_until, and one pair needs the
    contact."""
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
                if one.relation not in STRENGTH:
                    raise VerificationError(f"{one.relation.name} has no certificate")
                _check_contact(one.relation, contact, one.certificate, *pieces)
                if STRENGTH[one.relation] > STRENGTH[shown]:
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
