"""Reads the contract's messages about pairs. The columns of many answers are read from the wire,
array by array."""

from __future__ import annotations

from collections import defaultdict
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
from hulld.wire import Unsigned, named_arrays, named_fields, packed_varints

T = TypeVar("T")
# By ID.
_Hulls = Mapping[str, HullVersion]


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

#: The messages of columns with one message for each row.
_MESSAGES: dict[str, tuple[Any, Callable[[Any], Any]]] = {
    "axes": (collision_pb2.Axis, lambda message: _axis_of(message) if message.kind else None),
    "analyses": (collision_pb2.Analysis, _analysis_of),
    "certificates": (collision_pb2.Certificate, _certificate_of),
}


class ColumnReader:
    """Collects the columns of messages into answers."""

    def __init__(self, wanted: Wanted) -> None:
        self.wanted = wanted
        #: The parts of each column: arrays, or messages.
        self.columns: defaultdict[str, list[Any]] = defaultdict(list)
        self.problems: dict[int, Problem] = {}
        self.piece_proofs: dict[int, tuple[PieceCertificate, ...]] = {}
        self.motion_proofs: dict[int, tuple[SeparatedInterval, ...]] = {}
        self.rows = 0

    def read(self, data: memoryview) -> None:
        """Adds the rows of an AnswerColumns message. ValueError: it is malformed."""
        first = self.rows
        for name, value in named_arrays(collision_pb2.AnswerColumns, data):
            if name == "relations":
                self.rows += len(value)
            if name == "pair_problems":
                problem = collision_pb2.PairProblem.FromString(bytes(value))
                self.problems[first + problem.row] = _problem_of(problem)
            elif name == "piece_proofs":
                of_row = collision_pb2.PieceProof.FromString(bytes(value))
                self.piece_proofs[first + of_row.row] = _piece_certificates_of(of_row.certificates)
            elif name == "motion_proofs":
                motion = collision_pb2.MotionProof.FromString(bytes(value))
                self.motion_proofs[first + motion.row] = _intervals_of(motion.intervals)
            elif name in _MESSAGES:
                kind, decode = _MESSAGES[name]
                # Rows without the part have an empty message.
                value = decode(kind.FromString(bytes(value))) if len(value) else None
                self.columns[name].append(value)
            else:
                self.columns[name].append(value)

    def finish(self) -> Answers:
        """ValueError: the columns do not match."""

        def doubles(wanted: bool, name: str, *shape: int) -> npt.NDArray[np.float64] | None:
            if not wanted:
                return None
            column: npt.NDArray[np.float64] = np.concatenate([np.empty(0), *self.columns[name]])
            self._check(name, column.size, self.rows * int(np.prod(shape)))
            shaped: npt.NDArray[np.float64] = column.reshape((self.rows, *shape))
            return shaped

        def small(name: str) -> npt.NDArray[np.uint8]:
            parts = [part.astype(np.uint8, copy=False) for part in self.columns[name]]
            column: npt.NDArray[np.uint8] = np.concatenate([np.empty(0, np.uint8), *parts])
            self._check(name, column.size, self.rows)
            return column

        def messages(wanted: bool, name: str) -> Sequence[Any] | None:
            if not wanted:
                return None
            self._check(name, len(self.columns[name]), self.rows)
            return tuple(self.columns[name])

        def deciding() -> npt.NDArray[np.int32] | None:
            parts = [part.astype(np.uint64) for part in self.columns["pieces"]]
            column = np.concatenate([np.empty(0, np.uint64), *parts])
            if column.size == 0:
                return None
            self._check("pieces", column.size, 2 * self.rows)
            # sint32: 0, -1, 1, -2 ... travel as 0, 1, 2, 3 ...
            half = (column >> np.uint64(1)).astype(np.int64)
            signed = np.where(column & np.uint64(1), ~half, half)
            return signed.astype(np.int32).reshape(-1, 2)

        wanted = self.wanted
        moves = bool(self.columns["separated_until"])
        within = None
        if wanted.clearance is not None:
            within = small("within_clearance").astype(np.bool_)
        return Answers(
            small("relations"),
            small("rungs"),
            doubles(wanted.separation, "separations"),
            doubles(wanted.separation, "separation_bounds"),
            doubles(wanted.witness, "witness_xyz", 2, 3),
            doubles(wanted.witness, "witness_errors"),
            within,
            messages(wanted.axis, "axes"),
            messages(wanted.analysis, "analyses"),
            messages(wanted.certificate, "certificates"),
            self.problems,
            deciding(),
            self.piece_proofs,
            doubles(wanted.normal, "normal_xyz", 3),
            doubles(wanted.normal, "normal_angle_bounds"),
            doubles(moves, "separated_until"),
            doubles(moves, "contact_times"),
            self.motion_proofs,
        )

    def _check(self, name: str, count: int, expected: int) -> None:
        if count != expected:
            raise ValueError(f"the column {name} has {count} values; {expected} were expected")


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
    #: Fields that are numbers, by name, of the last message.
    numbers: dict[str, int] = field(default_factory=dict)

    def read(self, kind: Any, data: bytes) -> None:
        """Adds a message, of the generated class `kind`."""
        self.numbers = {}
        for name, value in named_fields(kind, data):
            if name == "pairs":
                self.pairs.append(packed_varints(value))
            elif isinstance(value, int):
                self.numbers[name] = value
            elif name == "columns":
                self.columns.read(value)
            elif name == "header":
                self.header = header_of(geometry_pb2.ResponseHeader.FromString(bytes(value)))
            elif name == "hulls":
                version = collision_pb2.HullVersion.FromString(bytes(value))
                self.hulls.append(version_of(version) if version.hull_id else None)
            elif name == "piece_hulls":
                of_piece = collision_pb2.HullVersion.FromString(bytes(value))
                self.piece_hulls.append(version_of(of_piece))
            elif name == "placement_problems":
                problem = collision_pb2.PlacementProblem.FromString(bytes(value))
                self.placement_problems[problem.placement] = _problem_of(problem)
            elif name == "totals":
                sums = collision_pb2.SceneTotals.FromString(bytes(value))
                self.totals = SceneTotals(
                    **{name: getattr(sums, name) for name in SceneTotals.__dataclass_fields__}
                )

    def indices(self) -> npt.NDArray[np.uint32]:
        empty = np.empty(0, np.uint32)
        return np.concatenate([empty, *(part.astype(np.uint32) for part in self.pairs)])

    def finish(self) -> tuple[Answers, _Hulls, Mapping[int, Problem], Header, _Hulls]:
        """The fields of a Batch after its pairs. ValueError: something is missing."""
        if self.header is None:
            raise ValueError("the answer has no header")
        return (
            self.columns.finish(),
            {version.hull_id: version for version in self.hulls if version is not None},
            self.placement_problems,
            self.header,
            {version.hull_id: version for version in self.piece_hulls},
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
