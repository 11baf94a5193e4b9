"""Answers about pairs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from enum import IntEnum
from typing import Any

import numpy as np
import numpy.typing as npt

from hulld.answers.equality import ArrayFields
from hulld.answers.hulls import Header, enum_or_zero
from hulld.errors import HulldError, error_class
from hulld.geometry.placements import Placements
from hulld.notebook import Viewer


class Relation(IntEnum):
    """The relation of two hulls: exact, for the doubles given."""

    #: No answer; see the problem.
    UNSPECIFIED = 0
    #: No common point.
    SEPARATED = 1
    #: A common point, but an arbitrarily small translation separates them.
    TOUCHING = 2
    #: No small translation separates them.
    OVERLAPPING = 3
    #: With a tolerance only: |separation| <= tolerance; collision undecided.
    WITHIN_TOLERANCE = 4


class Method(IntEnum):
    """CERTIFIED_SEARCH is the default."""

    UNSPECIFIED = 0
    CERTIFIED_SEARCH = 1
    #: Projects every vertex on every candidate axis; its time grows with the cube of the size.
    TEXTBOOK_SAT = 2


class Rung(IntEnum):
    """The stage that decided an answer."""

    UNSPECIFIED = 0
    BOUNDS = 1
    #: The evidence that decided the pair's previous answer in a stream or watch.
    CACHED = 2
    #: Floating point with a proven error bound.
    FLOATING_POINT = 4
    EXACT = 5


class AxisKind(IntEnum):
    """The origin of an axis."""

    UNSPECIFIED = 0
    FACET_A = 1
    FACET_B = 2
    EDGE_EDGE = 3
    #: A direction that only pairs of flat hulls need.
    FLAT = 4
    #: A support direction found by search.
    GENERAL = 5


@dataclass(frozen=True)
class HullVersion:
    """The version of a hull from which an answer was computed. Empty for an inline shape."""

    hull_id: str
    create_revision: int
    revision: int
    store_id: str

    def __repr__(self) -> str:
        return f"{self.hull_id}@{self.revision}" if self.hull_id else "points"


@dataclass(frozen=True)
class DecidingPiece:
    """The piece of a body that decided an answer. index: position in the body's list, from 0.
    hull: the version of the piece's hull from which the answer was computed."""

    index: int
    hull: HullVersion


@dataclass(frozen=True)
class Separation:
    """|value - true separation| <= bound, and the sign of the value agrees with the relation; in
    the caller's length unit.

    value: the distance if positive; minus the penetration depth if negative; 0 if and only if
    TOUCHING; infinite if a hull is empty. bound: infinite if a double cannot represent the value.
    """

    value: float
    bound: float


@dataclass(frozen=True, eq=False)
class Witness(ArrayFields):
    """Two points, x y z in the world frame, that attain the separation, each with an error of at
    most `error`."""

    point_a: npt.NDArray[np.float64]
    point_b: npt.NDArray[np.float64]
    error: float


@dataclass(frozen=True, eq=False)
class Normal(ArrayFields):
    """The direction in which the separation is attained, from A toward B; if there are several, one
    of them.

    direction: x y z in the world frame, of unit length up to rounding. SEPARATED: from the nearest
    point of A to the nearest point of B. TOUCHING: normal to a plane with A on one side and B on
    the other.
    OVERLAPPING: the direction of the shortest translation of B that ends the overlap. angle_bound:
    the angle to the exact direction is at most this, in radians (proven).
    """

    direction: npt.NDArray[np.float64]
    angle_bound: float


@dataclass(frozen=True, eq=False)
class Feature(ArrayFields):
    """The points of a hull that lie farthest along an axis.

    vertex_indices: into the canonical snapshot. vertices: the same vertices, n x 3, in the hull's
    own frame. facet_index: the facet, if the feature is a whole facet.
    """

    vertex_indices: npt.NDArray[np.uint32]
    vertices: npt.NDArray[np.float64]
    facet_index: int | None


@dataclass(frozen=True, eq=False)
class Axis(ArrayFields):
    """A direction that proves that the hulls are separated or touching, not necessarily the
    direction in which they are nearest (see Normal). direction: x y z in the world frame, from A
    toward B, of unit length up to rounding."""

    direction: npt.NDArray[np.float64]
    kind: AxisKind
    feature_a: Feature
    feature_b: Feature


@dataclass(frozen=True, eq=False)
class VertexPair(ArrayFields):
    """A vertex of A and a vertex of B: indices into the canonical snapshots, and x y z, each in the
    frame of its own hull."""

    index_a: int
    index_b: int
    vertex_a: npt.NDArray[np.float64]
    vertex_b: npt.NDArray[np.float64]


@dataclass(frozen=True)
class Certificate:
    """A proof of the relation from vertices and poses alone.

    direction: x y z in the world frame, from A toward B, exact as given; integers (of any size) if
    doubles do not suffice; None when OVERLAPPING. SEPARATED: max n.A < min n.B. TOUCHING: max n.A
    <= min n.B, and the convex hull of the differences of at most four pairs contains 0.
    OVERLAPPING: the convex hull of the differences of at most six pairs contains 0 strictly
    inside.
    """

    direction: tuple[float, float, float] | tuple[int, int, int] | None
    pairs: Sequence[VertexPair]


@dataclass(frozen=True)
class SeparatedInterval:
    """Proof that a pair in motion is separated from the end of the previous interval, or 0, up to
    `until`.

    direction: as in Certificate. offset: n.p < offset for all points p of A, and n.p > offset for
    all points p of B, at all these times. end_direction, end_offset: direction and offset at
    `until`, linear in between; None if they do not change. offset None: neither placement rotates,
    and max n.A < min n.B at both ends; equality is allowed at a contact.
    """

    until: float
    direction: tuple[float, float, float] | tuple[int, int, int] | None
    offset: float | None
    end_direction: tuple[float, float, float] | None = None
    end_offset: float | None = None


@dataclass(frozen=True)
class FirstContact:
    """The first contact of a pair in motion, over times from 0 to 1.

    separated_until: the pair is separated (proven) at all times before this time; 1 when SEPARATED.
    contact_time: the pair is in contact at this time; equal to separated_until if the exact time is
    a double, and None when SEPARATED or WITHIN_TOLERANCE. intervals: the proof of the separation,
    if a certificate was requested; the certificate of the answer then applies at contact_time.
    """

    separated_until: float
    contact_time: float | None
    intervals: Sequence[SeparatedInterval] = ()


@dataclass(frozen=True)
class PieceCertificate:
    """A proof of the relation of a piece of A and a piece of B, by index, 0 for a hull; each at the
    product of the pose of its placement and its pose in the body. intervals: of a pair in motion,
    the proof that it is separated before the first contact of the bodies."""

    piece_a: int
    piece_b: int
    relation: Relation
    certificate: Certificate
    intervals: Sequence[SeparatedInterval] = ()


@dataclass(frozen=True)
class HullSize:
    """Sizes of a hull."""

    vertices: int
    edges: int
    facets: int


@dataclass(frozen=True)
class Analysis:
    """The cost of an answer. time: in seconds, excluding the network. axes_total: TEXTBOOK_SAT
    only, else 0."""

    time: float
    size_a: HullSize
    size_b: HullSize
    axes_tested: int
    axes_total: int
    stage: AxisKind
    axis_index: int | None


@dataclass(frozen=True)
class Problem:
    """Explains why a placement or a pair has no answer. code and reason: as in HulldError."""

    code: str
    message: str
    reason: str | None


class _Answer:
    """The answer about a pair."""

    relation: Relation

    @property
    def colliding(self) -> bool:
        """TOUCHING or OVERLAPPING."""
        return self.relation in (Relation.TOUCHING, Relation.OVERLAPPING)

    def __bool__(self) -> bool:
        raise TypeError(
            "an answer is neither true nor false; use .colliding, .relation, or .within_clearance"
        )


@dataclass(frozen=True)
class Collision(_Answer):
    """The answer about a pair.

    relation: exact, unless WITHIN_TOLERANCE. axis, analysis, certificate, separation, witness,
    normal: None if not requested, or if the pair has none. within_clearance: separation <=
    clearance; None without a clearance. hull_a, hull_b: the hulls or bodies of the answer, with
    their revisions. piece_a, piece_b: for a body, the piece that decided; axis, analysis, witness,
    and normal refer to its hull. None for a hull, and if no single pair of pieces decided.
    piece_certificates: with a body, the proof in place of the certificate; piece_hulls: then the
    hulls of all pieces, by ID. first_contact: for a motion, when the pair meets; if it never meets,
    the relation is SEPARATED. None without an end pose.
    """

    relation: Relation
    rung: Rung
    hull_a: HullVersion
    hull_b: HullVersion
    axis: Axis | None
    analysis: Analysis | None
    certificate: Certificate | None
    separation: Separation | None
    witness: Witness | None
    within_clearance: bool | None
    header: Header
    piece_a: DecidingPiece | None = None
    piece_b: DecidingPiece | None = None
    piece_certificates: Sequence[PieceCertificate] = ()
    piece_hulls: Mapping[str, HullVersion] = field(default_factory=dict)
    normal: Normal | None = None
    first_contact: FirstContact | None = None
    _query: Placements | None = field(default=None, repr=False, compare=False)
    _viewer: Viewer | None = field(default=None, repr=False, compare=False)

    def __repr__(self) -> str:
        return _short(self, f"{self.hull_a!r}, {self.hull_b!r}", ("hull_a", "hull_b", "header"))

    def _repr_html_(self) -> str:
        """For notebooks: the viewer's page of both current hulls, if hullctl is found, and a
        table."""
        separation, witness, normal = self.separation, self.witness, self.normal
        contact = self.first_contact
        rows = [
            ("relation", self.relation.name),
            ("decided by", self.rung.name),
            ("A", _versioned(self.hull_a)),
            ("B", _versioned(self.hull_b)),
            ("piece of A", _named(self.piece_a)),
            ("piece of B", _named(self.piece_b)),
            ("separation", separation and f"{separation.value!r} within {separation.bound!r}"),
            ("point of A", witness and witness.point_a),
            ("point of B", witness and witness.point_b),
            ("normal", normal and f"{normal.direction} within {normal.angle_bound!r} rad"),
            ("separated until", contact and repr(contact.separated_until)),
            ("first contact", contact and contact.contact_time),
            ("within clearance", self.within_clearance),
            ("axis", self.axis and self.axis.direction),
        ]
        viewer = self._viewer or Viewer.absent("this answer did not come from a server")
        return viewer.html(rows, self._query or Placements([]), [(0, 1)])


def _short(answer: Any, first: str, left_out: Sequence[str]) -> str:
    """A repr without parts that were not requested. Long parts are shown by name only."""
    parts = [first] if first else []
    for part in fields(answer):
        value = getattr(answer, part.name)
        if part.name.startswith("_") or part.name in left_out or value is None:
            continue
        if isinstance(value, IntEnum):
            if value:
                parts.append(value.name)
        elif isinstance(value, Separation):
            parts.append(f"separation={value.value!r}")
        elif isinstance(value, FirstContact):
            parts.append(f"contact_time={value.contact_time!r}")
        elif isinstance(value, (bool, tuple, Problem)) and value != ():
            parts.append(f"{part.name}={value!r}")
        elif isinstance(value, (Witness, Normal, Axis, Certificate, Analysis)):
            parts.append(f"{part.name}=...")
    return f"{type(answer).__name__}({', '.join(parts)})"


def _named(piece: DecidingPiece | None) -> str | None:
    if piece is None:
        return None
    return f"{piece.index}: {_versioned(piece.hull)}"


def _versioned(hull: HullVersion) -> str:
    return f"{hull.hull_id} (revision {hull.revision})" if hull.hull_id else "points"


@dataclass(frozen=True)
class AnswerRow(_Answer):
    """The answer about one of many pairs.

    pair: the indices of its placements; None in rows of Answers. problem: the reason for a missing
    answer. pieces: the pieces of bodies that decided, by index; -1 for a hull. Other fields are as
    in Collision.
    """

    pair: tuple[int, int] | None
    relation: Relation
    rung: Rung
    separation: Separation | None
    witness: Witness | None
    within_clearance: bool | None
    axis: Axis | None
    analysis: Analysis | None
    certificate: Certificate | None
    piece_certificates: Sequence[PieceCertificate]
    pieces: tuple[int, int] | None
    problem: Problem | None
    normal: Normal | None = None
    first_contact: FirstContact | None = None

    def __repr__(self) -> str:
        return _short(self, "" if self.pair is None else f"pair={self.pair}", ("pair",))


@dataclass(frozen=True, eq=False)
class Answers(ArrayFields):
    """The answers about m pairs, one row each. answers[i] is row i, as an AnswerRow.

    relations, rungs: m values of Relation and Rung, as uint8; compare them, as in relations ==
    Relation.TOUCHING. If requested: separations, separation_bounds (m), witness_points (m x 2 x 3:
    the point of A, then of B, world frame), witness_errors (m), normals (m x 3),
    normal_angle_bounds (m), NaN in rows without one; within_clearance (m, bool); axes, analyses,
    certificates, None in rows without one. Otherwise None. problems: by row, the reason for a
    missing answer that is not in placement_problems. pieces: m x 2, the pieces of bodies that
    decided, by index; -1 for a hull, and if no single pair of pieces decided; None without bodies.
    piece_proofs: by row, for a pair with a body, the certificates of pairs of pieces; its entry of
    `certificates` is None. separated_until, contact_times: m, for motions, as in FirstContact; the
    contact time is NaN for a pair without a contact; None without motions. motion_proofs: by row,
    the intervals of FirstContact.
    """

    relations: npt.NDArray[np.uint8]
    rungs: npt.NDArray[np.uint8]
    separations: npt.NDArray[np.float64] | None
    separation_bounds: npt.NDArray[np.float64] | None
    witness_points: npt.NDArray[np.float64] | None
    witness_errors: npt.NDArray[np.float64] | None
    within_clearance: npt.NDArray[np.bool_] | None
    axes: Sequence[Axis | None] | None
    analyses: Sequence[Analysis | None] | None
    certificates: Sequence[Certificate | None] | None
    problems: Mapping[int, Problem]
    pieces: npt.NDArray[np.int32] | None = None
    piece_proofs: Mapping[int, Sequence[PieceCertificate]] = field(default_factory=dict)
    normals: npt.NDArray[np.float64] | None = None
    normal_angle_bounds: npt.NDArray[np.float64] | None = None
    separated_until: npt.NDArray[np.float64] | None = None
    contact_times: npt.NDArray[np.float64] | None = None
    motion_proofs: Mapping[int, Sequence[SeparatedInterval]] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.relations)

    def __getitem__(self, row: int) -> AnswerRow:
        """The answer in a row; -1 is the last one. IndexError: no such row."""
        row = range(len(self))[row]

        def cell(column: Any) -> Any:
            return None if column is None else column[row]

        separation = witness = normal = pieces = within = None
        if self.separations is not None and self.separation_bounds is not None:
            value, bound = float(self.separations[row]), float(self.separation_bounds[row])
            separation = None if np.isnan(value) else Separation(value, bound)
        if self.witness_points is not None and self.witness_errors is not None:
            error = float(self.witness_errors[row])
            point_a, point_b = self.witness_points[row]
            witness = None if np.isnan(error) else Witness(point_a, point_b, error)
        if self.normals is not None and self.normal_angle_bounds is not None:
            bound = float(self.normal_angle_bounds[row])
            normal = None if np.isnan(bound) else Normal(self.normals[row], bound)
        relation = enum_or_zero(Relation, int(self.relations[row]))
        if self.within_clearance is not None and relation != Relation.UNSPECIFIED:
            within = bool(self.within_clearance[row])
        if self.pieces is not None:
            pieces = (int(self.pieces[row, 0]), int(self.pieces[row, 1]))
        return AnswerRow(
            None,
            relation,
            enum_or_zero(Rung, int(self.rungs[row])),
            separation,
            witness,
            within,
            cell(self.axes),
            cell(self.analyses),
            cell(self.certificates),
            self.piece_proofs.get(row, ()),
            pieces,
            self.problems.get(row),
            normal,
            self._first_contact(row),
        )

    def _first_contact(self, row: int) -> FirstContact | None:
        if self.separated_until is None or self.contact_times is None:
            return None
        until, time = float(self.separated_until[row]), float(self.contact_times[row])
        if np.isnan(until):
            return None
        proof = self.motion_proofs.get(row, ())
        return FirstContact(until, None if np.isnan(time) else time, proof)

    def __iter__(self) -> Iterator[AnswerRow]:
        return (self[row] for row in range(len(self)))

    def __repr__(self) -> str:
        return f"Answers({_counted(self)})"

    @property
    def colliding(self) -> npt.NDArray[np.bool_]:
        """m: TOUCHING or OVERLAPPING."""
        found: npt.NDArray[np.bool_] = (self.relations == Relation.TOUCHING) | (
            self.relations == Relation.OVERLAPPING
        )
        return found

    def __bool__(self) -> bool:
        raise TypeError("answers are neither true nor false; use .colliding.any() or .relations")


def _counted(answers: Answers) -> str:
    """The number of rows, in total and by relation."""
    counts = np.bincount(answers.relations, minlength=len(Relation))
    names = [
        f"{count} {Relation(relation).name if relation else 'without an answer'}"
        for relation, count in enumerate(counts[: len(Relation)].tolist())
        if count
    ]
    return f"{len(answers)} pairs" + (f": {', '.join(names)}" if names else "")


@dataclass(frozen=True, repr=False, eq=False)
class _Rows(ArrayFields):
    """Pairs with their answers, row by row."""

    pairs: npt.NDArray[np.uint32]
    answers: Answers
    hulls: Mapping[str, HullVersion]
    placement_problems: Mapping[int, Problem]
    header: Header
    piece_hulls: Mapping[str, HullVersion]

    def __len__(self) -> int:
        return len(self.pairs)

    def __getitem__(self, row: int) -> AnswerRow:
        """The answer for pairs[row]; -1 is the last one. IndexError: no such row."""
        answer = self.answers[row]
        a, b = self.pairs[row].tolist()
        return replace(answer, pair=(a, b), problem=self.problem(row))

    def __iter__(self) -> Iterator[AnswerRow]:
        return (self[row] for row in range(len(self)))

    def __bool__(self) -> bool:
        raise TypeError("answers are neither true nor false; use len() or .answers.colliding.any()")

    def __repr__(self) -> str:
        return f"{type(self).__name__}({_counted(self.answers)})"

    def problem(self, row: int) -> Problem | None:
        """The reason why pairs[row] has no answer; None if it has one."""
        row = range(len(self))[row]
        if row in self.answers.problems:
            return self.answers.problems[row]
        for placement in self.pairs[row].tolist():
            if placement in self.placement_problems:
                return self.placement_problems[placement]
        return None

    def error(self, row: int, subject: str) -> HulldError:
        """The error of pairs[row], which has no answer. subject: precedes the message."""
        problem = self.problem(row) or Problem("INTERNAL", "the server gave no reason", None)
        message = f"{subject}{problem.message}"
        return error_class(problem.code)(message, code=problem.code, reason=problem.reason)


@dataclass(frozen=True, repr=False, eq=False)
class Batch(_Rows):
    """The answers to all pairs of a batch.

    pairs: m x 2, as requested. answers: row i answers pairs[i]. hulls: by ID, the revision that the
    answers are based on; IDs without a hull are missing. placement_problems: by index of the
    placement, the reason why no pair with it has an answer. piece_hulls: if certificates were
    requested, the hulls of the pieces of all bodies, by ID.
    """


@dataclass(frozen=True)
class SceneTotals:
    """The numbers of pairs: queried; with intersecting boxes; found, by relation; without an
    answer."""

    pairs: int
    candidates: int
    separated: int
    touching: int
    overlapping: int
    within_tolerance: int
    failed: int


@dataclass(frozen=True, repr=False, eq=False)
class Scene(_Rows):
    """All pairs of a scene that collide, or are within the clearance or tolerance: k x 2 pairs, the
    lower index first, ascending. Other fields are as in Batch."""

    totals: SceneTotals


@dataclass(frozen=True, repr=False, eq=False)
class StreamAnswer(_Rows):
    """The answer to one message of a collision stream.

    update: the number of the message; 0 opened the stream. rows: the answered pairs, as positions
    in the pairs of the stream, ascending; row i of `answers` belongs to pairs[rows[i]]. pairs: the
    same pairs as k x 2 indices of placements. hulls, placement_problems, piece_hulls: as in Batch
    if the hulls were resolved for this message; empty otherwise.
    """

    update: int
    rows: npt.NDArray[np.uint32]


class CollisionEventKind(IntEnum):
    """The change of a pair since its last event."""

    UNSPECIFIED = 0
    #: It overlaps, and did not before.
    ENTER = 1
    #: It touches, and did not before.
    TOUCH = 2
    #: It is separated, and touched or overlapped before.
    EXIT = 3
    #: It is separated but within the clearance, and was farther apart before.
    NEAR = 4
    #: It is farther apart than the clearance, and was within it before.
    FAR = 5
    #: It no longer has an answer: a placement has a problem.
    LOST = 6


@dataclass(frozen=True)
class CollisionEvent:
    """placements: the pair, as indices. revisions: of the hulls or bodies of the pair; 0 when LOST.
    piece_a, piece_b: for a body, the piece that decided, as in Collision."""

    kind: CollisionEventKind
    placements: tuple[int, int]
    relation: Relation
    revisions: tuple[int, int]
    within_clearance: bool | None
    piece_a: DecidingPiece | None = None
    piece_b: DecidingPiece | None = None


@dataclass(frozen=True)
class CollisionChanges:
    """One message of a watch of collisions.

    header: when synced, every change of a watched hull up to this revision is included. update: the
    last update that these events include; 0 is the opening message. synced: all pairs have been
    reported at that update's poses. hulls: hulls that are new to the watch, or have changed.
    placement_problems: new problems. piece_hulls: the hulls of the pieces of bodies, as `hulls`.
    """

    header: Header
    update: int
    synced: bool
    hulls: Sequence[HullVersion]
    placement_problems: Mapping[int, Problem]
    events: Sequence[CollisionEvent]
    piece_hulls: Sequence[HullVersion] = ()
