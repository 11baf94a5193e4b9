"""Tells of hulls, and of pairs, as they change, for asyncio."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from types import TracebackType
from typing import Any

import grpc
import numpy.typing as npt

from hulld.aio.duplex import AsyncDuplex
from hulld.answers.collision_messages import decode_collision_changes
from hulld.answers.collisions import CollisionChanges
from hulld.answers.hulls import Header, HullChanges
from hulld.calls.requests import Call, update_stream
from hulld.calls.told_pairs import ToldPairs, WatchedPlacements
from hulld.collision_stream import check_update
from hulld.errors import HulldError, InternalError, UnavailableError, from_rpc_error, read_answer

from hulld.geometry.poses import PosesLike
from hulld.retry import RetryPolicy
from hulld.watches import MOST_WAITING, Search, WatchPosition


class AsyncHullWatch:
    """As hulld.HullWatch, for one task. Made by AsyncClient.watch_hulls."""

    def __init__(
        self,
        start: Callable[[Call[HullChanges]], Any],
        request: Callable[[Header | None], Call[HullChanges]],
        after: Header | None,
        retry: RetryPolicy,
        patience: float | None,
    ) -> None:
        self._start = start
        self._request = request
        self._position = WatchPosition(after)
        self._retry = retry
        self._patience = patience
        self._call: Any = None
        self._cancelled = False

    @property
    def position(self) -> Header | None:
        """As HullWatch.position."""
        return self._position.after

    def __aiter__(self) -> AsyncIterator[HullChanges]:
        return self

    async def __anext__(self) -> HullChanges:
        search = Search(self._retry, self._patience)
        while True:
            if self._cancelled:
                raise StopAsyncIteration
            request = self._request(self._position.after)
            first = self._call is None
            if first:
                self._call = self._start(request)
            try:
                message = await self._call.read()
                if message is not grpc.aio.EOF:
                    return self._position.take(read_answer(request.decode, message), first)
                error: HulldError = UnavailableError("the server ended the watch")
            except grpc.RpcError as rpc_error:
                error = from_rpc_error(rpc_error)
            except asyncio.CancelledError:
                if not self._cancelled:
                    raise
                raise StopAsyncIteration from None
            self._call = None
            if self._cancelled:
                raise StopAsyncIteration
            await asyncio.sleep(search.wait_after(error, self._position.connected))

    def cancel(self) -> None:
        """As HullWatch.cancel."""
        self._cancelled = True
        if self._call is not None:
            self._call.cancel()

    async def __aenter__(self) -> AsyncHullWatch:
        return self

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.cancel()


class AsyncCollisionWatch:
    """As hulld.CollisionWatch: an asynchronous iterator for one task; update and cancel are for any
    of the loop. Made by AsyncClient.watch_collisions."""

    def __init__(
        self,
        call: Any,
        metadata: Any,
        watched: WatchedPlacements,
        retry: RetryPolicy,
        patience: float | None,
    ) -> None:
        self._call = call
        self._metadata = metadata
        self._watched = watched
        self._told = ToldPairs(watched)
        self._retry = retry
        self._patience = patience
        # Messages go in the order in which the poses changed.
        self._lock = asyncio.Lock()
        self._connection: AsyncDuplex | None = None
        self._updates_before = 0
        self._first = self._connected = self._cancelled = False

    def __aiter__(self) -> AsyncIterator[CollisionChanges]:
        return self

    async def __anext__(self) -> CollisionChanges:
        search = Search(self._retry, self._patience)
        while True:
            connection = await self._open()
            try:
                message = await connection.receive(None)
                if message is not None:
                    return self._take(read_answer(decode_collision_changes, message))
                error: HulldError = InternalError("the server ended the watch without a cause")
            except HulldError as ended:
                error = ended
            # It may not have ended: an answer that cannot be read is an error, too.
            connection.cancel()
            self._connection = None
            if self._cancelled:
                raise StopAsyncIteration
            await asyncio.sleep(search.wait_after(error, self._connected))

    async def _open(self) -> AsyncDuplex:
        async with self._lock:
            if self._cancelled:
                raise StopAsyncIteration
            if self._connection is None:
                connection = AsyncDuplex(self._call, self._metadata, MOST_WAITING)
                self._connection = connection
                self._updates_before = self._watched.updates
                self._first = True
                await connection.send(self._watched.opening())
                return connection
            return self._connection

    def _take(self, changes: CollisionChanges) -> CollisionChanges:
        if self._first and self._connected:
            self._told.start_anew()
        self._first, self._connected = False, True
        return self._told.take(changes, self._updates_before)

    async def update(self, placements: npt.ArrayLike, poses: PosesLike) -> None:
        """As CollisionWatch.update."""
        indices, packed = check_update(placements, poses, len(self._watched.placements))
        async with self._lock:
            self._watched.move(indices, packed)
            if self._connection is not None:
                await self._connection.send(update_stream(indices, packed, False))

    def cancel(self) -> None:
        """As CollisionWatch.cancel."""
        self._cancelled = True
        if self._connection is not None:
            self._connection.cancel()

    async def __aenter__(self) -> AsyncCollisionWatch:
        return self

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.cancel()
