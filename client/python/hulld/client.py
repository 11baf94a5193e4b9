"""The client, synchronous."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

import grpc
import numpy.typing as npt

from hulld.answers.assembly import BatchAssembly, SceneAssembly
from hulld.answers.bodies import Body, BodyInfo, ReplacedBody
from hulld.answers.collisions import Batch, BatchPart, Collision, Method, Scene, ScenePart
from hulld.answers.hulls import (
    CreatedHull,
    Header,
    Hull,
    HullChanges,
    HullInfo,
    HullMesh,
    MeshPart,
    ReplacedHull,
    decode_replaced,
)
from hulld.answers.status import ServerStatus
from hulld.appender import Appender, chunks_to_send
from hulld.backup import Backup, BackupWriter
from hulld.calls import requests
from hulld.calls.append_state import DEFAULT_CHUNK_BYTES, Appended, AppendState
from hulld.calls.freshness import Freshness
from hulld.calls.requests import Call, SceneFilter
from hulld.calls.told_pairs import WatchedPlacements
from hulld.calls.wanted import Wanted
from hulld.client_base import ClientBase
from hulld.collision_stream import CollisionStream
from hulld.connection import PathLike
from hulld.errors import from_rpc_error, read_answer
from hulld.geometry.placements import PlacementLike, Placements, PlacementsLike, all_pairs, as_pairs
from hulld.geometry.points import PointsLike, as_points, chunks_of, point_block
from hulld.watches import CollisionWatch, HullWatch
from hulld.wire import MessageWriter

DEFAULT_IN_FLIGHT_BYTES = 8 << 20
DEFAULT_IN_FLIGHT_CHUNKS = 64


class Client(ClientBase):
    """A connection to hulld. Connects when first used; any thread may call it. A context manager,
    which closes it.

    server: HOST:PORT; several over one store, among which calls go round, as in
    "10.0.0.1:50551,10.0.0.2:50551" or "dns:///hulls.example:50551"; or any other target name of
    gRPC, as in "unix:/run/hulld.sock". timeout:
    seconds for each call, its retries included; None: no bound. Each method takes one of its own.
    For appenders and collision streams it bounds each wait instead, for watches the search for a
    server that was lost. retry: how often calls that are safe to repeat are
    repeated. tls: encrypts. token: sent with each call; never unencrypted to another machine,
    unless `insecure` allows it.

    freshness, of reads: how fresh the answer must be, where several servers serve one store (see
    Freshness); None: it holds everything that was acknowledged before the call.

    Calls raise HulldError (see hulld.errors) where the server refuses them or cannot be reached,
    and ValueError or TypeError where an argument is wrong, before anything is sent. All but
    delete_hull, delete_body, create_hull without if_absent, put_body with if_revision, replace_hull
    and save_backup are safe to repeat.
    Numbers are never changed on the way: the doubles of an array are those that the server gets,
    and those of an answer are those that it sent.
    """

    # --- The server ---

    def get_status(self, *, timeout: float | None = None) -> ServerStatus:
        """What runs, since when, how much it holds, and its limits."""
        return self._unary(requests.get_status(), timeout)

    def check_health(self, *, timeout: float | None = None) -> bool:
        """Whether the server says that it is serving; needs no token. Not retried.
        UnavailableError: it is not reached."""
        return self._unary(Call(requests.CHECK_HEALTH, b"", requests.is_serving, False), timeout)

    def save_backup(self, path: PathLike, *, timeout: float | None = None) -> Backup:
        """Saves a consistent copy of the whole store to one file, which `hullctl backup restore`
        makes a data directory of. The file gets its name only when it is complete and on disk.
        Takes the time that it needs unless `timeout` is given; not retried.
        FailedPreconditionError: the store is memory."""
        with BackupWriter(path) as writer:
            for part in self._received(requests.save_backup(), timeout):
                read_answer(writer.write, part)
            return read_answer(lambda _: writer.finish(), None)

    # --- Hulls ---

    def create_hull(
        self, hull_id: str, *, if_absent: bool = False, timeout: float | None = None
    ) -> CreatedHull:
        """Registers an empty hull. if_absent: an existing one is returned as it is, which makes the
        call safe to repeat.

        AlreadyExistsError: there is one. ResourceExhaustedError: the server holds as many as it
        may.
        """
        return self._unary(requests.create_hull(hull_id, if_absent), timeout)

    def append_points(
        self,
        hull_id: str,
        points: PointsLike | Iterator[PointsLike],
        *,
        create: bool = False,
        writer_id: str | None = None,
        if_revision: int | None = None,
        chunk_bytes: int = DEFAULT_CHUNK_BYTES,
        timeout: float | None = None,
    ) -> Appended:
        """Adds points to a hull, and returns when they are committed.

        points: n x 3, the caller's length unit; or an iterator of such arrays, which are sent as
        they come. float64 and float32 travel as they are. All must be finite. create: makes the
        hull when it does not exist. writer_id: names the writer; chunks of the same writer are
        numbered on, and skip nothing by themselves. if_revision: applied only if the hull is at
        this revision; then all points must fit one chunk of chunk_bytes. A connection that is lost
        is opened again, and each chunk is applied once; a chunk is applied wholly or not at all.
        When this raises, the chunks before stand: see Appender for how many.

        ValueError: not points. NotFoundError: no such hull. AbortedError: if_revision does not
        match.
        """
        chunks = chunks_to_send(points, if_revision, chunk_bytes)
        with self.open_append(
            hull_id, create=create, writer_id=writer_id, timeout=timeout
        ) as appender:
            appender.append_chunks(chunks, if_revision)
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
        """Opens a stream of chunks into a hull. Chunks sent but not acknowledged are kept for
        sending again; `append` waits while they reach either bound. A writer that names itself sees
        in `opened.last_sequence` how many of its chunks are committed. NotFoundError: no such hull,
        without `create`."""
        state = AppendState(hull_id, writer_id, create, max_in_flight_bytes, max_in_flight_chunks)
        call = self._channel.stream_stream(requests.APPEND_POINTS)
        return Appender(
            call, self._connection.metadata(), state, self._retry, self._seconds(timeout)
        )

    def replace_hull(
        self,
        hull_id: str,
        points: PointsLike | Iterator[PointsLike],
        *,
        create: bool = False,
        if_revision: int | None = None,
        chunk_bytes: int = DEFAULT_CHUNK_BYTES,
        timeout: float | None = None,
    ) -> ReplacedHull:
        """Puts the hull of the points in the place of another, at once for all readers. Points and
        create as in append_points; an iterator runs in a thread of gRPC, and where it raises,
        nothing is changed. Takes the time that it needs unless `timeout` is given; not retried.

        NotFoundError: no such hull. AbortedError: if_revision (0: there is none) does not match at
        the end.
        """
        arrays = [as_points(points)] if not isinstance(points, Iterator) else points
        failure: list[Exception] = []

        def messages() -> Iterator[bytes]:
            try:
                yield requests.open_replacement(hull_id, create, if_revision)
                for array in arrays:
                    for chunk in chunks_of(as_points(array), chunk_bytes):
                        yield requests.replacement_points(point_block(chunk))
                yield requests.replacement_points(MessageWriter())
            except Exception as error:
                # The stream then ends without the last message, and the server changes nothing.
                failure.append(error)

        stream = self._channel.stream_unary(requests.REPLACE_HULL)
        try:
            answer = stream(messages(), timeout=timeout, metadata=self._connection.metadata())
        except grpc.RpcError as error:
            if failure:
                raise failure[0] from None
            raise from_rpc_error(error) from None
        return read_answer(decode_replaced, answer)

    def get_hull(
        self,
        hull_id: str,
        *,
        audit: bool = False,
        facets: bool = True,
        freshness: Freshness | None = None,
        timeout: float | None = None,
    ) -> Hull:
        """Sizes, counts and box of a hull. audit: the server also checks it by means independent of
        the builder. facets: False leaves out the counts of edges and facets, which take the
        canonical hull. NotFoundError: no such hull.
        """
        return self._unary(
            requests.get_hull(hull_id, audit, facets, self._viewer), timeout, freshness
        )

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
        """The canonical vertices and facets of a hull; with `side` a simpler hull inside it, or one
        that encloses it, exactly.

        max_vertices: never exceeded; at least the dimension plus one inside, 8 outside. max_error:
        in the caller's length unit; kept where the server finds a hull within both, else look at
        the mesh's `error`. One of the two is needed with `side`. InvalidArgumentError: a bound that
        cannot be met. NotFoundError: no such hull.
        """
        return self._mesh(
            requests.get_hull_mesh(hull_id, side, max_vertices, max_error), timeout, freshness
        )

    def iter_hull_mesh(
        self,
        hull_id: str,
        *,
        side: Literal["inside", "outside"] | None = None,
        max_vertices: int | None = None,
        max_error: float | None = None,
        freshness: Freshness | None = None,
        timeout: float | None = None,
    ) -> Iterator[MeshPart]:
        """The same in parts of about 1 MiB, as they arrive: MeshHeader, then MeshVertices, then
        MeshFacets."""
        return self._parts(
            requests.get_hull_mesh(hull_id, side, max_vertices, max_error), timeout, freshness
        )

    def list_hulls(
        self,
        prefix: str = "",
        *,
        page_size: int = 1000,
        freshness: Freshness | None = None,
        timeout: float | None = None,
    ) -> Iterator[HullInfo]:
        """The hulls whose IDs start with `prefix`, in byte order of their IDs; fetched page by
        page. A hull present throughout appears exactly once. `timeout` is for each page."""
        token = ""
        while True:
            page = self._unary(requests.list_hulls(prefix, page_size, token), timeout, freshness)
            yield from page.hulls
            token = page.next_page
            freshness = freshness and freshness.for_next_page(page.header)
            if not token:
                return

    def delete_hull(
        self, hull_id: str, *, if_revision: int | None = None, timeout: float | None = None
    ) -> Header:
        """Removes a hull. Never retried: a repeated delete could remove one that someone has
        created anew.

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
        """Tells of hulls as they come, change and go: those whose IDs start with `prefix`, or one
        by its ID. bodies: tells of bodies, too. after: resumes another watch of the same, at its
        `position`. timeout: how long to look for a server that was lost.
        """

        def request(position: Header | None) -> Call[HullChanges]:
            return requests.watch_hulls(prefix, hull_id, bodies, position)

        return HullWatch(
            lambda call: self._start(call, None),
            request,
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
        timeout: float | None = None,
    ) -> ReplacedBody:
        """Creates a body, or replaces all of its pieces, at once for all readers.

        pieces: hulls at poses in the frame of the body, as placements elsewhere; a hull need not
        exist yet, and is taken as it is when a question is asked. Placements then name the body by
        its ID as if it was a hull. if_revision: put only if the body is at this revision; 0: only
        if there is none; such a call is not retried.

        InvalidArgumentError: no piece. AlreadyExistsError: a hull has the ID. AbortedError:
        if_revision does not match. ResourceExhaustedError: more pieces, or hulls and bodies, than
        the server takes.
        """
        return self._unary(requests.put_body(body_id, pieces, if_revision), timeout)

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
        """The bodies whose IDs start with `prefix`, without their pieces; as list_hulls."""
        token = ""
        while True:
            page = self._unary(requests.list_bodies(prefix, page_size, token), timeout, freshness)
            yield from page.bodies
            token = page.next_page
            freshness = freshness and freshness.for_next_page(page.header)
            if not token:
                return

    def delete_body(
        self, body_id: str, *, if_revision: int | None = None, timeout: float | None = None
    ) -> Header:
        """Removes a body; the hulls of its pieces stay. Never retried, as delete_hull.

        NotFoundError: no such body. AbortedError: if_revision does not match.
        """
        return self._unary(requests.delete_body(body_id, if_revision), timeout)

    # --- Pairs ---

    def check_collision(
        self,
        a: PlacementLike,
        b: PlacementLike,
        *,
        axis: bool = False,
        analysis: bool = False,
        certificate: bool = False,
        separation: bool = False,
        max_error: float | None = None,
        witness: bool = False,
        clearance: float | None = None,
        tolerance: float = 0.0,
        method: Method = Method.UNSPECIFIED,
        freshness: Freshness | None = None,
        timeout: float | None = None,
    ) -> Collision:
        """The relation of one pair: exact, for the doubles given.

        a, b: an ID, (ID, pose) or hulld.Placement; a pose is 4 x 4, a quaternion and a translation,
        or a translation. Nothing beyond the relation is computed unless asked for: axis (the
        separating or touching axis and the features on it), separation (the distance, or minus the
        penetration depth, with a proven bound, at most max_error), witness (a point of each hull
        that attain it), clearance (whether the separation is at most this; decided exactly),
        certificate (what proves the relation), analysis (time, sizes, axes tested). tolerance:
        allows WITHIN_TOLERANCE where |separation| is at most this; faster, never wrong. Lengths are
        in the caller's unit.

        NotFoundError: no such hull. InvalidArgumentError: a malformed ID or pose, or wishes that
        exclude each other.
        """
        wanted = Wanted(axis, analysis, certificate, separation, max_error, witness, clearance)
        return self._unary(
            requests.check_collision(a, b, wanted, tolerance, method, self._viewer),
            timeout,
            freshness,
        )

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
        clearance: float | None = None,
        tolerance: float = 0.0,
        method: Method = Method.UNSPECIFIED,
        freshness: Freshness | None = None,
        timeout: float | None = None,
    ) -> Batch:
        """The relations of many pairs, in parallel (BatchCheckCollisions).

        placements: hulld.Placements, or a list of what check_collision takes. pairs: m x 2 indices
        of placements; None: each two. The rest as in check_collision. A pair that cannot be
        answered does not fail the call: its relation is UNSPECIFIED, and Batch.problem tells why.
        Retried only while nothing was received.
        """
        packed = Placements.of(placements)
        asked = all_pairs(len(packed)) if pairs is None else as_pairs(pairs, len(packed))
        wanted = Wanted(axis, analysis, certificate, separation, max_error, witness, clearance)
        batch = BatchAssembly(asked, wanted)
        for data in self._received(
            requests.check_collisions(packed, asked, wanted, tolerance, method),
            self._seconds(timeout),
            freshness,
        ):
            read_answer(batch.add, data)
        return read_answer(lambda _: batch.finish(), None)

    def iter_check_collisions(
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
        clearance: float | None = None,
        tolerance: float = 0.0,
        method: Method = Method.UNSPECIFIED,
        freshness: Freshness | None = None,
        timeout: float | None = None,
    ) -> Iterator[BatchPart]:
        """The same in parts, as they arrive: ascending ranges that cover every pair once."""
        packed = Placements.of(placements)
        asked = all_pairs(len(packed)) if pairs is None else as_pairs(pairs, len(packed))
        wanted = Wanted(axis, analysis, certificate, separation, max_error, witness, clearance)
        return self._parts(
            requests.check_collisions(packed, asked, wanted, tolerance, method), timeout, freshness
        )

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
        clearance: float | None = None,
        tolerance: float = 0.0,
        freshness: Freshness | None = None,
        timeout: float | None = None,
    ) -> Scene:
        """The pairs of a scene that collide, or are within a clearance or tolerance. Pairs far
        apart are passed over in groups.

        groups: the group of each placement; with ignore_same_group, placements of one group are
        never asked about together, nor those of two groups that ignored_group_pairs (k x 2) names.
        movers: asks only about pairs with at least one of the first `movers` placements. The
        rest as in check_collisions; with a clearance, all pairs within it are found.
        """
        scene = SceneFilter(groups, ignore_same_group, ignored_group_pairs, movers)
        wanted = Wanted(axis, analysis, certificate, separation, max_error, witness, clearance)
        found = SceneAssembly(wanted)
        for data in self._received(
            requests.find_collisions(Placements.of(placements), scene, wanted, tolerance),
            self._seconds(timeout),
            freshness,
        ):
            read_answer(found.add, data)
        return read_answer(lambda _: found.finish(), None)

    def iter_find_collisions(
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
        clearance: float | None = None,
        tolerance: float = 0.0,
        freshness: Freshness | None = None,
        timeout: float | None = None,
    ) -> Iterator[ScenePart]:
        """The same in parts, as pairs are found: ascending, each pair once. The last part holds the
        totals."""
        scene = SceneFilter(groups, ignore_same_group, ignored_group_pairs, movers)
        wanted = Wanted(axis, analysis, certificate, separation, max_error, witness, clearance)
        return self._parts(
            requests.find_collisions(Placements.of(placements), scene, wanted, tolerance),
            timeout,
            freshness,
        )

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
        clearance: float | None = None,
        tolerance: float = 0.0,
        freshness: Freshness | None = None,
        timeout: float | None = None,
    ) -> CollisionStream:
        """Opens a stream of pose changes, and answers every pair once. only_changes: answers
        updates by the pairs whose relation changed alone. timeout: for each answer. The rest as in
        check_collisions."""
        packed = Placements.of(placements)
        asked = all_pairs(len(packed)) if pairs is None else as_pairs(pairs, len(packed))
        wanted = Wanted(axis, analysis, certificate, separation, max_error, witness, clearance)
        return CollisionStream(
            self._channel.stream_stream(requests.STREAM_COLLISIONS),
            self._connection.metadata(),
            packed,
            asked,
            wanted,
            tolerance,
            only_changes,
            freshness,
            self._seconds(timeout),
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
        timeout: float | None = None,
    ) -> CollisionWatch:
        """Tells when pairs begin and end to collide, or to be within a clearance, because poses or
        hulls change. pairs: m x 2 indices of placements; None: a scene, with groups and movers as
        in find_collisions."""
        packed = Placements.of(placements)
        asked = None if pairs is None else as_pairs(pairs, len(packed))
        scene = SceneFilter(groups, ignore_same_group, ignored_group_pairs, movers)
        return CollisionWatch(
            self._channel.stream_stream(requests.WATCH_COLLISIONS),
            self._connection.metadata(),
            WatchedPlacements(packed, asked, scene, clearance),
            self._retry,
            self._seconds(timeout),
        )
