"""The state of an appender, without input or output: chunks sent and acknowledged."""

from __future__ import annotations

import collections
import os
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from hulld import arguments
from hulld.answers.hulls import (
    Durability,
    Header,
    HullInfo,
    PointCounts,
    counts_of,
    enum_or_zero,
    header_of,
    info_of,
)
from hulld.errors import FailedPreconditionError, HulldError, InternalError, NotFoundError
from hulld.geometry.points import Points, PointsLike, as_points, chunks_of, point_block
from hulld.v1 import hull_pb2
from hulld.wire import MessageWriter

#: Points are sent in messages of about this size.
DEFAULT_CHUNK_BYTES = 1 << 20


@dataclass(frozen=True)
class Opened:
    """The server's first answer. last_sequence: the writer's last committed sequence; 0 if
    none."""

    hull: HullInfo
    writer_id: str
    last_sequence: int
    header: Header


@dataclass(frozen=True)
class Appended:
    """The progress of an append.

    chunks, points: sent. points_acknowledged: committed with this durability. counts: sums over the
    acknowledgements received, excluding chunks_recovered: chunks that were committed, but whose
    acknowledgement was lost with a connection. hull_revision, vertex_count: after the last
    acknowledged chunk. header: of the last reply.
    """

    chunks: int
    points: int
    points_acknowledged: int
    chunks_recovered: int
    reconnects: int
    counts: PointCounts
    hull_revision: int
    vertex_count: int
    durability: Durability
    header: Header | None


@dataclass(frozen=True)
class _Chunk:
    sequence: int
    request: bytes
    points: int


class AppendState:
    """A writer's side of AppendPoints. Chunks are numbered 1, 2, 3, ... and kept until they are
    acknowledged; the server ignores a repeated number."""

    def __init__(
        self,
        hull_id: str,
        writer_id: str | None,
        create: bool,
        max_in_flight_bytes: int,
        max_in_flight_chunks: int,
    ) -> None:
        self.hull_id = arguments.hull_id(hull_id)
        self.writer_id = (
            arguments.text(writer_id, "writer_id", minimum=1)
            if writer_id is not None
            else f"python-{os.urandom(8).hex()}"
        )
        self._create = create
        self._max_bytes = arguments.count(
            max_in_flight_bytes, "max_in_flight_bytes", minimum=1, maximum=1 << 62
        )
        self._max_chunks = arguments.count(max_in_flight_chunks, "max_in_flight_chunks", minimum=1)
        self.opened: Opened | None = None
        self._unacknowledged: collections.deque[_Chunk] = collections.deque()
        self._bytes_in_flight = 0
        self._next_sequence = 1
        self._chunks = self._points = self._acknowledged = self._recovered = self._reconnects = 0
        self._counts = PointCounts()
        self._revision = self._vertices = 0
        self._durability = Durability.UNSPECIFIED
        self._header: Header | None = None

    def open_request(self) -> bytes:
        opening = hull_pb2.AppendOpen(
            hull_id=self.hull_id, writer_id=self.writer_id, create_if_absent=self._create
        )
        return bytes(hull_pb2.AppendPointsRequest(open=opening).SerializeToString())

    def take_opened(self, data: bytes) -> Opened:
        """The first answer of the first connection."""
        self.opened = _opened(data)
        self._next_sequence = self.opened.last_sequence + 1
        self._revision, self._vertices = self.opened.hull.revision, self.opened.hull.vertex_count
        self._header = self.opened.header
        # The hull exists now. If it is missing on reconnect, recreating it would hide the loss of
        # points.
        self._create = False
        return self.opened

    def resume(self, data: bytes) -> list[bytes]:
        """Processes the first answer of a later connection. Returns the requests to resend.
        HulldError: the append cannot continue."""
        assert self.opened is not None
        opened = _opened(data)
        if (opened.header.store_id, opened.hull.create_revision) != (
            self.opened.header.store_id,
            self.opened.hull.create_revision,
        ):
            raise FailedPreconditionError(
                f'hull "{self.hull_id}" was replaced while the connection was down; '
                f"{self._acknowledged} acknowledged points were lost with the old one; append all "
                "points again"
            )
        first = self._next_sequence - len(self._unacknowledged)
        if not first - 1 <= opened.last_sequence < self._next_sequence:
            raise InternalError(
                f'the server\'s last sequence of writer "{self.writer_id}" is '
                f"{opened.last_sequence}, which this stream cannot continue; check that no "
                "other client uses the same writer_id"
            )
        self._reconnects += 1
        self._drop(opened.last_sequence, recovered=True)
        return [chunk.request for chunk in self._unacknowledged]

    def cannot_reopen(self, error: HulldError) -> HulldError:
        """The error to raise when a reconnect failed with `error`."""
        if isinstance(error, NotFoundError):
            return FailedPreconditionError(
                f'hull "{self.hull_id}" was deleted while the connection was down; append all '
                "points again"
            )
        return error

    def add(self, points: Points, if_revision: int | None) -> bytes:
        """The request of the next chunk."""
        sequence = self._next_sequence
        chunk = MessageWriter().raw(
            hull_pb2.AppendChunk(sequence=sequence, if_revision=if_revision).SerializeToString()
        )
        request = MessageWriter().message(2, chunk.message(2, point_block(points))).finish()
        self._next_sequence += 1
        self._unacknowledged.append(_Chunk(sequence, request, len(points)))
        self._bytes_in_flight += len(request)
        self._chunks += 1
        self._points += len(points)
        return request

    @property
    def full(self) -> bool:
        """True if the next chunk must wait for acknowledgements."""
        return (
            len(self._unacknowledged) >= self._max_chunks
            or self._bytes_in_flight >= self._max_bytes
        )

    @property
    def idle(self) -> bool:
        """True if every chunk is acknowledged."""
        return not self._unacknowledged

    def take_ack(self, data: bytes) -> None:
        """InternalError: the server acknowledged a chunk that was not sent."""
        message = hull_pb2.AppendPointsResponse.FromString(data)
        if not message.HasField("ack"):
            raise InternalError("the server sent `opened` twice")
        ack = message.ack
        if ack.sequence >= self._next_sequence:
            raise InternalError(
                f"the server acknowledged sequence {ack.sequence}, which was not sent"
            )
        self._drop(ack.sequence, recovered=False)
        self._counts += counts_of(ack.counts)
        self._revision, self._vertices = ack.hull_revision, ack.vertex_count
        self._durability = enum_or_zero(Durability, ack.durability)
        self._header = header_of(ack.header)

    def _drop(self, sequence: int, recovered: bool) -> None:
        while self._unacknowledged and self._unacknowledged[0].sequence <= sequence:
            chunk = self._unacknowledged.popleft()
            self._bytes_in_flight -= len(chunk.request)
            self._acknowledged += chunk.points
            self._recovered += recovered

    def totals(self) -> Appended:
        return Appended(
            self._chunks,
            self._points,
            self._acknowledged,
            self._recovered,
            self._reconnects,
            self._counts,
            self._revision,
            self._vertices,
            self._durability,
            self._header,
        )


def _opened(data: bytes) -> Opened:
    message: Any = hull_pb2.AppendPointsResponse.FromString(data)
    if not message.HasField("opened"):
        raise InternalError("the server answered an append stream without `opened`")
    opened = message.opened
    return Opened(
        info_of(opened.hull), opened.writer_id, opened.last_sequence, header_of(opened.header)
    )


def pieces(points: PointsLike, if_revision: int | None, chunk_bytes: int) -> Iterator[Points]:
    """Splits points into chunks. ValueError: invalid arguments, or several chunks with
    if_revision."""
    array = as_points(points)
    arguments.revision(if_revision)
    size = arguments.count(chunk_bytes, "chunk_bytes", minimum=1)
    chunks = list(chunks_of(array, size))
    if if_revision is not None and len(chunks) > 1:
        raise ValueError(
            f"{len(array)} points make {len(chunks)} chunks, and if_revision applies only to the "
            "first; pass fewer points, or a larger chunk_bytes"
        )
    return iter(chunks)
