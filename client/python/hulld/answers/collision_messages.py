"""Reads the contract's messages about pairs. The columns of many answers are read from the wire,
array by array."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from hulld.answers.collisions import (
    Analysis,
    Answers,
    Axis,
    AxisKind,
    BatchPart,
    Certificate,
    Collision,
    CollisionChanges,
    CollisionEvent,
    CollisionEventKind,
    DecidingPiece,
    Feature,
    FirstContact,
    HullSize,
    HullVersion,
    Normal,
    PieceCertificate,
    Problem,
    Relation,
    Rung,
    ScenePart,
    SceneTotals,
    SeparatedInterval,
    Separation,
    VertexPair,
    Witness,
)
from hulld.answers.hulls import Header, enum_or_zero, header_of
from hulld.calls.wanted import Wanted
from hulld.errors import status_name
from hulld.geometry.placements import Placements
from hulld.notebook import Viewer
from hulld.v1 import collision_pb2, error_pb2, geometry_pb2
from hulld.wire import Unsigned, packed_doubles, packed_varints, read_fields

T = TypeVar("T")


def _vector(message: Any) -> npt.NDArray[np.float64]:
    return np.array([message.x, message.y, message.z])


def version_of(message: Any) -> HullVersion:
    return HullVersion(message.hull_id, message.create_revision, message.revision, message.store_id)


def _piece_of(message: Any) -> DecidingPiece:
    return DecidingPiece(message.index, version_of(message.hull))


def _problem_of(message: Any) -> Problem:
    reason = None
    # A reason from a later version of the contract has no name here.
    if message.reason and message.reason in error_pb2.ErrorReason.values():
        reason = error_pb2.ErrorReason.Name(message.reason).removeprefix("ERROR_REASON_")
    return Problem(status_name(message.code), message.message, reason)


def _feature_of(message: Any) -> Feature:
    return Feature(
        np.array(message.vertex_indices, np.uint32),
        np.array(message.xyz).reshape(-1, 3),
        message.facet_index if message.HasField("facet_index") else None,
    )


def _axis_of(message: Any) -> Axis:
    return Axis(
        _vector(message.direction),
        enum_or_zero(AxisKind, message.kind),
        _feature_of(message.feature_a),
        _feature_of(message.feature_b),
    )


def _triple(message: Any) -> tuple[float, float, float]:
    return (message.x, message.y, message.z)


def _direction_of(message: Any) -> tuple[float, float, float] | tuple[int, int, int] | None:
    kind = message.WhichOneof("exact_direction")
    if kind == "direction":
        return _triple(message.direction)
    if kind == "integer_direction":
        m = message.integer_direction
        return (int(m.x), int(m.y), int(m.z))
    return None


def _certificate_of(message: Any) -> Certificate:
    pairs = tuple(
        VertexPair(pair.index_a, pair.index_b, _vector(pair.vertex_a), _vector(pair.vertex_b))
        for pair in message.pairs
    )
    return Certificate(_direction_of(message), pairs)


def _intervals_of(messages: Iterable[Any]) -> tuple[SeparatedInterval, ...]:
    return tuple(
        SeparatedInterval(
            message.until,
            _direction_of(message),
            message.offset if message.HasField("offset") else None,
            _triple(message.end_direction) if message.HasField("end_direction") else None,
            message.end_offset if message.HasField("end_offset") else None,
        )
        for message in messages
    )


def _contact_of(message: Any) -> FirstContact:
    return FirstContact(
        message.separated_until,
        message.contact_time if message.HasField("contact_time") else None,
        _intervals_of(message.intervals),
    )


def _piece_certificates_of(messages: Iterable[Any]) -> tuple[PieceCertificate, ...]:
    return tuple(
        PieceCertificate(
            message.piece_a,
            message.piece_b,
            enum_or_zero(Relation, message.relation),
            _certificate_of(message.certificate),
            _intervals_of(message.intervals),
        )
        for message in messages
    )


def _analysis_of(message: Any) -> Analysis:
    def size(part: Any) -> HullSize:
        return HullSize(part.vertices, part.edges, part.facets)

    return Analysis(
        message.time.seconds + message.time.nanos * 1e-9,
        size(message.size_a),
        size(message.size_b),
        message.axes_tested,
        message.axes_total,
        enum_or_zero(AxisKind, message.stage),
        message.axis_index if message.HasField("axis_index") else None,
    )


def decode_collision(data: bytes, query: Placements, viewer: Viewer | None) -> Collision:
    message = collision_pb2.CheckCollisionResponse.FromString(data)

    def part(name: str, read: Callable[[Any], T]) -> T | None:
        return read(getattr(message, name)) if message.HasField(name) else None

    return Collision(
        enum_or_zero(Relation, message.relation),
        enum_or_zero(Rung, message.rung),
        version_of(message.hull_a),
        version_of(message.hull_b),
        part("axis", _axis_of),
        part("analysis", _analysis_of),
        part("certificate", _certificate_of),
        part("separation", lambda m: Separation(m.value, m.bound)),
        part("witness", lambda m: Witness(_vector(m.point_a), _vector(m.point_b), m.error)),
        message.within_clearance if message.HasField("within_clearance") else None,
        header_of(message.header),
        part("piece_a", _piece_of),
        part("piece_b", _piece_of),
        _piece_certificates_of(message.piece_certificates),
        {hull.hull_id: version_of(hull) for hull in message.piece_hulls},
        part("normal", lambda m: Normal(_vector(m.direction), m.angle_bound)),
        part("first_contact", _contact_of),
        query,
        viewer,
    )


# --- Columns ---


@dataclass
class ColumnReader:
    """Collects the columns of messages into answers."""

    wanted: Wanted
    relations: list[Unsigned] = field(default_factory=list)
    rungs: list[Unsigned] = field(default_factory=list)
    axes: list[Axis | None] = field(default_factory=list)
    analyses: list[Analysis | None] = field(default_factory=list)
    certificates: list[Certificate | None] = field(default_factory=list)
    separations: list[npt.NDArray[np.float64]] = field(default_factory=list)
    separation_bounds: list[npt.NDArray[np.float64]] = field(default_factory=list)
    witness_xyz: list[npt.NDArray[np.float64]] = field(default_factory=list)
    witness_errors: list[npt.NDArray[np.float64]] = field(default_factory=list)
    normal_xyz: list[npt.NDArray[np.float64]] = field(default_factory=list)
    normal_angle_bounds: list[npt.NDArray[np.float64]] = field(default_factory=list)
    within_clearance: list[Unsigned] = field(default_factory=list)
    pieces: list[Unsigned] = field(default_factory=list)
    problems: dict[int, Problem] = field(default_factory=dict)
    piece_proofs: dict[int, tuple[PieceCertificate, ...]] = field(default_factory=dict)
    separated_until: list[npt.NDArray[np.float64]] = field(default_factory=list)
    contact_times: list[npt.NDArray[np.float64]] = field(default_factory=list)
    motion_proofs: dict[int, tuple[SeparatedInterval, ...]] = field(default_factory=dict)
    rows: int = 0

    def read(self, data: memoryview) -> None:
        """Adds the rows of an AnswerColumns message. ValueError: it is malformed."""
        first = self.rows
        arrays: dict[int, tuple[list[Any], Callable[[Any], npt.NDArray[Any]]]] = {
            1: (self.relations, packed_varints),
            2: (self.rungs, packed_varints),
            6: (self.separations, packed_doubles),
            7: (self.separation_bounds, packed_doubles),
            8: (self.witness_xyz, packed_doubles),
            9: (self.witness_errors, packed_doubles),
            10: (self.within_clearance, packed_varints),
            12: (self.pieces, packed_varints),
            14: (self.normal_xyz, packed_doubles),
            15: (self.normal_angle_bounds, packed_doubles),
            16: (self.separated_until, packed_doubles),
            17: (self.contact_times, packed_doubles),
        }
        for number, _, value in read_fields(data):
            if number in arrays:
                column, decode = arrays[number]
                column.append(decode(value))
                if number == 1:
                    self.rows += len(column[-1])
            elif isinstance(value, int):
                continue
            elif number == 3:
                axis = collision_pb2.Axis.FromString(bytes(value))
                self.axes.append(_axis_of(axis) if axis.kind else None)
            elif number == 4:
                # Only rows with an answer have sizes.
                analysis = collision_pb2.Analysis.FromString(bytes(value))
                self.analyses.append(_analysis_of(analysis) if analysis.ByteSize() else None)
            elif number == 5:
                proof = collision_pb2.Certificate.FromString(bytes(value))
                self.certificates.append(_certificate_of(proof) if proof.ByteSize() else None)
            elif number == 11:
                problem = collision_pb2.PairProblem.FromString(bytes(value))
                self.problems[first + problem.row] = _problem_of(problem)
            elif number == 13:
                of_row = collision_pb2.PieceProof.FromString(bytes(value))
                self.piece_proofs[first + of_row.row] = _piece_certificates_of(of_row.certificates)
            elif number == 18:
                motion = collision_pb2.MotionProof.FromString(bytes(value))
                self.motion_proofs[first + motion.row] = _intervals_of(motion.intervals)

    def finish(self) -> Answers:
        """ValueError: the columns do not match."""

        def doubles(
            wanted: bool, parts: list[npt.NDArray[np.float64]], shape: tuple[int, ...], name: str
        ) -> npt.NDArray[np.float64] | None:
            if not wanted:
                return None
            column: npt.NDArray[np.float64] = np.concatenate([np.empty(0), *parts])
            if column.size != self.rows * int(np.prod(shape)):
                raise ValueError(
                    f"the column {name} has {column.size} numbers for {self.rows} answers"
                )
            shaped: npt.NDArray[np.float64] = column.reshape((self.rows, *shape))
            return shaped

        def small(parts: list[Unsigned], name: str) -> npt.NDArray[np.uint8]:
            column: npt.NDArray[np.uint8] = np.concatenate(
                [np.empty(0, np.uint8), *(part.astype(np.uint8, copy=False) for part in parts)]
            )
            if column.size != self.rows:
                raise ValueError(
                    f"the column {name} has {column.size} values for {self.rows} answers"
                )
            return column

        def messages(wanted: bool, parts: list[T], name: str) -> Sequence[T] | None:
            if wanted and len(parts) != self.rows:
                raise ValueError(
                    f"the column {name} has {len(parts)} entries for {self.rows} answers"
                )
            return tuple(parts) if wanted else None

        def deciding() -> npt.NDArray[np.int32] | None:
            empty = np.empty(0, np.uint64)
            column = np.concatenate([empty, *(part.astype(np.uint64) for part in self.pieces)])
            if column.size == 0:
                return None
            if column.size != 2 * self.rows:
                raise ValueError(
                    f"the column pieces has {column.size} numbers for {self.rows} answers"
                )
            # sint32: 0, -1, 1, -2 ... travel as 0, 1, 2, 3 ...
            half = (column >> np.uint64(1)).astype(np.int64)
            signed = np.where(column & np.uint64(1), ~half, half)
            return signed.astype(np.int32).reshape(-1, 2)

        wanted = self.wanted
        within = None
        if wanted.clearance is not None:
            within = small(self.within_clearance, "within_clearance").astype(np.bool_)
        return Answers(
            small(self.relations, "relations"),
            small(self.rungs, "rungs"),
            doubles(wanted.separation, self.separations, (), "separations"),
            doubles(wanted.separation, self.separation_bounds, (), "separation_bounds"),
            doubles(wanted.witness, self.witness_xyz, (2, 3), "witness_xyz"),
            doubles(wanted.witness, self.witness_errors, (), "witness_errors"),
            within,
            messages(wanted.axis, self.axes, "axes"),
            messages(wanted.analysis, self.analyses, "analyses"),
            messages(wanted.certificate, self.certificates, "certificates"),
            self.problems,
            deciding(),
            self.piece_proofs,
            doubles(wanted.normal, self.normal_xyz, (3,), "normal_xyz"),
            doubles(wanted.normal, self.normal_angle_bounds, (), "normal_angle_bounds"),
            doubles(bool(self.separated_until), self.separated_until, (), "separated_until"),
            doubles(bool(self.separated_until), self.contact_times, (), "contact_times"),
            self.motion_proofs,
        )


@dataclass
class Frame:
    """The common fields of the messages of batches, scenes, and streams, collected over
    messages."""

    columns: ColumnReader
    header: Header | None = None
    hulls: list[HullVersion | None] = field(default_factory=list)
    placement_problems: dict[int, Problem] = field(default_factory=dict)
    pairs: list[Unsigned] = field(default_factory=list)
    totals: SceneTotals | None = None
    piece_hulls: list[HullVersion] = field(default_factory=list)
    #: Fields that are numbers, by number, of the last message.
    numbers: dict[int, int] = field(default_factory=dict)

    def read(
        self,
        data: bytes,
        *,
        header: int,
        hulls: int,
        problems: int,
        columns: int,
        piece_hulls: int,
        pairs: int | None = None,
        totals: int | None = None,
    ) -> None:
        """Adds a message, by the numbers of its fields."""
        self.numbers = {}
        for number, _, value in read_fields(data):
            if number == pairs:
                self.pairs.append(packed_varints(value))
            elif isinstance(value, int):
                self.numbers[number] = value
            elif number == columns:
                self.columns.read(value)
            elif number == header:
                self.header = header_of(geometry_pb2.ResponseHeader.FromString(bytes(value)))
            elif number == hulls:
                version = collision_pb2.HullVersion.FromString(bytes(value))
                self.hulls.append(version_of(version) if version.hull_id else None)
            elif number == piece_hulls:
                of_piece = collision_pb2.HullVersion.FromString(bytes(value))
                self.piece_hulls.append(version_of(of_piece))
            elif number == problems:
                problem = collision_pb2.PlacementProblem.FromString(bytes(value))
                self.placement_problems[problem.placement] = _problem_of(problem)
            elif number == totals:
                sums = collision_pb2.SceneTotals.FromString(bytes(value))
                self.totals = SceneTotals(
                    sums.pairs,
                    sums.candidates,
                    sums.separated,
                    sums.touching,
                    sums.overlapping,
                    sums.within_tolerance,
                    sums.failed,
                )

    def read_batch(self, data: bytes) -> None:
        self.read(data, header=1, hulls=2, problems=3, columns=16, piece_hulls=17)

    def read_scene(self, data: bytes) -> None:
        self.read(data, header=1, hulls=2, problems=3, columns=5, piece_hulls=7, pairs=4, totals=6)

    def read_stream(self, data: bytes) -> tuple[int, bool]:
        """Returns the number of the client's message that this answers, and true if it is the
        last."""
        self.read(data, header=3, hulls=4, problems=5, columns=7, piece_hulls=8, pairs=6)
        return self.numbers.get(1, 0), bool(self.numbers.get(2, 0))

    def indices(self) -> npt.NDArray[np.uint32]:
        empty = np.empty(0, np.uint32)
        return np.concatenate([empty, *(part.astype(np.uint32) for part in self.pairs)])

    def known_hulls(self) -> Mapping[str, HullVersion]:
        return {version.hull_id: version for version in self.hulls if version is not None}

    def known_piece_hulls(self) -> Mapping[str, HullVersion]:
        return {version.hull_id: version for version in self.piece_hulls}


def new_frame(wanted: Wanted) -> Frame:
    return Frame(ColumnReader(wanted))


def decode_batch_part(data: bytes, wanted: Wanted) -> BatchPart:
    frame = new_frame(wanted)
    frame.read_batch(data)
    return BatchPart(
        frame.numbers.get(4, 0),
        frame.columns.finish(),
        frame.header,
        tuple(frame.hulls),
        frame.placement_problems,
        tuple(frame.piece_hulls),
    )


def decode_scene_part(data: bytes, wanted: Wanted) -> ScenePart:
    frame = new_frame(wanted)
    frame.read_scene(data)
    return ScenePart(
        frame.indices().reshape(-1, 2),
        frame.columns.finish(),
        frame.header,
        tuple(frame.hulls),
        frame.placement_problems,
        frame.totals,
        tuple(frame.piece_hulls),
    )


def decode_collision_changes(data: bytes) -> CollisionChanges:
    message = collision_pb2.WatchCollisionsResponse.FromString(data)
    return CollisionChanges(
        header_of(message.header),
        message.update,
        message.synced,
        tuple(version_of(hull) for hull in message.hulls),
        {problem.placement: _problem_of(problem) for problem in message.placement_problems},
        tuple(_events_of(message.events)),
        tuple(version_of(hull) for hull in message.piece_hulls),
    )


def _events_of(events: Iterable[Any]) -> Iterable[CollisionEvent]:
    for event in events:
        yield CollisionEvent(
            enum_or_zero(CollisionEventKind, event.kind),
            (event.placement_a, event.placement_b),
            enum_or_zero(Relation, event.relation),
            (event.revision_a, event.revision_b),
            event.within_clearance if event.HasField("within_clearance") else None,
            _piece_of(event.piece_a) if event.HasField("piece_a") else None,
            _piece_of(event.piece_b) if event.HasField("piece_b") else None,
        )
