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

from hulld.answers.bodies import Body
from hulld.answers.collisions import (
    Batch,
    Certificate,
    Collision,
    HullVersion,
    PieceCertificate,
    Relation,
    Scene,
    StreamAnswer,
)
from hulld.answers.hulls import HullMesh
from hulld.errors import NotFoundError
from hulld.geometry.placements import Placement, PlacementLike, Placements, PlacementsLike
from hulld.geometry.poses import ORTHOGONALITY_TOLERANCE, Pose, PoseLike, pack_pose

_Point = tuple[Fraction, Fraction, Fraction]
_ORIGIN: _Point = (Fraction(0), Fraction(0), Fraction(0))
Rows = Union[Batch, Scene, StreamAnswer]


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


class _Motion:
    """A pose, exactly."""

    def __init__(self, pose: PoseLike) -> None:
        numbers = [Fraction(float(number)) for number in pack_pose(pose)]
        w, x, y, z = numbers[:4]
        norm = w * w + x * x + y * y + z * z
        self._rows = (
            ((w * w + x * x - y * y - z * z) / norm, 2 * (x * y - w * z) / norm,
             2 * (x * z + w * y) / norm),
            (2 * (x * y + w * z) / norm, (w * w - x * x + y * y - z * z) / norm,
             2 * (y * z - w * x) / norm),
            (2 * (x * z - w * y) / norm, 2 * (y * z + w * x) / norm,
             (w * w - x * x - y * y + z * z) / norm),
        )  # fmt: skip
        self._translation = (numbers[4], numbers[5], numbers[6])

    def __call__(self, point: _Point) -> _Point:
        x, y, z = (_dot(row, point) for row in self._rows)
        t = self._translation
        return (x + t[0], y + t[1], z + t[2])


class _Piece:
    """A rounded hull where it stands; its vertices are moved when they are needed first. radii:
    their sum is the radius."""

    def __init__(
        self,
        vertices: npt.NDArray[np.float64],
        motions: Sequence[_Motion],
        radii: Sequence[float],
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
    """True if the convex hull of at most four points holds 0 (Caratheodory: some simplex does)."""
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


def _check(relation: Relation, certificate: Certificate, a: _Piece, b: _Piece) -> None:
    """Checks that the certificate proves the relation of two hulls."""
    differences = []
    for pair in certificate.pairs:
        differences.append(
            _minus(a.moved(pair.index_a, pair.vertex_a), b.moved(pair.index_b, pair.vertex_b))
        )
    radius = a.radius + b.radius
    if relation == Relation.OVERLAPPING:
        if radius > 0:
            _check_nearness(relation, differences, radius)
        elif not _surrounds_origin(differences):
            raise VerificationError("the differences of the vertex pairs do not surround 0")
        return
    if certificate.direction is None:
        raise VerificationError("the certificate has no direction")
    n = (
        Fraction(certificate.direction[0]),
        Fraction(certificate.direction[1]),
        Fraction(certificate.direction[2]),
    )
    if not a.points or not b.points:
        raise VerificationError("a hull is empty, and needs no certificate")
    gap = min(_dot(n, p) for p in b.points) - max(_dot(n, p) for p in a.points)
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
        if one.piece_a >= len(a) or one.piece_b >= len(b):
            raise VerificationError(f"{name} do not exist")
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


class Verifier:
    """Checks answers with certificates against hulls and bodies, which a client fetches and keeps.
    Cost: about 0.2 milliseconds for each vertex of each hull or piece that is placed, and some
    microseconds for each pair of pieces."""

    def __init__(self, client: _Source) -> None:
        self._client = client
        self._meshes: dict[str, HullMesh] = {}
        self._bodies: dict[str, Body | None] = {}

    def check(
        self,
        a: PlacementLike,
        b: PlacementLike,
        answer: Collision,
        *,
        orthogonality_tolerance: float = ORTHOGONALITY_TOLERANCE,
    ) -> None:
        """Checks that the certificate of check_collision(a, b, certificate=True) proves its
        relation. VerificationError: it does not, or cannot be checked."""
        pair = Placements.of([a, b], orthogonality_tolerance=orthogonality_tolerance)
        self._check(
            pair[0],
            pair[1],
            answer.relation,
            answer.certificate,
            (answer.hull_a, answer.hull_b),
            answer.piece_certificates if answer.piece_hulls else None,
            answer.piece_hulls,
        )

    def check_row(
        self,
        placements: PlacementsLike,
        found: Rows,
        row: int,
        *,
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
    ) -> None:
        if relation not in _STRENGTH:
            raise VerificationError(f"{relation.name} has no certificate")
        if (a.id or "", b.id or "") != (versions[0].hull_id, versions[1].hull_id):
            raise VerificationError("the answer is about different hulls")
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

    def _hull(self, placement: Placement, version: HullVersion) -> _Piece:
        motions = [_Motion(placement.pose)]
        radii = [placement.radius]
        if placement.shape is None:
            return _Piece(self._vertices(version), motions, radii)
        return _Piece(placement.shape.astype(np.float64), motions, radii, in_any_order=True)

    def _pieces(
        self, placement: Placement, version: HullVersion, piece_hulls: Mapping[str, HullVersion]
    ) -> list[_Piece]:
        body = self._body(version) if placement.shape is None else None
        if body is None:
            return [self._hull(placement, version)]
        pieces = []
        outer = _Motion(placement.pose)
        for index in range(len(body.pieces)):
            piece = body.pieces[index]
            if piece.id is None or piece.id not in piece_hulls:
                raise VerificationError(
                    f"piece {index} of body {placement.id} is hull {piece.id}, whose revision "
                    "the answer does not state"
                )
            inner = _Motion(Pose() if piece.pose is None else piece.pose)
            vertices = self._vertices(piece_hulls[piece.id])
            pieces.append(_Piece(vertices, [inner, outer], [placement.radius, piece.radius]))
        return pieces

    def _vertices(self, version: HullVersion) -> npt.NDArray[np.float64]:
        if version.hull_id not in self._meshes:
            try:
                self._meshes[version.hull_id] = self._client.get_hull_mesh(version.hull_id)
            except NotFoundError:
                raise VerificationError(f"hull {version.hull_id} is gone", moved=True) from None
        mesh = self._meshes[version.hull_id]
        self._expect(version, mesh.info.create_revision, mesh.info.revision, mesh.header.store_id)
        return mesh.vertices

    def _body(self, version: HullVersion) -> Body | None:
        if version.hull_id not in self._bodies:
            try:
                self._bodies[version.hull_id] = self._client.get_body(version.hull_id)
            except NotFoundError:
                self._bodies[version.hull_id] = None
        body = self._bodies[version.hull_id]
        if body is not None:
            self._expect(
                version, body.info.create_revision, body.info.revision, body.header.store_id
            )
        return body

    def _expect(self, version: HullVersion, created: int, revision: int, store_id: str) -> None:
        if store_id != version.store_id:
            raise VerificationError("the server's store differs from the answer's")
        if (created, revision) == (version.create_revision, version.revision):
            return
        # A newer answer may be about the current body.
        self._meshes.pop(version.hull_id, None)
        self._bodies.pop(version.hull_id, None)
        raise VerificationError(
            f"{version.hull_id} is at revision {revision}; the answer is from revision "
            f"{version.revision}",
            moved=True,
        )
