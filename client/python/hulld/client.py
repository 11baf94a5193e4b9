"""The client."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal, cast

import numpy as np
import numpy.typing as npt

from hulld import arguments
from hulld.answers.assembly import BatchAssembly, SceneAssembly
from hulld.answers.bodies import Body, BodyInfo, ReplacedBody
from hulld.answers.collisions import Batch, Collision, Method, Scene
from hulld.answers.containment import (
    Containment,
    PointQuery,
    collect,
    points_per_call,
    require_answers,
)
from hulld.answers.hits import Hits, hits_of
from hulld.answers.hulls import (
    CreatedHull,
    Header,
    Hull,
    HullInfo,
    HullMesh,
    MeshAssembly,
    ReplacedHull,
    decode_replaced,
)
from hulld.answers.status import ServerStatus
from hulld.appender import Appender
from hulld.calls import requests
from hulld.calls.append_state import DEFAULT_CHUNK_BYTES, Appended, AppendState, pieces
from hulld.calls.freshness import Freshness
from hulld.calls.reported_pairs import WatchedPlacements
from hulld.calls.requests import SceneFilter
from hulld.calls.transport import PointsSource, each, invoke, is_iterator
from hulld.calls.wanted import Wanted
from hulld.client_base import ClientBase
from hulld.collision_stream import CollisionStream
from hulld.errors import HulldError, error_class, read_answer
from hulld.geometry.placements import (
    PlacementLike,
    Placements,
    PlacementsLike,
    Subject,
    all_pairs,
    as_moving,
    as_pairs,
    as_placement,
)
from hulld.geometry.points import PointsLike, as_points, chunks_of, point_block
from hulld.geometry.poses import ORTHOGONALITY_TOLERANCE, PoseLike
from hulld.geometry.rays import ray_ends, with_rays
from hulld.watches import CollisionWatch, HullWatch
from hulld.wire import MessageWriter

DEFAULT_IN_FLIGHT_BYTES = 8 << 20
DEFAULT_IN_FLIGHT_CHUNKS = 64


class Client(ClientBase):
    """A connection to hulld, opened by the first call. Thread-safe. As a context manager, it closes
    the connection.

    server: HOST:PORT, with 50551 as the default port; several servers over one store, called in
    turn, such as "10.0.0.1:50551,10.0.0.2:50551" or "dns:///hulls.example:50551"; or any other gRPC
    target name, such as "unix:/run/hulld.sock". timeout: seconds for each call, including retries;
    None: unbounded. Each method can override it. For appenders and collision streams, it bounds
    each wait; for watches, the time to reconnect to a lost server. retry: see RetryPolicy. tls:
    encrypts the connection. token: sent with each call, but never unencrypted to another machine
    unless `insecure` allows it.

    freshness: the required freshness of reads when several servers share a store (see Freshness);
    None: an answer includes everything acknowledged before the call.

    Calls raise HulldError (see hulld.errors) if the server refuses them or cannot be reached, and
    ValueError or TypeError if an argument is wrong, before anything is sent. All are safe to repeat
    except delete_hull, delete_body, create_hull without if_absent, put_body with if_revision,
    replace_hull, and collision streams; these are sent only once. Numbers are never changed in
    transit: the server receives the doubles of an array, and answers contain the doubles that it
    sent. orthogonality_tolerance, in calls with poses: the largest entry of R Rᵀ - I that is
    accepted in a matrix; float32 matrices need 1e-6.

    A process that is forked while a client is open cannot make any calls.
    """

    # --- The server ---

    def get_status(self, *, timeout: float | None = None) -> ServerStatus:
        """Version, uptime, sizes, and limits of the server."""
        return self._unary(requests.get_status(), timeout)

    def check_health(self, *, timeout: float | None = None) -> bool:
        """True if the server reports that it is serving; needs no token. Not retried.
        UnavailableError: it cannot be reached."""
        return self._unary(requests.check_health(), timeout)

    # --- Hulls ---

    def create_hull(
        self, hull_id: str, *, if_absent: bool = False, timeout: float | None = None
    ) -> CreatedHull:
        """Registers an empty hull. if_absent: returns an existing hull unchanged, which makes the
        call safe to repeat.

        AlreadyExistsError: the hull exists. ResourceExhaustedError: the server is full.
        """
        return self._unary(requests.create_hull(hull_id, if_absent), timeout)

    def append_points(
        self,
        hull_id: str,
        points: PointsSource,
        *,
        create: bool = False,
        writer_id: str | None = None,
        if_revision: int | None = None,
        chunk_bytes: int = DEFAULT_CHUNK_BYTES,
        timeout: float | None = None,
    ) -> Appended:
        """Adds points to a hull, and returns when they are committed.

        points: n x 3, the caller's length unit; or an iterator of such arrays, which are sent as
        they arrive. float64 and float32 are sent unchanged. All numbers must be finite and
        unmasked. create: creates the hull if it does not exist. writer_id: names the writer and
        continues its numbering of chunks. if_revision: appends only if the hull is at this
        revision; all points must then fit in one chunk of chunk_bytes. A lost connection is
        reopened, and each chunk is applied exactly once, entirely or not at all. If this raises,
        earlier chunks remain committed: use Appender to find out how many.

        ValueError: not points. NotFoundError: no such hull. AbortedError: if_revision does not
        match.
        """
        if not is_iterator(points):
            # Before the hull is created.
            pieces(cast(PointsLike, points), if_revision, chunk_bytes)
        with self.open_append(
            hull_id, create=create, writer_id=writer_id, timeout=timeout
        ) as appender:
            for array in each(points):
                appender.append(array, if_revision=if_revision, chunk_bytes=chunk_bytes)
            return appender.finish()

    def open_append(
        self,
        hull_id: str,
        *,
        create: bool = False,
        writer_id: str | None = None,
        max_in_flight_bytes: int = DEFAULT_IN_FLIGHT_BYTES,
        max_in_flight_chunks: int = DEFAULT_IN_FLIGHT_CHUNKS,
        timeout: float | None = None,
    ) -> Appender:
        """Opens a stream of chunks into a hull. Unacknowledged chunks are kept for resending;
        `append` waits while either bound is reached. For a named writer, `opened.last_sequence` is
        the number of its committed chunks. NotFoundError: no such hull, without `create`."""
        state = AppendState(hull_id, writer_id, create, max_in_flight_bytes, max_in_flight_chunks)
        seconds = self._seconds(timeout)
        call = self._channel.call("stream_stream", requests.APPEND_POINTS)
        return Appender(call, self._connection.metadata(), state, self._retry, seconds)

    def replace_hull(
        self,
        hull_id: str,
        points: PointsSource,
        *,
        create: bool = False,
        if_revision: int | None = None,
        chunk_bytes: int = DEFAULT_CHUNK_BYTES,
        timeout: float | None = None,
    ) -> ReplacedHull:
        """Replaces a hull with the hull of the points, atomically for all readers. points, create:
        as in append_points; if an iterator raises, nothing is changed. Unbounded in time unless
        `timeout` is given; not retried.

        NotFoundError: no such hull. AbortedError: if_revision (0: no hull) does not match at the
        end.
        """
        if not is_iterator(points):
            points = as_points(cast(PointsLike, points))
        opening = requests.open_replacement(hull_id, create, if_revision)
        bytes_of_chunk = arguments.count(chunk_bytes, "chunk_bytes", minimum=1)
        seconds = arguments.seconds(timeout)
        failure: list[Exception] = []

        def messages() -> Iterator[bytes]:
            try:
                yield opening
                for array in each(points):
                    for chunk in chunks_of(as_points(array), bytes_of_chunk):
                        yield requests.replacement_points(point_block(chunk))
                yield requests.replacement_points(MessageWriter())
            except Exception as error:
                # The stream then ends without the last message, and the server changes nothing.
                failure.append(error)

        call = self._channel.call("stream_unary", requests.REPLACE_HULL)
        try:
            answer = invoke(call, messages(), seconds, self._connection.metadata())
        except HulldError:
            if failure:
                raise failure[0] from None
            raise
        return read_answer(decode_replaced, answer)

    def get_hull(
        self,
        hull_id: str,
        *,
        audit: bool = False,
        facets: bool = True,
        properties: bool = False,
        freshness: Freshness | None = None,
        timeout: float | None = None,
    ) -> Hull:
        """Sizes, point counts, and bounding box of a hull. audit: the server also checks the hull
        with code that is independent of the builder. facets: False omits the counts of edges and
        facets, which require the canonical snapshot. properties: True adds volume, area, centroid,
        and inertia tensor. NotFoundError: no such hull.
        """
        call = requests.get_hull(hull_id, audit, facets, properties, self._viewer)
        return self._unary(call, timeout, freshness)

    def get_hull_mesh(
        self,
        hull_id: str,
        *,
        side: Literal["inside", "outside"] | None = None,
        max_vertices: int | None = None,
        max_error: float | None = None,
        freshness: Freshness | None = None,
        timeout: float | None = None,
    ) -> HullMesh:
        """The canonical vertices and facets of a hull or, with `side`, of a simpler hull that lies
        exactly inside it or encloses it.

        max_vertices: never exceeded; at least the dimension plus one inside, 8 outside. max_error:
        in the caller's length unit; met if the server finds a hull within both limits; otherwise
        check the mesh's `error`. `side` requires at least one of them. InvalidArgumentError: a
        bound that cannot be met. NotFoundError: no such hull.
        """
        call = requests.get_hull_mesh(hull_id, side, max_vertices, max_error)
        return self._whole(call, lambda: MeshAssembly(self._viewer), timeout, freshness)

    def list_hulls(
        self,
        prefix: str = "",
        *,
        page_size: int = 1000,
        freshness: Freshness | None = None,
        timeout: float | None = None,
    ) -> Iterator[HullInfo]:
        """The hulls with the ID prefix `prefix`, in byte order of their IDs, fetched page by page.
        A hull that exists throughout appears exactly once. `timeout` applies to each page."""
        return self._items(
            lambda token: requests.list_hulls(prefix, page_size, token), timeout, freshness
        )

    def delete_hull(
        self, hull_id: str, *, if_revision: int | None = None, timeout: float | None = None
    ) -> Header:
        """Deletes a hull. Not retried: a repeated delete could remove a new hull with the same ID.

        NotFoundError: no such hull. AbortedError: if_revision does not match.
        """
        return self._unary(requests.delete_hull(hull_id, if_revision), timeout)

    def watch_hulls(
        self,
        prefix: str = "",
        *,
        hull_id: str | None = None,
        bodies: bool = False,
        after: Header | None = None,
        timeout: float | None = None,
    ) -> HullWatch:
        """Reports hulls as they are created, changed, and deleted: all with the ID prefix `prefix`,
        or a single one by its ID. bodies: also reports bodies. after: resumes another watch of the
        same hulls at its `position`. timeout: time to reconnect to a lost server."""
        return HullWatch(
            lambda call: self._start(call, None),
            lambda position: requests.watch_hulls(prefix, hull_id, bodies, position),
            after,
            self._retry,
            self._seconds(timeout),
        )

    # --- Bodies ---

    def put_body(
        self,
        body_id: str,
        pieces: PlacementsLike,
        *,
        if_revision: int | None = None,
        orthogonality_tolerance: float = ORTHOGONALITY_TOLERANCE,
        timeout: float | None = None,
    ) -> ReplacedBody:
        """Creates a body, or replaces all of its pieces, atomically for all readers.

        pieces: hulls at poses in the frame of the body, in the form of placements; a hull need not
        exist yet, and each query uses its current state. A placement refers to a body by its ID,
        like a hull. if_revision: puts the body only if it is at this revision (0: only if it does
        not exist); such a call is not retried.

        ValueError: no piece. AlreadyExistsError: a hull has the ID. AbortedError: if_revision does
        not match. ResourceExhaustedError: more pieces, or hulls and bodies, than the server
        allows.
        """
        packed = Placements.of(pieces, orthogonality_tolerance=orthogonality_tolerance)
        return self._unary(requests.put_body(body_id, packed, if_revision), timeout)

    def get_body(
        self, body_id: str, *, freshness: Freshness | None = None, timeout: float | None = None
    ) -> Body:
        """The pieces of a body. NotFoundError: no such body."""
        return self._unary(requests.get_body(body_id), timeout, freshness)

    def list_bodies(
        self,
        prefix: str = "",
        *,
        page_size: int = 1000,
        freshness: Freshness | None = None,
        timeout: float | None = None,
    ) -> Iterator[BodyInfo]:
        """The bodies with the ID prefix `prefix`, without their pieces; otherwise as
        list_hulls."""
        return self._items(
            lambda token: requests.list_bodies(prefix, page_size, token), timeout, freshness
        )

    def delete_body(
        self, body_id: str, *, if_revision: int | None = None, timeout: float | None = None
    ) -> Header:
        """Deletes a body; the hulls of its pieces are kept. Not retried, like delete_hull.

        NotFoundError: no such body. AbortedError: if_revision does not match.
        """
        return self._unary(requests.delete_body(body_id, if_revision), timeout)

    # --- Pairs ---

    def check_collision(
        self,
        a: PlacementLike,
        b: PlacementLike,
        *,
        to_a: PoseLike = None,
        to_b: PoseLike = None,
        axis: bool = False,
        analysis: bool = False,
        certificate: bool = False,
        separation: bool = False,
        max_error: float | None = None,
        witness: bool = False,
        normal: bool = False,
        clearance: float | None = None,
        max_time_error: float | None = None,
        resolution: float | None = None,
        tolerance: float = 0.0,
        orthogonality_tolerance: float = ORTHOGONALITY_TOLERANCE,
        method: Method = Method.UNSPECIFIED,
        freshness: Freshness | None = None,
        timeout: float | None = None,
    ) -> Collision:
        """The relation of a pair: exact, for the doubles given.

        a, b: an ID, or the points of an inline shape (n x 3); either of them with a pose, as in
        (ID, pose); or a hulld.Placement. A pose is a 4 x 4 matrix, a quaternion and a translation,
        or a translation. Nothing beyond the relation is computed unless requested: axis (a
        separating or touching axis and the features on it), separation (the distance, or minus the
        penetration depth, with a proven bound of at most max_error), witness (a point of each hull
        at which the separation is attained), normal (the direction in which it is attained),
        clearance (an exact decision of separation <= clearance), certificate (the proof of the
        relation), analysis (time, sizes, axes tested). tolerance: allows WITHIN_TOLERANCE if
        |separation| is at most this, which is faster and never wrong. Lengths are in the caller's
        unit.

        to_a, to_b: end poses of motions (hulld.Placement). The answer then has first_contact, and
        certificate is the only option above that is allowed. max_time_error: the maximum width of
        its bracket. resolution: allows WITHIN_TOLERANCE if the smallest separation of a rotating
        motion is at most this.

        NotFoundError: no such hull. InvalidArgumentError: incompatible options.
        """
        wanted = Wanted(
            axis,
            analysis,
            certificate,
            separation,
            max_error,
            witness,
            clearance,
            normal,
            max_time_error,
            resolution,
        )
        pair = Placements.of(
            [as_moving(a, to_a), as_moving(b, to_b)],
            orthogonality_tolerance=orthogonality_tolerance,
        )
        call = requests.check_collision(pair, wanted, tolerance, method, self._viewer)
        return self._unary(call, timeout, freshness)

    def check_collisions(
        self,
        placements: PlacementsLike,
        pairs: npt.ArrayLike | None = None,
        *,
        axis: bool = False,
        analysis: bool = False,
        certificate: bool = False,
        separation: bool = False,
        max_error: float | None = None,
        witness: bool = False,
        normal: bool = False,
        clearance: float | None = None,
        max_time_error: float | None = None,
        resolution: float | None = None,
        tolerance: float = 0.0,
        orthogonality_tolerance: float = ORTHOGONALITY_TOLERANCE,
        method: Method = Method.UNSPECIFIED,
        freshness: Freshness | None = None,
        timeout: float | None = None,
    ) -> Batch:
        """The relations of many pairs, in parallel (BatchCheckCollisions).

        placements: hulld.Placements, or a list of placements as in check_collision. pairs: m x 2
        indices of placements; None: all pairs. Other arguments are as in check_collision; if a
        placement has an end pose, the answers have contact_times and separated_until. A pair
        without an answer does not fail the call: its relation is UNSPECIFIED, and Batch.problem
        returns the reason.
        """
        packed = Placements.of(placements, orthogonality_tolerance=orthogonality_tolerance)
        asked = all_pairs(len(packed)) if pairs is None else as_pairs(pairs, len(packed))
        wanted = Wanted(
            axis,
            analysis,
            certificate,
            separation,
            max_error,
            witness,
            clearance,
            normal,
            max_time_error,
            resolution,
        )
        call = requests.check_collisions(packed, asked, wanted, tolerance, method)
        return self._whole(call, lambda: BatchAssembly(asked, wanted), timeout, freshness)

    def contains(
        self,
        points: PointsLike,
        hull: Subject,
        *,
        pose: PoseLike = None,
        separation: bool = False,
        max_error: float | None = None,
        orthogonality_tolerance: float = ORTHOGONALITY_TOLERANCE,
        freshness: Freshness | None = None,
        timeout: float | None = None,
    ) -> Containment:
        """Finds the points that are inside a hull or body, on its boundary, or outside. The answer
        is exact for the doubles given.

        points: n x 3, in the world frame. hull: an ID, or the points of an inline shape. pose: the
        pose of the hull in the world. separation, max_error: as in check_collision; the separation
        is the distance of a point outside, or minus the depth of a point inside. A point where two
        pieces of a body meet counts as on the boundary. The points are sent in as few calls as the
        server's limits permit. Each call uses the current version of the hull and has its own
        `timeout`.

        NotFoundError: no such hull.
        """
        array = as_points(points)
        query = PointQuery(as_placement((hull, pose)), orthogonality_tolerance)
        separation = separation or max_error is not None
        status = self.get_status(timeout=timeout)
        rows = points_per_call(status.limits)
        parts = []
        for first in range(0, len(array), rows):
            packed, pairs = query.pairs(array[first : first + rows])
            batch = self.check_collisions(
                packed,
                pairs,
                separation=separation,
                max_error=max_error,
                freshness=freshness,
                timeout=timeout,
            )
            parts.append(require_answers(batch, first))
        return collect(parts, separation)

    def cast(
        self,
        origins: npt.ArrayLike,
        directions: npt.ArrayLike,
        placements: PlacementsLike,
        *,
        orthogonality_tolerance: float = ORTHOGONALITY_TOLERANCE,
        freshness: Freshness | None = None,
        timeout: float | None = None,
    ) -> Hits:
        """The hits of rays: exact, including grazes, unless a placement has a radius or rotates. A
        ray is a point that moves from its origin to origin + direction (rounded), so the length of
        the direction is that of the ray.

        origins, directions: n x 3; either may have shape (3,), for all rays. placements: as in
        check_collisions. Groups of pairs that are far apart are skipped together, as in
        find_collisions.

        HulldError: a placement has no answer, for example because its hull does not exist.
        """
        targets = Placements.of(placements, orthogonality_tolerance=orthogonality_tolerance)
        starts, ends = ray_ends(origins, directions)
        groups = np.repeat([0, 1], [len(starts), len(targets)])
        among_rays = SceneFilter(groups, False, [(0, 0)], len(starts))
        wanted = Wanted(certificate=True)
        moving = with_rays(targets, starts, ends)
        call = requests.find_collisions(moving, among_rays, wanted, None, 0.0)
        found = self._whole(call, lambda: SceneAssembly(wanted), timeout, freshness)
        for problem in (*found.placement_problems.values(), *found.answers.problems.values()):
            raise error_class(problem.code)(
                problem.message, code=problem.code, reason=problem.reason
            )
        return hits_of(found, starts, ends)

    def find_collisions(
        self,
        placements: PlacementsLike,
        *,
        groups: npt.ArrayLike | None = None,
        ignore_same_group: bool = False,
        ignored_group_pairs: npt.ArrayLike | None = None,
        movers: int | None = None,
        axis: bool = False,
        analysis: bool = False,
        certificate: bool = False,
        separation: bool = False,
        max_error: float | None = None,
        witness: bool = False,
        normal: bool = False,
        clearance: float | None = None,
        max_time_error: float | None = None,
        resolution: float | None = None,
        limit: int | None = None,
        first_only: bool = False,
        every_piece: bool = False,
        tolerance: float = 0.0,
        orthogonality_tolerance: float = ORTHOGONALITY_TOLERANCE,
        freshness: Freshness | None = None,
        timeout: float | None = None,
    ) -> Scene:
        """The pairs of a scene that collide or are within a clearance or tolerance. Groups of pairs
        that are far apart are skipped together.

        groups: the group of each placement; with ignore_same_group, pairs within a group are
        skipped, and so are pairs between two groups listed in ignored_group_pairs (k x 2). movers:
        only pairs with at least one of the first `movers` placements. Other arguments are as in
        check_collisions; with a clearance, all pairs within it are found. limit: returns at most
        this many pairs, those with the smallest separation, nearest first, with their separations;
        without a clearance, chosen from all pairs. The totals still count every pair within the
        clearance. Pairs without an answer follow, at most the same number. first_only: returns only
        the pairs in motion that may be the first to touch, in ascending order of separated_until;
        none if no pair touches. The totals then count these pairs only. max_time_error and
        resolution apply to each pair in motion, as in check_collision. every_piece: returns a row
        for each pair of pieces that is found; the column `pieces` distinguishes the rows of two
        bodies.
        """
        packed = Placements.of(placements, orthogonality_tolerance=orthogonality_tolerance)
        scene = SceneFilter(groups, ignore_same_group, ignored_group_pairs, movers)
        wanted = Wanted(
            axis,
            analysis,
            certificate,
            separation,
            max_error,
            witness,
            clearance,
            normal,
            max_time_error,
            resolution,
        ).for_limit(limit)
        call = requests.find_collisions(
            packed, scene, wanted, limit, tolerance, first_only, every_piece
        )
        return self._whole(call, lambda: SceneAssembly(wanted), timeout, freshness)

    def stream_collisions(
        self,
        placements: PlacementsLike,
        pairs: npt.ArrayLike | None = None,
        *,
        only_changes: bool = False,
        axis: bool = False,
        analysis: bool = False,
        certificate: bool = False,
        separation: bool = False,
        max_error: float | None = None,
        witness: bool = False,
        normal: bool = False,
        clearance: float | None = None,
        tolerance: float = 0.0,
        orthogonality_tolerance: float = ORTHOGONALITY_TOLERANCE,
        freshness: Freshness | None = None,
        timeout: float | None = None,
    ) -> CollisionStream:
        """Opens a stream of pose changes. The first answer contains every pair.

        only_changes: later answers contain only the pairs whose relation changed. The
        orthogonality_tolerance also applies to updates, and the timeout to each answer. Other
        arguments are as in check_collisions.
        """
        packed = Placements.of(placements, orthogonality_tolerance=orthogonality_tolerance)
        asked = all_pairs(len(packed)) if pairs is None else as_pairs(pairs, len(packed))
        wanted = Wanted(
            axis, analysis, certificate, separation, max_error, witness, clearance, normal
        )
        opening = requests.open_stream(packed, asked, wanted, tolerance, only_changes, freshness)
        seconds = self._seconds(timeout)
        return CollisionStream(
            self._channel.call("stream_stream", requests.STREAM_COLLISIONS),
            self._connection.metadata(),
            opening,
            len(packed),
            asked,
            wanted,
            orthogonality_tolerance,
            seconds,
        )

    def watch_collisions(
        self,
        placements: PlacementsLike,
        pairs: npt.ArrayLike | None = None,
        *,
        groups: npt.ArrayLike | None = None,
        ignore_same_group: bool = False,
        ignored_group_pairs: npt.ArrayLike | None = None,
        movers: int | None = None,
        clearance: float | None = None,
        orthogonality_tolerance: float = ORTHOGONALITY_TOLERANCE,
        timeout: float | None = None,
    ) -> CollisionWatch:
        """Reports when pairs start and stop colliding, or being within a clearance, as poses and
        hulls change. pairs: m x 2 indices of placements; None: a scene, with groups and movers as
        in find_collisions. orthogonality_tolerance: also applies to all updates."""
        packed = Placements.of(placements, orthogonality_tolerance=orthogonality_tolerance)
        asked = None if pairs is None else as_pairs(pairs, len(packed))
        scene = SceneFilter(groups, ignore_same_group, ignored_group_pairs, movers)
        watched = WatchedPlacements(packed, asked, scene, clearance, orthogonality_tolerance)
        seconds = self._seconds(timeout)
        return CollisionWatch(
            self._channel.call("stream_stream", requests.WATCH_COLLISIONS),
            self._connection.metadata(),
            watched,
            self._retry,
            seconds,
        )
