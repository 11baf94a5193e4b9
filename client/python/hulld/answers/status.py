"""Answers about the server."""

from __future__ import annotations

import datetime
from dataclasses import dataclass

from hulld.answers.hulls import Header, header_of
from hulld.v1 import status_pb2


@dataclass(frozen=True)
class Limits:
    """The server's limits. Each is set by a flag of the server."""

    max_points_per_chunk: int
    max_vertices_per_hull: int
    max_hulls: int
    max_pairs_per_batch: int
    max_textbook_axes: int
    max_message_bytes: int
    max_points_per_hull: int
    #: Placements in a batch, scene, or stream.
    max_placements: int
    max_calls: int
    max_waiting_calls: int
    max_streams_per_client: int
    max_concurrent_batches: int
    max_pieces_per_body: int
    #: Seconds for a request, or for a message of a collision stream or watch; None: unlimited.
    max_request_time: float | None
    max_writers_per_hull: int
    memory_limit_bytes: int
    #: Limits per client: a token or, without tokens, an address.
    max_calls_per_client: int
    max_batches_per_client: int
    #: Bytes for requests that are not answered yet.
    request_memory_bytes: int


@dataclass(frozen=True)
class ServerStatus:
    """Version, uptime, sizes, and limits of the server.

    version: as in "0.1.0". uptime: seconds. store_kind: "rocksdb", "postgres", or "memory".
    hull_count, vertex_count: None if the token is limited to a prefix.
    """

    header: Header
    version: str
    started: datetime.datetime
    uptime: float
    store_kind: str
    hull_count: int | None
    vertex_count: int | None
    limits: Limits


def decode_status(data: bytes) -> ServerStatus:
    message = status_pb2.GetStatusResponse.FromString(data)
    limits = message.limits
    values = {
        name: getattr(limits, name)
        for name in Limits.__dataclass_fields__
        if name != "max_request_time"
    }
    longest = limits.max_request_time
    return ServerStatus(
        header_of(message.header),
        message.version,
        message.started.ToDatetime(tzinfo=datetime.timezone.utc),
        message.uptime.seconds + message.uptime.nanos * 1e-9,
        message.store_kind,
        message.hull_count if message.HasField("hull_count") else None,
        message.vertex_count if message.HasField("vertex_count") else None,
        Limits(
            max_request_time=longest.seconds + longest.nanos * 1e-9
            if limits.HasField("max_request_time")
            else None,
            **values,
        ),
    )
