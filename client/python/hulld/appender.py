"""Appends points to a hull, pipelined."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator
from types import TracebackType
from typing import Any, cast

from hulld.calls.append_state import DEFAULT_CHUNK_BYTES, Appended, AppendState, Opened
from hulld.calls.duplex import Duplex
from hulld.errors import (
    DeadlineExceededError,
    FailedPreconditionError,
    HulldError,
    UnavailableError,
    read_answer,
)
from hulld.geometry.points import Points, PointsLike, as_points, chunks_of
from hulld.retry import RetryPolicy


class Appender:
    """A stream of chunks into one hull, with a bounded number in flight. When the connection
    breaks, or the server ends the stream and says when to come again, it reconnects as the same
    writer, asks for the last committed sequence and sends what is missing, so that each chunk is
    applied once. It stops when the hull or the store is another one than before: what was
    acknowledged would be missing there.

    For one thread. A context manager: it waits for all acknowledgements at the end, and cancels
    what is not acknowledged when it is left by an exception. Made by Client.open_append.
    """

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
        self._connection: Duplex | None = None
        self._open_first()

    @property
    def opened(self) -> Opened:
        """The server's answer to the opening: the hull as it was, and this writer's last committed
        sequence."""
        assert self._state.opened is not None
        return self._state.opened

    @property
    def writer_id(self) -> str:
        """Under which name chunks are numbered."""
        return self._state.writer_id

    @property
    def totals(self) -> Appended:
        """What became of the points so far."""
        return self._state.totals()

    def append(
        self,
        points: PointsLike,
        *,
        if_revision: int | None = None,
        chunk_bytes: int = DEFAULT_CHUNK_BYTES,
    ) -> None:
        """Queues points, in chunks of about chunk_bytes; waits while too much is in flight.

        points: n x 3, as hulld.as_points takes them; doubles and floats travel as they are. A chunk
        is applied wholly or not at all. if_revision: applied only if the hull is at this revision
        (0: it was made by this stream, and is empty); then all points must fit one chunk, as the
        first changes the revision.

        Raises ValueError, before anything is sent: not points; several chunks with if_revision.
        HulldError: how the stream ended, which may be about an earlier chunk; every further call
        raises it again.
        """
        self.append_chunks(pieces(points, if_revision, chunk_bytes), if_revision)

    def append_chunks(self, chunks: Iterable[Points], if_revision: int | None = None) -> None:
        """As append, for chunks that hulld.as_points has checked."""
        for chunk in chunks:
            if self._failed is not None:
                raise self._failed
            assert self._connection is not None
            self._connection.send(self._state.add(chunk, if_revision))
            self._pump(lambda: not self._state.full)

    def finish(self) -> Appended:
        """Waits until every chunk is acknowledged, and ends the stream."""
        if self._failed is not None:
            raise self._failed
        self._pump(lambda: self._state.idle)
        connection = self._connection
        assert connection is not None
        connection.close_sending()
        self._fail(FailedPreconditionError("the append stream is finished"), cancel=False)
        try:
            while connection.receive(self._timeout) is not None:
                pass
        except (UnavailableError, TimeoutError):
            # Everything is acknowledged, so it does not matter that a server which drains, or is
            # gone, did not end the stream properly.
            connection.cancel()
        return self._state.totals()

    def cancel(self) -> None:
        """Ends the stream; what is not acknowledged may be applied or not."""
        if self._failed is None:
            self._fail(FailedPreconditionError("the append stream was cancelled"))

    def __enter__(self) -> Appender:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if kind is not None:
            self.cancel()
        elif self._failed is None:
            self.finish()

    def __del__(self) -> None:
        connection = getattr(self, "_connection", None)
        if connection is not None:
            connection.cancel()

    # --- How it works ---

    def _fail(self, error: HulldError, cancel: bool = True) -> HulldError:
        self._failed = error
        if cancel and self._connection is not None:
            self._connection.cancel()
        self._connection = None
        return error

    def _connect(self) -> bytes:
        """The server's answer to the opening of a new connection."""
        # The old stream ends before the new one exists, so that the server sees one stream per
        # writer.
        if self._connection is not None:
            self._connection.cancel()
        self._connection = Duplex(self._call, self._metadata)
        self._connection.send(self._state.open_request())
        try:
            return self._connection.expect(self._timeout)
        except TimeoutError:
            raise DeadlineExceededError(
                f"the server did not open the stream within {self._timeout} s"
            ) from None

    def _open_first(self) -> None:
        deadline = None if self._timeout is None else time.monotonic() + self._timeout
        while True:
            try:
                read_answer(self._state.take_opened, self._connect())
                self._state.failures = 0
                return
            except HulldError as error:
                self._state.failures += 1
                remaining = None if deadline is None else deadline - time.monotonic()
                wait = self._retry.wait_after(self._state.failures, error, remaining)
                if wait is None:
                    raise self._fail(error) from None
                time.sleep(wait)

    def _reconnect(self, cause: HulldError) -> None:
        while True:
            self._state.failures += 1
            wait = self._retry.wait_after(self._state.failures, cause, None)
            if wait is None:
                raise self._fail(self._state.cannot_reopen(cause)) from None
            time.sleep(wait)
            try:
                opened = self._connect()
            except HulldError as error:
                cause = error
                continue
            try:
                missing = read_answer(self._state.resume, opened)
            except HulldError as error:
                raise self._fail(error) from None
            assert self._connection is not None
            for request in missing:
                self._connection.send(request)
            return

    def _pump(self, done: Any) -> None:
        """Takes acknowledgements until `done`, and those that are there."""
        while True:
            enough = done()
            assert self._connection is not None
            try:
                message = self._connection.expect(0 if enough else self._timeout)
            except TimeoutError:
                if enough:
                    return
                raise self._fail(
                    DeadlineExceededError(
                        f"the server acknowledged no chunk for {self._timeout} s; "
                        f"{self.totals.points_acknowledged} points are committed"
                    )
                ) from None
            except HulldError as error:
                if self._state.idle and enough:
                    return
                self._reconnect(error)
                continue
            try:
                read_answer(self._state.take_ack, message)
            except HulldError as error:
                raise self._fail(error) from None


def pieces(points: PointsLike, if_revision: int | None, chunk_bytes: int) -> Iterator[Points]:
    """The chunks of points. ValueError: several, with if_revision."""
    array = as_points(points)
    chunks = list(chunks_of(array, chunk_bytes))
    if if_revision is not None and len(chunks) > 1:
        raise ValueError(
            f"{len(array)} points make {len(chunks)} chunks, and if_revision can hold for the "
            "first alone; give fewer points, or a larger chunk_bytes"
        )
    return iter(chunks)


def chunks_to_send(
    points: PointsLike | Iterator[PointsLike], if_revision: int | None, chunk_bytes: int
) -> Iterator[Points]:
    """The chunks of one array, which is checked as a whole at once, or of each array of an iterator
    or a generator, each as it comes. Lists and tuples are arrays."""
    if isinstance(points, Iterator):
        return (chunk for block in points for chunk in pieces(block, if_revision, chunk_bytes))
    return pieces(cast(PointsLike, points), if_revision, chunk_bytes)
