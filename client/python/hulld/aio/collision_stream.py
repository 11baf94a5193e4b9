"""Asks again and again while poses change, for asyncio."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Iterable
from types import TracebackType
from typing import Any

import numpy as np
import numpy.typing as npt

from hulld.aio.duplex import AsyncDuplex
from hulld.answers.assembly import StepAssembly
from hulld.answers.collisions import StreamAnswer
from hulld.calls.freshness import Freshness
from hulld.calls.requests import open_stream, update_stream
from hulld.calls.wanted import Wanted
from hulld.collision_stream import Update, encode_update
from hulld.errors import (
    DeadlineExceededError,
    FailedPreconditionError,
    HulldError,
    InternalError,
    read_answer,
)
from hulld.geometry.placements import Placements
from hulld.geometry.poses import PosesLike


class AsyncCollisionStream:
    """As hulld.CollisionStream; for one task. Entering it (async with) opens the stream. Made by
    AsyncClient.stream_collisions."""

    def __init__(
        self,
        call: Any,
        metadata: Any,
        placements: Placements,
        pairs: npt.NDArray[np.uint32],
        wanted: Wanted,
        tolerance: float,
        only_changes: bool,
        freshness: Freshness | None,
        timeout: float | None,
    ) -> None:
        self._call = call
        self._metadata = metadata
        self._opening = open_stream(placements, pairs, wanted, tolerance, only_changes, freshness)
        self._placements = len(placements)
        self._pairs = pairs
        self._wanted = wanted
        self._timeout = timeout
        self._count = 0
        self._failed: HulldError | None = None
        self._connection: AsyncDuplex | None = None
        self._opened: StreamAnswer | None = None

    @property
    def opened(self) -> StreamAnswer:
        """As CollisionStream.opened."""
        if self._opened is None:
            raise RuntimeError(
                "the stream is not open yet; enter it with async with, or await open()"
            )
        return self._opened

    async def open(self) -> StreamAnswer:
        """Opens the stream, and answers every pair at the first poses."""
        if self._opened is None:
            self._connection = AsyncDuplex(self._call, self._metadata)
            self._opened = await self._ask(self._opening)
        return self._opened

    async def update(
        self, placements: npt.ArrayLike, poses: PosesLike, *, refresh_hulls: bool = False
    ) -> StreamAnswer:
        """As CollisionStream.update."""
        request = encode_update(placements, poses, self._placements, refresh_hulls)
        await self.open()
        return await self._ask(request)

    async def refresh(self) -> StreamAnswer:
        """As CollisionStream.refresh."""
        await self.open()
        return await self._ask(update_stream(np.empty(0, np.uint32), np.empty((0, 7)), True))

    async def follow(self, updates: Iterable[Update]) -> AsyncIterator[StreamAnswer]:
        """As CollisionStream.follow."""
        for placements, poses in updates:
            yield await self.update(placements, poses)

    async def close(self) -> None:
        """As CollisionStream.close."""
        if self._failed is not None or self._connection is None:
            return
        self._failed = FailedPreconditionError("the collision stream is closed")
        await self._connection.close_sending()
        try:
            if await self._connection.receive(self._timeout) is not None:
                raise InternalError("the server answered more than it was asked")
        except TimeoutError:
            self._connection.cancel()

    async def __aenter__(self) -> AsyncCollisionStream:
        await self.open()
        return self

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if kind is None:
            await self.close()
        else:
            self._failed = self._failed or FailedPreconditionError("the collision stream is closed")
            if self._connection is not None:
                self._connection.cancel()

    async def _ask(self, request: bytes) -> StreamAnswer:
        if self._failed is not None:
            raise self._failed
        assert self._connection is not None
        step = StepAssembly(self._count, self._pairs, self._wanted)
        self._count += 1
        try:
            async with asyncio.timeout(self._timeout):
                await self._connection.send(request)
            while not read_answer(step.add, await self._connection.expect(self._timeout)):
                pass
            return read_answer(lambda _: step.finish(), None)
        except TimeoutError:
            failed: HulldError = DeadlineExceededError(
                f"the server did not answer within {self._timeout} s"
            )
        except HulldError as error:
            failed = error
        self._failed = failed
        self._connection.cancel()
        raise failed
