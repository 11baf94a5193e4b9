"""One function per call of the contract; each returns the request, the decoder, and True if the
call is safe to repeat."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Generic, Literal, TypeVar

import numpy as np
import numpy.typing as npt

from hulld import arguments
from hulld.answers import bodies, collision_messages, hulls, status
from hulld.answers.bodies import Body, BodyInfo, ReplacedBody
from hulld.answers.collisions import Collision, Method
from hulld.answers.hulls import CreatedHull, Header, Hull, HullChanges, HullInfo
from hulld.answers.status import ServerStatus
from hulld.calls.freshness import FIELD, Freshness
from hulld.calls.wanted import Wanted
from hulld.geometry.placements import Placements, as_integers
from hulld.geometry.points import point_block
from hulld.notebook import Viewer
from hulld.v1 import body_pb2, collision_pb2, geometry_pb2, hull_pb2, status_pb2
from hulld.wire import MessageWriter

T = TypeVar("T")


@dataclass(frozen=True)
class Call(Generic[T]):
    """method: gRPC's path. decode: raises ValueError for a malformed answer; bytes, for an answer
    in parts, which an assembly decodes."""

    method: str
    request: bytes
    decode: Callable[[bytes], T]
    safe_to_repeat: bool


def method_path(service: str, name: str) -> str:
    """gRPC's path of a call, as in "/hulld.v1.HullService/GetHull". KeyError: not in the
    contract."""
    for module in (hull_pb2, body_pb2, collision_pb2, status_pb2):
        found = module.DESCRIPTOR.services_by_name.get(service)
        if found is not None:
            return f"/{found.full_name}/{found.methods_by_name[name].name}"
    raise KeyError(service)


APPEND_POINTS = method_path("HullService", "AppendPoints")
REPLACE_HULL = method_path("HullService", "ReplaceHull")
STREAM_COLLISIONS = method_path("CollisionService", "StreamCollisions")
WATCH_COLLISIONS = method_path("CollisionService", "WatchCollisions")
CHECK_HEALTH = "/grpc.health.v1.Health/Check"


def is_serving(answer: bytes) -> bool:
    """True if a HealthCheckResponse of grpc.health.v1 is SERVING: field 1 is 1."""
    return answer == b"\x08\x01"


def _call(
    service: str, name: str, request: Any, decode: Callable[[bytes], T], safe_to_repeat: bool
) -> Call[T]:
    """request: a message of the contract, or a MessageWriter."""
    is_writer = isinstance(request, MessageWriter)
    data = request.finish() if is_writer else request.SerializeToString()
    return Call(method_path(service, name), data, decode, safe_to_repeat)


def check_health() -> Call[bool]:
    return Call(CHECK_HEALTH, b"", is_serving, False)


def as_fresh(call: Call[T], freshness: Freshness | None) -> Call[T]:
    """Adds a freshness to a read."""
    if freshness is None:
        return call
    return replace(call, request=call.request + _freshness_field(freshness))


def _freshness_field(freshness: Freshness) -> bytes:
    if not isinstance(freshness, Freshness):
        raise TypeError(f"freshness is {freshness!r}; it must be a hulld.Freshness")
    return MessageWriter().message(FIELD, freshness.message().SerializeToString()).finish()


def create_hull(hull_id: str, if_absent: bool) -> Call[CreatedHull]:
    request = hull_pb2.CreateHullRequest(hull_id=arguments.hull_id(hull_id), if_absent=if_absent)
    return _call("HullService", "CreateHull", request, hulls.decode_created, if_absent)


def get_hull(
    hull_id: str, audit: bool, facets: bool, properties: bool, viewer: Viewer
) -> Call[Hull]:
    request = hull_pb2.GetHullRequest(
        hull_id=arguments.hull_id(hull_id),
        audit=audit,
        without_facets=not facets,
        properties=properties,
    )
    return _call(
        "HullService",
        "GetHull",
        request,
        lambda data: hulls.decode_hull(data, facets, viewer),
        True,
    )


def get_hull_mesh(
    hull_id: str,
    side: Literal["inside", "outside"] | None,
    max_vertices: int | None,
    max_error: float | None,
) -> Call[bytes]:
    request = hull_pb2.GetHullMeshRequest(hull_id=arguments.hull_id(hull_id))
    if side is None and (max_vertices is not None or max_error is not None):
        raise ValueError(
            'a simpler hull lies on one side of the hull: pass side="inside" or side="outside"'
        )
    if side is not None:
        if side not in ("inside", "outside"):
            raise ValueError(f'side is {side!r}; it must be "inside" or "outside"')
        request.simplification.side = (
            hull_pb2.SIMPLIFICATION_SIDE_INSIDE
            if side == "inside"
            else hull_pb2.SIMPLIFICATION_SIDE_OUTSIDE
        )
        if max_vertices is None and max_error is None:
            raise ValueError("side requires max_vertices or max_error")
        request.simplification.max_vertices = (
            arguments.optional_count(max_vertices, "max_vertices", minimum=1) or 0
        )
        request.simplification.max_error = arguments.optional_length(max_error, "max_error") or 0.0
    return _call("HullService", "GetHullMesh", request, bytes, True)


@dataclass(frozen=True)
class Page(Generic[T]):
    """One page of a list; next_page: empty on the last."""

    items: Sequence[T]
    next_page: str
    header: Header


def _page_of(items: Sequence[T], message: Any, page_token: str) -> Page[T]:
    if message.next_page_token and message.next_page_token == page_token:
        raise ValueError("the server returned the same page token twice")
    return Page(items, message.next_page_token, hulls.header_of(message.header))


def _choose_page(request: Any, prefix: str, page_size: int, page_token: str) -> None:
    request.prefix = arguments.text(prefix, "prefix")
    request.page_size = arguments.count(page_size, "page_size")
    request.page_token = page_token


def list_hulls(prefix: str, page_size: int, page_token: str) -> Call[Page[HullInfo]]:
    def decode(data: bytes) -> Page[HullInfo]:
        message = hull_pb2.ListHullsResponse.FromString(data)
        return _page_of([hulls.info_of(hull) for hull in message.hulls], message, page_token)

    request = hull_pb2.ListHullsRequest()
    _choose_page(request, prefix, page_size, page_token)
    return _call("HullService", "ListHulls", request, decode, True)


def delete_hull(hull_id: str, if_revision: int | None) -> Call[Header]:
    def decode(data: bytes) -> Header:
        return hulls.header_of(hull_pb2.DeleteHullResponse.FromString(data).header)

    request = hull_pb2.DeleteHullRequest(
        hull_id=arguments.hull_id(hull_id), if_revision=arguments.revision(if_revision)
    )
    # A repeated delete could remove a new hull of the same ID.
    return _call("HullService", "DeleteHull", request, decode, False)


def _put_pose(target: Any, numbers: npt.NDArray[np.float64]) -> None:
    """Fills a Pose of the contract."""
    w, x, y, z, tx, ty, tz = numbers.tolist()
    target.rotation.CopyFrom(geometry_pb2.Quaternion(w=w, x=x, y=y, z=z))
    target.translation.CopyFrom(geometry_pb2.Vector3(x=tx, y=ty, z=tz))


def _put_placement(target: Any, placements: Placements, index: int) -> None:
    """Fills a Placement of the contract."""
    subject = placements.subject(index)
    if isinstance(subject, str):
        target.hull_id = subject
    else:
        target.points.MergeFromString(point_block(subject).finish())
    target.radius = placements.radius(index)
    _put_pose(target.pose, placements.poses[index])
    if placements.end_poses is not None:
        _put_pose(target.end_pose, placements.end_poses[index])


def put_body(body_id: str, pieces: Placements, if_revision: int | None) -> Call[ReplacedBody]:
    request = body_pb2.PutBodyRequest(
        body_id=arguments.hull_id(body_id, "body_id"), if_revision=arguments.revision(if_revision)
    )
    if not len(pieces):
        raise ValueError("pieces is empty; a body has at least one")
    if pieces.shapes:
        raise ValueError("pieces has points; a piece is a registered hull, so pass its ID")
    for index in range(len(pieces)):
        _put_placement(request.pieces.add(), pieces, index)
    # Putting the same pieces twice is idempotent, unless it depends on the revision.
    return _call("BodyService", "PutBody", request, bodies.decode_replaced, if_revision is None)


def get_body(body_id: str) -> Call[Body]:
    request = body_pb2.GetBodyRequest(body_id=arguments.hull_id(body_id, "body_id"))
    return _call("BodyService", "GetBody", request, bodies.decode_body, True)


def list_bodies(prefix: str, page_size: int, page_token: str) -> Call[Page[BodyInfo]]:
    def decode(data: bytes) -> Page[BodyInfo]:
        message = body_pb2.ListBodiesResponse.FromString(data)
        return _page_of([bodies.info_of(body) for body in message.bodies], message, page_token)

    request = body_pb2.ListBodiesRequest()
    _choose_page(request, prefix, page_size, page_token)
    return _call("BodyService", "ListBodies", request, decode, True)


def delete_body(body_id: str, if_revision: int | None) -> Call[Header]:
    request = body_pb2.DeleteBodyRequest(
        body_id=arguments.hull_id(body_id, "body_id"), if_revision=arguments.revision(if_revision)
    )
    return _call("BodyService", "DeleteBody", request, bodies.decode_deleted, False)


def watch_hulls(
    prefix: str, hull_id: str | None, with_bodies: bool, after: Header | None
) -> Call[HullChanges]:
    if after is not None:
        arguments.header(after, "after")
    request = hull_pb2.WatchHullsRequest(
        prefix=arguments.text(prefix, "prefix"),
        hull_id="" if hull_id is None else arguments.hull_id(hull_id),
        bodies=with_bodies,
        after_revision=after.revision if after else 0,
        store_id=after.store_id if after else "",
    )
    return _call("HullService", "WatchHulls", request, hulls.decode_changes, True)


def get_status() -> Call[ServerStatus]:
    return Call(method_path("StatusService", "GetStatus"), b"", status.decode_status, True)


def check_collision(
    pair: Placements, wanted: Wanted, tolerance: float, method: Method, viewer: Viewer
) -> Call[Collision]:
    request = collision_pb2.CheckCollisionRequest(
        method=collision_pb2.Method.Name(int(method)),
        tolerance=arguments.length(tolerance, "tolerance"),
        wanted=wanted.message(),
    )
    for index, target in enumerate((request.a, request.b)):
        _put_placement(target, pair, index)
    return _call(
        "CollisionService",
        "CheckCollision",
        request,
        lambda data: collision_messages.decode_collision(data, pair, viewer),
        True,
    )


def check_collisions(
    placements: Placements,
    pairs: npt.NDArray[np.uint32],
    wanted: Wanted,
    tolerance: float,
    method: Method,
) -> Call[bytes]:
    fixed = collision_pb2.BatchCheckCollisionsRequest(
        method=collision_pb2.Method.Name(int(method)),
        wanted=wanted.message(),
        tolerance=arguments.length(tolerance, "tolerance"),
    )
    request = (
        MessageWriter()
        .raw(fixed.SerializeToString())
        .uint32s(2, pairs)
        .message(6, placements.packed())
    )
    return _call("CollisionService", "BatchCheckCollisions", request, bytes, True)


@dataclass(frozen=True)
class SceneFilter:
    """Like the keyword arguments of Client.find_collisions."""

    groups: npt.ArrayLike | None
    ignore_same_group: bool
    ignored_group_pairs: npt.ArrayLike | None
    movers: int | None

    def put(self, message: Any, placements: int) -> None:
        """Fills the fields of the same names. placements: the number of placements."""
        if self.groups is not None:
            groups = _group_numbers(self.groups, "groups")
            if groups.shape != (placements,):
                raise ValueError(
                    f"groups has the shape {groups.shape}; expected one group for each of "
                    f"{placements} placements"
                )
            message.groups.extend(groups.tolist())
        elif self.ignore_same_group or self.ignored_group_pairs is not None:
            raise ValueError("ignore_same_group and ignored_group_pairs need groups")
        message.ignore_same_group = self.ignore_same_group
        if self.ignored_group_pairs is not None:
            pairs = _group_numbers(self.ignored_group_pairs, "ignored_group_pairs")
            if pairs.size and (pairs.ndim != 2 or pairs.shape[1] != 2):
                raise ValueError(
                    f"ignored_group_pairs has the shape {pairs.shape}; expected (k, 2), two groups "
                    "in each row"
                )
            message.ignored_group_pairs.extend(pairs.reshape(-1).tolist())
        if self.movers is not None:
            message.movers = arguments.count(self.movers, "movers")


def _group_numbers(values: npt.ArrayLike, name: str) -> npt.NDArray[Any]:
    array = as_integers(values, name)
    if array.size and not (array.min() >= 0 and array.max() < 2**32):
        raise ValueError(f"{name} has numbers outside 0 to 2^32 - 1")
    return array


def find_collisions(
    placements: Placements,
    scene: SceneFilter,
    wanted: Wanted,
    limit: int | None,
    tolerance: float,
    first_only: bool = False,
    every_piece: bool = False,
) -> Call[bytes]:
    fixed = collision_pb2.FindCollisionsRequest(
        wanted=wanted.message(),
        limit=arguments.optional_count(limit, "limit", minimum=1),
        tolerance=arguments.length(tolerance, "tolerance"),
        first_only=first_only,
        every_piece=every_piece,
    )
    scene.put(fixed, len(placements))
    request = MessageWriter().raw(fixed.SerializeToString()).message(8, placements.packed())
    return _call("CollisionService", "FindCollisions", request, bytes, True)


def open_stream(
    placements: Placements,
    pairs: npt.NDArray[np.uint32],
    wanted: Wanted,
    tolerance: float,
    only_changes: bool,
    freshness: Freshness | None,
) -> bytes:
    """The first message of StreamCollisions."""
    fixed = collision_pb2.CollisionStreamOpen(
        wanted=wanted.message(),
        tolerance=arguments.length(tolerance, "tolerance"),
        only_changes=only_changes,
    )
    opening = (
        MessageWriter()
        .raw(fixed.SerializeToString())
        .uint32s(2, pairs)
        .message(6, placements.packed())
    )
    if freshness is not None:
        opening.raw(_freshness_field(freshness))
    return MessageWriter().message(1, opening).finish()


def update_stream(
    placements: npt.NDArray[np.uint32], poses: npt.NDArray[np.float64], refresh_hulls: bool
) -> bytes:
    """A later message of StreamCollisions, or, without refresh_hulls, of WatchCollisions."""
    update = MessageWriter().uint32s(1, placements).doubles(2, poses)
    if refresh_hulls:
        update.raw(b"\x18\x01")  # field 3, true
    return MessageWriter().message(2, update).finish()


def open_watch(
    placements: Placements,
    pairs: npt.NDArray[np.uint32] | None,
    scene: SceneFilter,
    clearance: float | None,
) -> bytes:
    """The first message of WatchCollisions."""
    fixed = collision_pb2.CollisionWatchOpen(
        clearance=arguments.optional_length(clearance, "clearance")
    )
    scene.put(fixed, len(placements))
    opening = MessageWriter().raw(fixed.SerializeToString()).message(2, placements.packed())
    if pairs is not None:
        opening.uint32s(3, pairs)
    return MessageWriter().message(1, opening).finish()


def open_replacement(hull_id: str, create: bool, if_revision: int | None) -> bytes:
    """The first message of ReplaceHull."""
    return bytes(
        hull_pb2.ReplaceHullRequest(
            open=hull_pb2.ReplaceOpen(
                hull_id=arguments.hull_id(hull_id),
                create_if_absent=create,
                if_revision=arguments.revision(if_revision),
            )
        ).SerializeToString()
    )


def replacement_points(block: MessageWriter) -> bytes:
    """A later message of ReplaceHull; an empty block completes the replacement."""
    return MessageWriter().message(2, block).finish()
