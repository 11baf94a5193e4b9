"""Tells of hulls, and of pairs, as they change, for asyncio."""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import AsyncIterator, Callable
from types import TracebackType
from typing import Any

import grpc
import numpy.typing as npt

from hulld.aio.duplex import AsyncDuplex
from hulld.answers.collision_messages import decode_collision_changes
from hulld.answers.collisions import CollisionChanges
from hulld.answers.hulls import Header, HullChanges
from hulld.calls.requests import Call
from hulld.collision_stream import encode_update
from hulld.errors import (
    CancelledError,
    HulldError,
    InternalError,
    UnavailableError,
    from_rpc_error,
    read_answer,
)
from hulld.geometry.poses import PosesLike
from hulld.retry import RetryPolicy
from hulld.watches import MOST_WAITING, WatchPosition


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
        deadline = math.inf if self._patience is None else time.monotonic() + self._patience
        failures = 0
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
            failures += 1
            wait = self._retry.wait_after(
                failures,
                error,
                deadline - time.monotonic(),
                math.inf if self._position.connected else None,
            )
            if wait is None:
                raise error
            await asyncio.sleep(wait)

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

    def __init__(self, call: Any, metadata: Any, opening: bytes, placements: int) -> None:
        self._placements = placements
        self._cancelled = False
        self._opening = opening
        self._call = call
        self._metadata = metadata
        self._connection: AsyncDuplex | None = None

    async def _connected(self) -> AsyncDuplex:
        if self._connection is None:
            self._connection = AsyncDuplex(self._call, self._metadata, MOST_WAITING)
            # Whoever comes next waits behind this in gRPC's order of writes.
            await self._connection.send(self._opening)
        return self._connection

    def __aiter__(self) -> AsyncIterator[CollisionChanges]:
        return self

    async def __anext__(self) -> CollisionChanges:
        if self._cancelled:
            raise StopAsyncIteration
        try:
            message = await (await self._connected()).receive(None)
        except CancelledError:
            if self._cancelled:
                raise StopAsyncIteration from None
            raise
        if message is None:
            raise InternalError("the server ended the watch without a cause")
        return read_answer(decode_collision_changes, message)

    async def update(self, placements: npt.ArrayLike, poses: PosesLike) -> None:
        """As CollisionWatch.update."""
        request = encode_update(placements, poses, self._placements, False)
        await (await self._connected()).send(request)

    def cancel(self) -> None:
        """As CollisionWatch.cancel."""
        self._cancelled = True
        if self._connection is not None:
            self._connection.cancel()

    async def __aenter__(self) -> AsyncCollisionWatch:
        await self._connected()
        return self

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.cancel()
