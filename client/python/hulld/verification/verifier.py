"""Fetches the hulls and bodies of an answer, and checks its certificate."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
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
from hulld.geometry.poses import ORTHOGONALITY_TOLERANCE, PoseLike
from hulld.verification.error import VerificationError
from hulld.verification.moving import MovingPiece, check_first_contact, check_moving_bodies
from hulld.verification.resting import STRENGTH, check_bodies, check_deciding, check_pair

Rows = Union[Batch, Scene, StreamAnswer]
#: Of Wanted.max_time_error in the contract.
DEFAULT_MAX_TIME_ERROR = 2.0**-30
# The version of an inline shape.
_NO_VERSION = HullVersion("", 0, 0, "")


class _Source(Protocol):
    """The methods of a client that a Verifier calls."""

    def get_hull_mesh(self, hull_id: str) -> HullMesh:
        ...

    def get_body(self, body_id: str) -> Body:
        ...


class Verifier:
    """Checks answers with certificates against hulls and bodies, which it fetches through a client
    and caches. Cost: about 0.2 milliseconds for each vertex of each hull or piece in an answer, and
    a few microseconds for each pair of pieces."""

    def __init__(self, client: _Source) -> None:
        self._client = client
        # The latest meshes and bodies, each with its version. The ID of a hull has no body.
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
        relation and, for a motion, the first contact within max_time_error. VerificationError: it
        does not, or cannot be checked."""
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
        """Checks row `row` of a batch, a scene, or a step of a stream that was requested for these
        placements with certificate=True."""
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
        if relation not in STRENGTH:
            raise VerificationError(f"{relation.name} has no certificate")
        if (a.id or "", b.id or "") != (versions[0].hull_id, versions[1].hull_id):
            raise VerificationError("the answer is about different hulls")
        moves = a.end_pose is not None or b.end_pose is not None
        if proof is None:
            if certificate is None and not moves:
                raise VerificationError("the answer has no certificate")
            pair = self._hull(a, versions[0]), self._hull(b, versions[1])
            if moves or certificate is None:
                check_first_contact(relation, contact, certificate, *pair, max_time_error)
            else:
                check_pair(relation, certificate, pair[0].at(0), pair[1].at(0))
            return
        of_a = self._pieces(a, versions[0], piece_hulls)
        of_b = self._pieces(b, versions[1], piece_hulls)
        if moves:
            check_moving_bodies(relation, contact, proof, of_a, of_b, max_time_error)
            shown = [one for one in proof if one.relation != Relation.SEPARATED]
        else:
            resting = [[piece.at(0) for piece in pieces] for pieces in (of_a, of_b)]
            check_bodies(relation, proof, *resting)
            shown = [one for one in proof if one.relation == relation]
        check_deciding(relation, shown, deciding)

    def _hull(self, placement: Placement, version: HullVersion) -> MovingPiece:
        shape = placement.shape
        vertices = self._vertices(version) if shape is None else shape.astype(np.float64)
        return MovingPiece(placement, vertices)

    def _pieces(
        self, placement: Placement, version: HullVersion, piece_hulls: Mapping[str, HullVersion]
    ) -> list[MovingPiece]:
        """The pieces of a body, or the hull itself."""
        body = self._body(version) if placement.shape is None else None
        if body is None:
            return [self._hull(placement, version)]
        pieces = []
        for index in range(len(body.pieces)):
            piece = body.pieces[index]
            if piece.id is None or piece.id not in piece_hulls:
                raise VerificationError(
                    f"piece {index} of body {placement.id} is hull {piece.id}, whose revision "
                    "the answer does not state"
                )
            pieces.append(MovingPiece(placement, self._vertices(piece_hulls[piece.id]), piece))
        return pieces

    def _vertices(self, version: HullVersion) -> npt.NDArray[np.float64]:
        known = self._meshes.get(version.hull_id)
        if known is None or known[0] != version:
            try:
                mesh = self._client.get_hull_mesh(version.hull_id)
            except NotFoundError:
                raise VerificationError(f"hull {version.hull_id} was deleted", moved=True) from None
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
        raise VerificationError("the server's store is not the one that the answer came from")
    if (info.create_revision, info.revision) != (version.create_revision, version.revision):
        raise VerificationError(
            f"{version.hull_id} is at revision {info.revision}; the answer is from revision "
            f"{version.revision}",
            moved=True,
        )
