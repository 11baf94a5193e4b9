"""Appends points to a hull, pipelined."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from hulld.calls.append_state import DEFAULT_CHUNK_BYTES, Appended, AppendState, Opened, pieces
from hulld.calls.attempts import Attempts
from hulld.calls.transport import Duplex, sleep
from hulld.errors import (
    DeadlineExceededError,
    FailedPreconditionError,
    HulldError,
    UnavailableError,
    read_answer,
)
from hulld.geometry.points import Points, PointsLike
from hulld.retry import RetryPolicy


class Appender:
    """A stream of chunks into one hull, with a bounded number in flight. If the connection breaks,
    or the server ends the stream with a retry hint, it reconnects as the same writer, reads the
    last committed sequence, and sends the missing chunks, so that each is applied exactly once. It
    fails if the hull or the store was replaced, because acknowledged points would be missing.

    Not thread-safe. A context manager: waits for all acknowledgements at the end, and cancels
    unacknowledged chunks if an exception leaves the block. Created by Client.open_append.
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
        # Time of the first failure since the last acknowledgement; None if the connection has not
        # failed.
        self._attempts: Attempts | None = None
        self._ensure_open()  # sync only

    @property
    def opened(self) -> Opened:
        """The server's answer to the opening message: the hull and this writer's last committed
        sequence number."""
        if self._state.opened is None:
            raise RuntimeError("the stream is not open yet; enter it, or await open()")
        return self._state.opened

    @property
    def writer_id(self) -> str:
        """The name of the writer that numbers the chunks."""
        return self._state.writer_id

    @property
    def totals(self) -> Appended:
        """The progress so far."""
        return self._state.totals()

    def _ensure_open(self) -> Opened:
        """Opens the stream if it is not open."""
        if self._failed is not None:
            raise self._failed
        if self._connection is None:
            attempts = Attempts(self._retry, True, self._timeout)
            while True:
                try:
                    read_answer(self._state.take_opened, self._connect())
                    break
                except HulldError as error:
                    failed = error
                try:
                    wait = attempts.wait_after(failed)
                except HulldError as error:
                    raise self._fail(error) from None
                sleep(wait)
        return self.opened

    def append(
        self,
        points: PointsLike,
        *,
        if_revision: int | None = None,
        chunk_bytes: int = DEFAULT_CHUNK_BYTES,
    ) -> None:
        """Queues points, in chunks of about chunk_bytes; waits while too much is in flight.

        points: n x 3, as in hulld.as_points; doubles and floats are sent unchanged. A chunk is
        applied entirely or not at all. if_revision: applies the chunk only if the hull is at this
        revision (0: it was created by this stream and is empty); all points must then fit in one
        chunk, because the first chunk changes the revision.

        ValueError, before anything is sent: not points; several chunks with if_revision.
        HulldError: the error that ended the stream, which may concern an earlier chunk; every later
        call raises it again.
        """
        self._append_chunks(pieces(points, if_revision, chunk_bytes), if_revision)

    def finish(self) -> Appended:
        """Waits until every chunk is acknowledged, and ends the stream."""
        self._ensure_open()
        while not self._state.idle:
            self._take_one()
        connection = self._connection
        assert connection is not None
        connection.close_sending()
        self._fail(FailedPreconditionError("the append stream is finished"), cancel=False)
        try:
            while connection.receive(self._timeout) is not None:
                pass
        except (UnavailableError, TimeoutError):
            # Everything is acknowledged, so a draining or lost server loses nothing.
            connection.cancel()
        return self._state.totals()

    def cancel(self) -> None:
        """Ends the stream. Unacknowledged chunks may or may not be applied."""
        if self._failed is None:
            self._fail(FailedPreconditionError("the append stream was cancelled"))

    def __enter__(self) -> Appender:
        self._ensure_open()
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is not None:
            self.cancel()
        elif self._failed is None:
            self.finish()

    def __del__(self) -> None:
        connection = getattr(self, "_connection", None)
        if connection is not None:
            connection.cancel()

    def _fail(self, error: HulldError, cancel: bool = True) -> HulldError:
        self._failed = error
        if cancel and self._connection is not None:
            self._connection.cancel()
        self._connection = None
        return error

    def _connect(self) -> bytes:
        """Opens a connection. Returns the server's answer to the opening message."""
        # The old stream ends first, so that the server sees one stream per writer.
        if self._connection is not None:
            self._connection.cancel()
        self._connection = Duplex(self._call, self._metadata)
        try:
            self._connection.send(self._state.open_request(), self._timeout)
            return self._connection.expect(self._timeout)
        except TimeoutError:
            raise DeadlineExceededError(
                f"the server did not open the stream within {self._timeout} s"
            ) from None

    def _append_chunks(self, chunks: Iterable[Points], if_revision: int | None) -> None:
        for chunk in chunks:
            self._ensure_open()
            self._send(self._state.add(chunk, if_revision))
            while self._state.full or self._has_answer():
                self._take_one()

    def _has_answer(self) -> bool:
        """True if an acknowledgement was received, or an error about unacknowledged chunks."""
        return self._connection is not None and self._connection.ready and not self._state.idle

    def _send(self, request: bytes) -> None:
        assert self._connection is not None
        try:
            self._connection.send(request, self._timeout)
        except TimeoutError:
            raise self._fail(self._late("accepted")) from None

    def _take_one(self) -> None:
        """Takes one acknowledgement, or reconnects."""
        assert self._connection is not None
        try:
            message = self._connection.expect(self._timeout)
        except TimeoutError:
            raise self._fail(self._late("acknowledged")) from None
        except HulldError as error:
            failed = error
        else:
            try:
                read_answer(self._state.take_ack, message)
            except HulldError as error:
                raise self._fail(error) from None
            self._attempts = None
            return
        self._reconnect(failed)

    def _reconnect(self, cause: HulldError) -> None:
        while True:
            self._attempts = self._attempts or Attempts(self._retry, True, self._timeout)
            try:
                wait = self._attempts.wait_after(cause)
            except HulldError as error:
                raise self._fail(self._state.cannot_reopen(error)) from None
            sleep(wait)
            try:
                opened = self._connect()
                break
            except HulldError as error:
                cause = error
        try:
            missing = read_answer(self._state.resume, opened)
        except HulldError as error:
            raise self._fail(error) from None
        for request in missing:
            self._send(request)

    def _late(self, did: str) -> DeadlineExceededError:
        return DeadlineExceededError(
            f"the server {did} no chunk for {self._timeout} s; "
            f"{self.totals.points_acknowledged} points are committed"
        )
