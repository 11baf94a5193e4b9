"""The client, for asyncio."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Iterator
from typing import Literal, cast

import grpc
import numpy.typing as npt

from hulld.aio.appender import AsyncAppender
from hulld.aio.client_base import AsyncClientBase
from hulld.aio.collision_stream import AsyncCollisionStream
from hulld.aio.watches import AsyncCollisionWatch, AsyncHullWatch
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
from hulld.appender import chunks_to_send
from hulld.backup import Backup, BackupWriter
from hulld.calls import requests
from hulld.calls.append_state import DEFAULT_CHUNK_BYTES, Appended, AppendState
from hulld.calls.freshness import Freshness
from hulld.calls.requests import Call, SceneFilter
from hulld.calls.told_pairs import WatchedPlacements
from hulld.calls.wanted import Wanted
from hulld.client import DEFAULT_IN_FLIGHT_BYTES, DEFAULT_IN_FLIGHT_CHUNKS
from hulld.connection import PathLike
from hulld.errors import from_rpc_error, read_answer
from hulld.geometry.placements import PlacementLike, Placements, PlacementsLike, all_pairs, as_pairs
from hulld.geometry.points import PointsLike, as_points, chunks_of, point_block
from hulld.wire import MessageWriter


class AsyncClient(AsyncClientBase):
    """hulld.Client for asyncio: the same methods with the same arguments, answers and errors. Calls
    are awaited; lists, parts and watches are iterated by `async for`; streams are entered by `async
    with`. For one event loop.
    """

    # --- The server ---

    async def get_status(self, *, timeout: float | None = None) -> ServerStatus:
        """As Client.get_status."""
        return await self._unary(requests.get_status(), timeout)

    async def check_health(self, *, timeout: float | None = None) -> bool:
        """As Client.check_health."""
        return await self._unary(
            Call(requests.CHECK_HEALTH, b"", requests.is_serving, False), timeout
        )

    async def save_backup(self, path: PathLike, *, timeout: float | None = None) -> Backup:
        """As Client.save_backup."""
        with BackupWriter(path) as writer:
            async for part in self._received(requests.save_backup(), timeout):
                read_answer(writer.write, part)
            return read_answer(lambda _: writer.finish(), None)

    # --- Hulls ---

    async def create_hull(
        self, hull_id: str, *, if_absent: bool = False, timeout: float | None = None
    ) -> CreatedHull:
        """As Client.create_hull."""
        return await self._unary(requests.create_hull(hull_id, if_absent), timeout)

    async def append_points(
        self,
        hull_id: str,
        points: PointsLike | Iterator[PointsLike] | AsyncIterator[PointsLike],
        *,
        create: bool = False,
        writer_id: str | None = None,
        if_revision: int | None = None,
        chunk_bytes: int = DEFAULT_CHUNK_BYTES,
        timeout: float | None = None,
    ) -> Appended:
        """As Client.append_points; points may also be an asynchronous iterator."""
        iterated = isinstance(points, AsyncIterator)
        chunks = (
            iter(())
            if iterated
            else chunks_to_send(cast(PointsLike, points), if_revision, chunk_bytes)
        )
        async with self.open_append(
            hull_id, create=create, writer_id=writer_id, timeout=timeout
        ) as appender:
            await appender.append_chunks(chunks, if_revision)
            if isinstance(points, AsyncIterator):
                async for block in points:
                    await appender.append(block, if_revision=if_revision, chunk_bytes=chunk_bytes)
            return await appender.finish()

    def open_append(
        self,
        hull_id: str,
        *,
        create: bool = False,
        writer_id: str | None = None,
        max_in_flight_bytes: int = DEFAULT_IN_FLIGHT_BYTES,
        max_in_flight_chunks: int = DEFAULT_IN_FLIGHT_CHUNKS,
        timeout: float | None = None,
    ) -> AsyncAppender:
        """As Client.open_append; entering it, or its first `append`, opens it."""
        state = AppendState(hull_id, writer_id, create, max_in_flight_bytes, max_in_flight_chunks)
        call = self.channel.stream_stream(requests.APPEND_POINTS)
        return AsyncAppender(
            call, self._connection.metadata(), state, self._retry, self._seconds(timeout)
        )

    async def replace_hull(
        self,
        hull_id: str,
        points: PointsLike | Iterator[PointsLike] | AsyncIterator[PointsLike],
        *,
        create: bool = False,
        if_revision: int | None = None,
        chunk_bytes: int = DEFAULT_CHUNK_BYTES,
        timeout: float | None = None,
    ) -> ReplacedHull:
        """As Client.replace_hull; points may also be an asynchronous iterator."""
        arrays = points if isinstance(points, (Iterator, AsyncIterator)) else as_points(points)
        failure: list[Exception] = []

        async def messages() -> AsyncIterator[bytes]:
            try:
                yield requests.open_replacement(hull_id, create, if_revision)
                async for array in _blocks(arrays):
                    for chunk in chunks_of(as_points(array), chunk_bytes):
                        yield requests.replacement_points(point_block(chunk))
                yield requests.replacement_points(MessageWriter())
            except Exception as error:
                # The stream then ends without the last message, and the server changes nothing.
                failure.append(error)

        stream = self.channel.stream_unary(requests.REPLACE_HULL)
        try:
            answer = await stream(messages(), timeout=timeout, metadata=self._connection.metadata())
        except grpc.RpcError as error:
            if failure:
                raise failure[0] from None
            raise from_rpc_error(error) from None
        return read_answer(decode_replaced, answer)

    async def get_hull(
        self,
        hull_id: str,
        *,
        audit: bool = False,
        facets: bool = True,
        freshness: Freshness | None = None,
        timeout: float | None = None,
    ) -> Hull:
        """As Client.get_hull."""
        return await self._unary(
            requests.get_hull(hull_id, audit, facets, self._viewer), timeout, freshness
        )

    async def get_hull_mesh(
        self,
        hull_id: str,
        *,
        side: Literal["inside", "outside"] | None = None,
        max_vertices: int | None = None,
        max_error: float | None = None,
        freshness: Freshness | None = None,
        timeout: float | None = None,
    ) -> HullMesh:
        """As Client.get_hull_mesh."""
        return await self._mesh(
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
    ) -> AsyncIterator[MeshPart]:
        """As Client.iter_hull_mesh."""
        return self._parts(
            requests.get_hull_mesh(hull_id, side, max_vertices, max_error), timeout, freshness
        )

    async def list_hulls(
        self,
        prefix: str = "",
        *,
        page_size: int = 1000,
        freshness: Freshness | None = None,
        timeout: float | None = None,
    ) -> AsyncIterator[HullInfo]:
        """As Client.list_hulls."""
        token = ""
        while True:
            page = await self._unary(
                requests.list_hulls(prefix, page_size, token), timeout, freshness
            )
            for hull in page.hulls:
                yield hull
            token = page.next_page
            freshness = freshness and freshness.for_next_page(page.header)
            if not token:
                return

    async def delete_hull(
        self, hull_id: str, *, if_revision: int | None = None, timeout: float | None = None
    ) -> Header:
        """As Client.delete_hull."""
        return await self._unary(requests.delete_hull(hull_id, if_revision), timeout)

    def watch_hulls(
        self,
        prefix: str = "",
        *,
        hull_id: str | None = None,
        bodies: bool = False,
        after: Header | None = None,
        timeout: float | None = None,
    ) -> AsyncHullWatch:
        """As Client.watch_hulls."""

        def request(position: Header | None) -> Call[HullChanges]:
            return requests.watch_hulls(prefix, hull_id, bodies, position)

        return AsyncHullWatch(
            lambda call: self._start(call, None),
            request,
            after,
            self._retry,
            self._seconds(timeout),
        )

    # --- Bodies ---

    async def put_body(
        self,
        body_id: str,
        pieces: PlacementsLike,
        *,
        if_revision: int | None = None,
        timeout: float | None = None,
    ) -> ReplacedBody:
        """As Client.put_body."""
        return await self._unary(requests.put_body(body_id, pieces, if_revision), timeout)

    async def get_body(
        self, body_id: str, *, freshness: Freshness | None = None, timeout: float | None = None
    ) -> Body:
        """As Client.get_body."""
        return await self._unary(requests.get_body(body_id), timeout, freshness)

    async def list_bodies(
        self,
        prefix: str = "",
        *,
        page_size: int = 1000,
        freshness: Freshness | None = None,
        timeout: float | None = None,
    ) -> AsyncIterator[BodyInfo]:
        """As Client.list_bodies."""
        token = ""
        while True:
            page = await self._unary(
                requests.list_bodies(prefix, page_size, token), timeout, freshness
            )
            for body in page.bodies:
                yield body
            token = page.next_page
            freshness = freshness and freshness.for_next_page(page.header)
            if not token:
                return

    async def delete_body(
        self, body_id: str, *, if_revision: int | None = None, timeout: float | None = None
    ) -> Header:
        """As Client.delete_body."""
        return await self._unary(requests.delete_body(body_id, if_revision), timeout)

    # --- Pairs ---

    async def check_collision(
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
        """As Client.check_collision."""
        wanted = Wanted(axis, analysis, certificate, separation, max_error, witness, clearance)
        return await self._unary(
            requests.check_collision(a, b, wanted, tolerance, method, self._viewer),
            timeout,
            freshness,
        )

    async def check_collisions(
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
        """As Client.check_collisions."""
        packed = Placements.of(placements)
        asked = all_pairs(len(packed)) if pairs is None else as_pairs(pairs, len(packed))
        wanted = Wanted(axis, analysis, certificate, separation, max_error, witness, clearance)
        batch = BatchAssembly(asked, wanted)
        async for data in self._received(
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
    ) -> AsyncIterator[BatchPart]:
        """As Client.iter_check_collisions."""
        packed = Placements.of(placements)
        asked = all_pairs(len(packed)) if pairs is None else as_pairs(pairs, len(packed))
        wanted = Wanted(axis, analysis, certificate, separation, max_error, witness, clearance)
        return self._parts(
            requests.check_collisions(packed, asked, wanted, tolerance, method), timeout, freshness
        )

    async def find_collisions(
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
        """As Client.find_collisions."""
        scene = SceneFilter(groups, ignore_same_group, ignored_group_pairs, movers)
        wanted = Wanted(axis, analysis, certificate, separation, max_error, witness, clearance)
        found = SceneAssembly(wanted)
        async for data in self._received(
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
    ) -> AsyncIterator[ScenePart]:
        """As Client.iter_find_collisions."""
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
    ) -> AsyncCollisionStream:
        """As Client.stream_collisions; entering it, or its first update, opens it."""
        packed = Placements.of(placements)
        asked = all_pairs(len(packed)) if pairs is None else as_pairs(pairs, len(packed))
        wanted = Wanted(axis, analysis, certificate, separation, max_error, witness, clearance)
        return AsyncCollisionStream(
            self.channel.stream_stream(requests.STREAM_COLLISIONS),
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
    ) -> AsyncCollisionWatch:
        """As Client.watch_collisions."""
        packed = Placements.of(placements)
        asked = None if pairs is None else as_pairs(pairs, len(packed))
        scene = SceneFilter(groups, ignore_same_group, ignored_group_pairs, movers)
        return AsyncCollisionWatch(
            self.channel.stream_stream(requests.WATCH_COLLISIONS),
            self._connection.metadata(),
            WatchedPlacements(packed, asked, scene, clearance),
            self._retry,
            self._seconds(timeout),
        )


async def _blocks(
    points: PointsLike | Iterator[PointsLike] | AsyncIterator[PointsLike],
) -> AsyncIterator[PointsLike]:
    """One array, or each array of an iterator of either kind."""
    if isinstance(points, AsyncIterator):
        async for block in points:
            yield block
    elif isinstance(points, Iterator):
        for block in points:
            yield block
    else:
        yield cast(PointsLike, points)
