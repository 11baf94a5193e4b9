"""Answers about hulls."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any

import numpy as np
import numpy.typing as npt

from hulld.answers.equality import ArrayFields
from hulld.notebook import Viewer
from hulld.v1 import hull_pb2
from hulld.wire import named_arrays, named_fields


@dataclass(frozen=True)
class Header:
    """The store and the revision that a reply describes. Revisions of different stores are
    unrelated. staleness: in seconds; the answer to a read with a Freshness includes at least every
    change committed that long before the call."""

    store_id: str
    revision: int
    staleness: float = 0.0


@dataclass(frozen=True)
class PointCounts:
    """Counts of points: received = outside + duplicate + inside."""

    received: int = 0
    #: Points that became vertices and were still vertices after their chunk.
    outside: int = 0
    #: Points equal to a vertex that is already counted for another point, after their chunk.
    duplicate: int = 0
    #: All other points: inside the hull or on its boundary, but not vertices.
    inside: int = 0

    def __add__(self, other: PointCounts) -> PointCounts:
        return PointCounts(
            self.received + other.received,
            self.outside + other.outside,
            self.duplicate + other.duplicate,
            self.inside + other.inside,
        )


@dataclass(frozen=True)
class HullInfo:
    """A hull without its geometry.

    dimension: -1 (empty), 0 (point), 1 (segment), 2 (polygon), or 3. revision: of the last change
    of its vertices. create_revision: distinguishes incarnations of an ID. damaged: the stored hull
    is damaged; calls that need it raise DataLossError, other fields may be missing, and delete_hull
    removes it.
    """

    hull_id: str
    create_revision: int
    revision: int
    dimension: int
    vertex_count: int
    counts: PointCounts
    damaged: bool = False


class Durability(IntEnum):
    """The guarantee of an acknowledgement."""

    UNSPECIFIED = 0
    #: In memory only: lost when the server exits.
    MEMORY = 1
    #: Written, and synced to disk soon afterwards.
    RELAXED = 2
    #: Synced to disk before the acknowledgement.
    SYNC = 3


@dataclass(frozen=True)
class CreatedHull:
    """created: False if the hull existed and if_absent was set."""

    hull: HullInfo
    created: bool
    header: Header


@dataclass(frozen=True)
class ReplacedHull:
    """created: True if the hull did not exist before."""

    hull: HullInfo
    created: bool
    durability: Durability
    header: Header


@dataclass(frozen=True)
class Audit:
    """The result of a check with code that is independent of the builder; finding: the defect, if
    not ok."""

    ok: bool
    finding: str


@dataclass(frozen=True)
class BoundedValue:
    """|value - true value| <= bound (proven). A value beyond the largest double is that double,
    with an infinite bound."""

    value: float
    bound: float


@dataclass(frozen=True, eq=False)
class HullProperties(ArrayFields):
    """Properties of a hull in its own frame, for density 1, in powers of the caller's length unit.

    Volume, centroid, and inertia are the doubles nearest to the exact values, and exact if their
    bound is 0. volume: 0 if the dimension is less than 3. area: of the surface; for a polygon, of
    both sides. centroid: x y z, the mean of the points of the hull. inertia: 3 x 3, about the
    centroid. centroid_bounds (3), inertia_bounds (3 x 3): of each number.
    """

    volume: BoundedValue
    area: BoundedValue
    centroid: npt.NDArray[np.float64]
    centroid_bounds: npt.NDArray[np.float64]
    inertia: npt.NDArray[np.float64]
    inertia_bounds: npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Hull(ArrayFields):
    """Sizes, point counts, and bounding box of a hull.

    edge_count, facet_count: None if not requested. box: 2 x 3, the lowest and the highest corner,
    in the caller's length unit; None when the hull is empty. audit, properties: None if not
    requested; an empty hull has no properties.
    """

    info: HullInfo
    edge_count: int | None
    facet_count: int | None
    box: npt.NDArray[np.float64] | None
    audit: Audit | None
    header: Header
    properties: HullProperties | None = None
    _viewer: Viewer | None = field(default=None, repr=False, compare=False)

    def __repr__(self) -> str:
        return (
            f"Hull({self.info.hull_id}@{self.info.revision}, dimension {self.info.dimension}, "
            f"{self.info.vertex_count} vertices)"
        )

    def _repr_html_(self) -> str:
        """For notebooks: the viewer's page of the current hull, if hullctl is found, and a
        table."""
        rows = [
            ("hull", self.info.hull_id),
            ("dimension", self.info.dimension),
            ("vertices", self.info.vertex_count),
            ("edges", self.edge_count),
            ("facets", self.facet_count),
            (
                "points",
                f"{self.info.counts.received} received, {self.info.counts.outside} outside, "
                f"{self.info.counts.duplicate} duplicate, {self.info.counts.inside} inside",
            ),
            ("box", None if self.box is None else f"{self.box[0]} to {self.box[1]}"),
            ("volume", self.properties and self.properties.volume.value),
            ("centroid", self.properties and self.properties.centroid),
            ("revision", self.info.revision),
            ("audit", self.audit and (self.audit.finding or "ok")),
        ]
        viewer = self._viewer or Viewer.absent("this hull was not read from a server")
        return viewer.html(rows, [self.info.hull_id])


@dataclass(frozen=True, eq=False)
class HullMesh(ArrayFields):
    """The canonical snapshot of a hull, or a simplification of it, all at the same revision.

    vertices: n x 3, the caller's length unit, in canonical order, with the doubles that were
    appended. facet_sizes: vertices of each facet. facet_indices: indices of vertices, facet after
    facet, counter-clockwise seen from outside. A hull of dimension 2 has one facet, seen from both
    sides; one of lower dimension has none. error: the Hausdorff distance between mesh and hull is
    at most this (proven); None if the mesh is the hull itself.
    """

    info: HullInfo
    vertices: npt.NDArray[np.float64]
    facet_sizes: npt.NDArray[np.uint32]
    facet_indices: npt.NDArray[np.uint32]
    error: float | None
    header: Header
    _viewer: Viewer | None = field(default=None, repr=False, compare=False)

    @property
    def facets(self) -> list[npt.NDArray[np.uint32]]:
        """The indices of each facet's vertices."""
        return (
            np.split(self.facet_indices, np.cumsum(self.facet_sizes)[:-1])
            if self.facet_sizes.size
            else []
        )

    @property
    def triangles(self) -> npt.NDArray[np.int64]:
        """m x 3: each facet as a fan around its first vertex, for libraries that accept only
        triangles."""
        sizes = self.facet_sizes.astype(np.int64)
        starts = np.cumsum(sizes) - sizes
        fans = np.maximum(sizes - 2, 0)
        first = np.repeat(starts, fans)
        step = np.arange(int(fans.sum())) - np.repeat(np.cumsum(fans) - fans, fans)
        corners = np.stack([first, first + step + 1, first + step + 2], axis=1)
        triangles: npt.NDArray[np.int64] = self.facet_indices.astype(np.int64)[corners]
        return triangles

    def __repr__(self) -> str:
        error = "" if self.error is None else f", error={self.error!r}"
        return (
            f"HullMesh({self.info.hull_id}@{self.info.revision}, {len(self.vertices)} vertices, "
            f"{len(self.facet_sizes)} facets{error})"
        )

    def _repr_html_(self) -> str:
        """Like Hull._repr_html_."""
        rows = [
            ("hull", self.info.hull_id),
            ("vertices", len(self.vertices)),
            ("facets", len(self.facet_sizes)),
            ("within", self.error),
            ("revision", self.info.revision),
        ]
        viewer = self._viewer or Viewer.absent("this mesh was not read from a server")
        return viewer.html(rows, [self.info.hull_id])


class HullEventKind(IntEnum):
    """The change of a hull since the previous header."""

    UNSPECIFIED = 0
    #: The hull exists. The only kind besides DELETED until `synced`. Later, it replaces the next
    #: three kinds while the reader lags far behind.
    PRESENT = 1
    CREATED = 2
    #: Its vertices changed, or the body was put again; the incarnation is the same.
    CHANGED = 3
    #: It has a new incarnation: it was replaced, or deleted and created again.
    REPLACED = 4
    DELETED = 5


@dataclass(frozen=True, eq=False)
class HullEvent(ArrayFields):
    """hull: as of its revision; DELETED: only hull_id, and the revision of the deletion. box: as in
    Hull. is_body: True for a body; `hull` then has only its ID, revisions, and the damaged flag,
    and piece_count is its number of pieces."""

    kind: HullEventKind
    hull: HullInfo
    box: npt.NDArray[np.float64] | None
    is_body: bool = False
    piece_count: int = 0


@dataclass(frozen=True)
class HullChanges:
    """One message of a watch of hulls.

    header: every change up to this revision is in this message or an earlier one, unless a later
    change superseded it; a watch resumes from here. events: each hull at most once. synced: the
    initial state is complete; later events report changes as they are committed. restarted: discard
    all earlier events; the watch starts over with the full state.
    """

    header: Header
    events: Sequence[HullEvent]
    synced: bool
    restarted: bool


# --- From the contract's messages ---


def enum_or_zero(kind: Any, value: int) -> Any:
    """A value from a later version of the contract reads as UNSPECIFIED."""
    try:
        return kind(value)
    except ValueError:
        return kind(0)


def header_of(message: Any) -> Header:
    return Header(
        message.store_id,
        message.revision,
        message.staleness.ToNanoseconds() / 1_000_000_000,
    )


def counts_of(message: Any) -> PointCounts:
    return PointCounts(message.received, message.outside, message.duplicate, message.inside)


def info_of(message: Any) -> HullInfo:
    return HullInfo(
        message.hull_id,
        message.create_revision,
        message.revision,
        message.dimension,
        message.vertex_count,
        counts_of(message.counts),
        message.damaged,
    )


def _box_of(message: Any) -> npt.NDArray[np.float64] | None:
    if not message.HasField("box_min"):
        return None
    low, high = message.box_min, message.box_max
    return np.array([[low.x, low.y, low.z], [high.x, high.y, high.z]])


def _properties_of(message: Any) -> HullProperties | None:
    if not message.HasField("properties"):
        return None
    found = message.properties

    def vector(m: Any) -> npt.NDArray[np.float64]:
        return np.array([m.x, m.y, m.z])

    def tensor(m: Any) -> npt.NDArray[np.float64]:
        return np.array([[m.xx, m.xy, m.xz], [m.xy, m.yy, m.yz], [m.xz, m.yz, m.zz]])

    return HullProperties(
        BoundedValue(found.volume.value, found.volume.bound),
        BoundedValue(found.area.value, found.area.bound),
        vector(found.centroid),
        vector(found.centroid_bounds),
        tensor(found.inertia),
        tensor(found.inertia_bounds),
    )


def decode_created(data: bytes) -> CreatedHull:
    message = hull_pb2.CreateHullResponse.FromString(data)
    return CreatedHull(info_of(message.hull), message.created, header_of(message.header))


def decode_replaced(data: bytes) -> ReplacedHull:
    message = hull_pb2.ReplaceHullResponse.FromString(data)
    return ReplacedHull(
        info_of(message.hull),
        message.created,
        enum_or_zero(Durability, message.durability),
        header_of(message.header),
    )


def decode_hull(data: bytes, with_facets: bool, viewer: Viewer | None) -> Hull:
    message = hull_pb2.GetHullResponse.FromString(data)
    audit = Audit(message.audit.ok, message.audit.finding) if message.HasField("audit") else None
    return Hull(
        info_of(message.hull),
        message.edge_count if with_facets else None,
        message.facet_count if with_facets else None,
        _box_of(message),
        audit,
        header_of(message.header),
        _properties_of(message),
        viewer,
    )


def decode_changes(data: bytes) -> HullChanges:
    message = hull_pb2.WatchHullsResponse.FromString(data)
    events = tuple(
        HullEvent(
            enum_or_zero(HullEventKind, event.kind),
            info_of(event.hull),
            _box_of(event),
            event.is_body,
            event.piece_count,
        )
        for event in message.events
    )
    return HullChanges(header_of(message.header), events, message.synced, message.restarted)


class MeshAssembly:
    """Assembles the parts of a mesh, and checks that they are consistent."""

    def __init__(self, viewer: Viewer | None) -> None:
        self._viewer = viewer
        self._header: Any = None
        self._arrays: defaultdict[str, list[npt.NDArray[Any]]] = defaultdict(list)

    def add(self, data: bytes) -> None:
        """ValueError: the message is of an unknown kind."""
        for part, value in named_fields(hull_pb2.GetHullMeshResponse, data):
            if part == "header":
                self._header = hull_pb2.MeshHeader.FromString(bytes(value))
                return
            kind = hull_pb2.MeshVertices if part == "vertices" else hull_pb2.MeshFacets
            for name, array in named_arrays(kind, value):
                self._arrays[name].append(array)
            return
        raise ValueError("the mesh stream contains a message of an unknown kind")

    def finish(self) -> HullMesh:
        """ValueError: the parts contradict each other."""
        if self._header is None:
            raise ValueError("the mesh stream ended without a header")
        head = self._header
        vertices = np.concatenate([np.empty(0), *self._arrays["xyz"]]).reshape(-1, 3)
        sizes, indices = (
            np.concatenate([np.empty(0), *self._arrays[name]]).astype(np.uint32)
            for name in ("sizes", "indices")
        )
        if len(vertices) != head.vertex_count or len(sizes) != head.facet_count:
            raise ValueError("the mesh stream ended early, or the counts of its header are wrong")
        if int(sizes.sum(dtype=np.uint64)) != len(indices):
            raise ValueError("the mesh stream's facet sizes and indices disagree")
        if indices.size and int(indices.max()) >= len(vertices):
            raise ValueError("the mesh stream refers to a vertex that it does not contain")
        error = head.error if head.HasField("error") else None
        return HullMesh(
            info_of(head.hull), vertices, sizes, indices, error, header_of(head.header), self._viewer
        )
