"""Checks the certificates of pairs at rest."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

import numpy as np
import numpy.typing as npt

from hulld.answers.collisions import Certificate, PieceCertificate, Relation
from hulld.verification.error import VerificationError
from hulld.verification.rational import (
    ORIGIN,
    ExactPose,
    Point,
    dot,
    exact_point,
    holds_origin,
    minus,
    squared_distances,
    surrounds_origin,
)

#: The strength of a relation's claim.
STRENGTH = {Relation.SEPARATED: 0, Relation.TOUCHING: 1, Relation.OVERLAPPING: 2}


class Piece:
    """A rounded hull at its pose. Its vertices are transformed on first use."""

    def __init__(
        self,
        vertices: npt.NDArray[np.float64],
        poses: Sequence[ExactPose],
        radius: Fraction,
        in_any_order: bool = False,
    ) -> None:
        self.radius = radius
        self._vertices = vertices
        self._poses = poses
        self._in_any_order = in_any_order
        self._points: list[Point] | None = None
        self._box: list[tuple[Fraction, Fraction]] | None = None

    @property
    def points(self) -> list[Point]:
        if self._points is None:
            moved = [exact_point(vertex) for vertex in self._vertices]
            for pose in self._poses:
                moved = [pose(point) for point in moved]
            self._points = moved
        return self._points

    def moved(self, index: int, vertex: npt.NDArray[np.float64]) -> Point:
        """The vertex of a certificate, by its index or, among the points of an inline shape, by its
        coordinates."""
        if self._in_any_order:
            places = np.flatnonzero((self._vertices == vertex).all(axis=1))
            if not places.size:
                raise VerificationError(
                    "a vertex pair refers to a point that does not exist in its shape"
                )
            index = int(places[0])
        if index >= len(self.points):
            raise VerificationError("a vertex pair refers to a vertex that does not exist")
        if not (self._vertices[index] == vertex).all():
            raise VerificationError(
                f"a vertex pair does not have the coordinates of vertex {index}"
            )
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


def _check_gap(relation: Relation, n: Point, gap: Fraction, radius: Fraction) -> None:
    """Checks the direction of hulls with radii. gap: min n.B - max n.A. radius: their sum."""
    more = gap * gap - radius * radius * dot(n, n)
    if n == ORIGIN or gap < 0 or more < 0 or (relation == Relation.SEPARATED and more == 0):
        raise VerificationError("the gap along the direction is too small for the radii")


def _check_nearness(relation: Relation, differences: Sequence[Point], radius: Fraction) -> None:
    """Checks the vertex pairs of hulls with radii that touch or overlap. radius: their sum, not
    0."""
    is_touching = relation == Relation.TOUCHING
    if len(differences) > (4 if is_touching else 6):
        raise VerificationError("the certificate has too many vertex pairs")
    limit = radius * radius
    is_near = any(
        squared < limit or (squared == limit and is_touching)
        for squared in squared_distances(differences)
    )
    if not is_near and not surrounds_origin(differences):
        raise VerificationError("the vertex pairs are too far apart for the radii")


def direction_of(given: Sequence[float] | Sequence[int] | None) -> Point:
    if given is None:
        raise VerificationError("the certificate has no direction")
    try:
        return (Fraction(given[0]), Fraction(given[1]), Fraction(given[2]))
    except (ValueError, OverflowError):
        raise VerificationError("the direction contains a number that is not finite") from None


def differences_of(certificate: Certificate, a: Piece, b: Piece) -> list[Point]:
    return [
        minus(a.moved(pair.index_a, pair.vertex_a), b.moved(pair.index_b, pair.vertex_b))
        for pair in certificate.pairs
    ]


def gap_along(n: Point, a: Piece, b: Piece) -> Fraction:
    return min(dot(n, p) for p in b.points) - max(dot(n, p) for p in a.points)


def check_pair(relation: Relation, certificate: Certificate, a: Piece, b: Piece) -> None:
    """Checks that the certificate proves the relation of two hulls."""
    differences = differences_of(certificate, a, b)
    radius = a.radius + b.radius
    if relation == Relation.OVERLAPPING:
        if radius > 0:
            _check_nearness(relation, differences, radius)
        elif not surrounds_origin(differences):
            raise VerificationError("the differences of the vertex pairs do not surround 0")
        return
    n = direction_of(certificate.direction)
    if not a.points or not b.points:
        raise VerificationError("a hull is empty, and needs no certificate")
    gap = gap_along(n, a, b)
    if radius > 0:
        _check_gap(relation, n, gap, radius)
        if relation == Relation.TOUCHING:
            _check_nearness(relation, differences, radius)
        return
    if relation == Relation.SEPARATED:
        if gap <= 0:
            raise VerificationError("the direction does not separate: max n.A >= min n.B")
        return
    if n == ORIGIN or gap < 0:
        raise VerificationError("the direction does not separate the interiors: max n.A > min n.B")
    if len(differences) > 4 or not holds_origin(differences):
        raise VerificationError("the vertex pairs show no common point")


def _settled_by_boxes(a: Piece, b: Piece) -> bool:
    if not a.points or not b.points:
        return True
    return any(
        high_a < low_b or high_b < low_a
        for (low_a, high_a), (low_b, high_b) in zip(a.box(), b.box())
    )


def check_bodies(
    relation: Relation,
    certificates: Sequence[PieceCertificate],
    a: Sequence[Piece],
    b: Sequence[Piece],
) -> None:
    proven: dict[tuple[int, int], Relation] = {}
    for one in certificates:
        name = f"pieces {one.piece_a} of A and {one.piece_b} of B"
        if one.piece_a >= len(a) or one.piece_b >= len(b) or (one.piece_a, one.piece_b) in proven:
            raise VerificationError(f"{name} do not exist, or have two certificates")
        if one.relation not in STRENGTH or STRENGTH[one.relation] > STRENGTH[relation]:
            raise VerificationError(
                f"{name} are {one.relation.name}, but the bodies are {relation.name}"
            )
        try:
            check_pair(one.relation, one.certificate, a[one.piece_a], b[one.piece_b])
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


def check_deciding(
    relation: Relation, shown: Sequence[PieceCertificate], deciding: tuple[int, ...]
) -> None:
    """Checks that the pieces that the answer names are among those shown to be in contact."""
    if relation == Relation.SEPARATED or deciding in [(one.piece_a, one.piece_b) for one in shown]:
        return
    raise VerificationError(
        f"the answer says that pieces {deciding[0]} of A and {deciding[1]} of B decided, but no "
        "certificate shows that"
    )
