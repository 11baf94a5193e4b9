"""Appends points to a hull, pipelined, for asyncio."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Iterable
from types import TracebackType
from typing import Any

from hulld.aio.duplex import AsyncDuplex
from hulld.appender import pieces
from hulld.calls.append_state import DEFAULT_CHUNK_BYTES, Appended, AppendState, Opened
from hulld.errors import (
    DeadlineExceededError,
    FailedPreconditionError,
    HulldError,
    UnavailableError,
    read_answer,
)
from hulld.geometry.points import Points, PointsLike
from hulld.retry import RetryPolicy


class AsyncAppender:
    """As hulld.Appender; for one task. Entering it (async with) opens the stream. Made by
    AsyncClient.open_append."""

    def __init__(
        self,
        call: Any,
        metadata: Any,
        state: AppendState,
        retry: RetryPolicy,
        timeout: float | None,
    ) -> None:
        self._call = call
        self._metadata = metadata
        self._state = state
        self._retry = retry
        self._timeout = timeout
        self._failed: HulldError | None = None
        self._connection: AsyncDuplex | None = None

    @property
    def opened(self) -> Opened:
        """As Appender.opened."""
        assert self._state.opened is not None
        return self._state.opened

    @property
    def writer_id(self) -> str:
        """As Appender.writer_id."""
        return self._state.writer_id

    @property
    def totals(self) -> Appended:
        """As Appender.totals."""
        return self._state.totals()

    async def append(
        self,
        points: PointsLike,
        *,
        if_revision: int | None = None,
        chunk_bytes: int = DEFAULT_CHUNK_BYTES,
    ) -> None:
        """As Appender.append."""
        await self.append_chunks(pieces(points, if_revision, chunk_bytes), if_revision)

    async def append_chunks(self, chunks: Iterable[Points], if_revision: int | None = None) -> None:
        """As append, for chunks that hulld.as_points has checked."""
        for chunk in chunks:
            if self._failed is not None:
                raise self._failed
            if self._connection is None:
                await self.open()
            await self._send(self._state.add(chunk, if_revision))
            while self._state.full:
                await self._take_one()

    async def finish(self) -> Appended:
        """As Appender.finish."""
        if self._failed is not None:
            raise self._failed
        if self._connection is None:
            await self.open()
        while not self._state.idle:
            await self._take_one()
        connection = self._connection
        assert connection is not None
        await connection.close_sending()
        self._fail(FailedPreconditionError("the append stream is finished"), cancel=False)
        try:
            while await connection.receive(self._timeout) is not None:
                pass
        except (UnavailableError, TimeoutError):
            # Everything is acknowledged.
            connection.cancel()
        return self._state.totals()

    def cancel(self) -> None:
        """As Appender.cancel."""
        if self._failed is None:
            self._fail(FailedPreconditionError("the append stream was cancelled"))

    async def open(self) -> Opened:
        """Opens the stream; what comes first does it otherwise."""
        deadline = None if self._timeout is None else time.monotonic() + self._timeout
        while True:
            try:
                opened = read_answer(self._state.take_opened, await self._connect())
                self._state.failures = 0
                return opened
            except HulldError as error:
                self._state.failures += 1
                remaining = None if deadline is None else deadline - time.monotonic()
                wait = self._retry.wait_after(self._state.failures, error, remaining)
                if wait is None:
                    raise self._fail(error) from None
                await asyncio.sleep(wait)

    async def __aenter__(self) -> AsyncAppender:
        if self._connection is None:
            await self.open()
        return self

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if kind is not None:
            self.cancel()
        elif self._failed is None:
            await self.finish()

    # --- How it works ---

    def _fail(self, error: HulldError, cancel: bool = True) -> HulldError:
        self._failed = error
        if cancel and self._connection is not None:
            self._connection.cancel()
        self._connection = None
        return error

    async def _connect(self) -> bytes:
        if self._connection is not None:
            self._connection.cancel()
        self._connection = AsyncDuplex(self._call, self._metadata)
        try:
            async with asyncio.timeout(self._timeout):
                await self._connection.send(self._state.open_request())
                return await self._connection.expect(None)
        except TimeoutError:
            raise DeadlineExceededError(
                f"the server did not open the stream within {self._timeout} s"
            ) from None

    async def _send(self, request: bytes) -> None:
        assert self._connection is not None
        try:
            async with asyncio.timeout(self._timeout):
                await self._connection.send(request)
        except TimeoutError:
            raise self._fail(
                DeadlineExceededError(
                    f"the server took no chunk for {self._timeout} s; at least "
                    f"{self.totals.points_acknowledged} points are committed"
                )
            ) from None

    async def _reconnect(self, cause: HulldError) -> None:
        while True:
            self._state.failures += 1
            wait = self._retry.wait_after(self._state.failures, cause, None)
            if wait is None:
                raise self._fail(self._state.cannot_reopen(cause)) from None
            await asyncio.sleep(wait)
            try:
                opened = await self._connect()
            except HulldError as error:
                cause = error
                continue
            try:
                missing = read_answer(self._state.resume, opened)
            except HulldError as error:
                raise self._fail(error) from None
            for request in missing:
                await self._send(request)
            return

    async def _take_one(self) -> None:
        assert self._connection is not None
        try:
            message = await self._connection.expect(self._timeout)
        except TimeoutError:
            raise self._fail(
                DeadlineExceededError(
                    f"the server acknowledged no chunk for {self._timeout} s; "
                    f"{self.totals.points_acknowledged} points are committed"
                )
            ) from None
        except HulldError as error:
            await self._reconnect(error)
            return
        try:
            read_answer(self._state.take_ack, message)
        except HulldError as error:
            raise self._fail(error) from None
