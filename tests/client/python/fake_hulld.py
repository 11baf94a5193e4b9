"""A server that fails on purpose, in the ways of a real server that is killed, busy, or
replaced."""

from __future__ import annotations

import concurrent.futures
from collections.abc import Callable, Iterator
from typing import Any

import grpc

from hulld.rpc import error_details_pb2
from hulld.v1 import hull_pb2, hull_pb2_grpc, status_pb2, status_pb2_grpc


def refuse(
    context: Any,
    code: grpc.StatusCode,
    message: str,
    *,
    reason: str | None = None,
    metadata: dict[str, str] | None = None,
    pushback: str | None = None,
) -> None:
    """Ends the call with error details in hulld's format."""
    trailing: list[tuple[str, Any]] = [("x-request-id", "fake-1")]
    if reason is not None:
        status = error_details_pb2.Status(code=code.value[0], message=message)
        info = error_details_pb2.ErrorInfo(reason=reason, domain="hulld", metadata=metadata)
        status.details.add(
            type_url="type.googleapis.com/google.rpc.ErrorInfo", value=info.SerializeToString()
        )
        trailing.append(("grpc-status-details-bin", status.SerializeToString()))
    if pushback is not None:
        trailing.append(("grpc-retry-pushback-ms", pushback))
    context.set_trailing_metadata(trailing)
    context.abort(code, message)


class FakeHulld(hull_pb2_grpc.HullServiceServicer, status_pb2_grpc.StatusServiceServicer):
    """Before it is answered, each call runs the next function of `script` with its context.
    Appended points are kept per chunk, so that a repeated chunk is recognized."""

    def __init__(self) -> None:
        self.script: list[Callable[[Any], None]] = []
        self.calls: list[str] = []
        self.metadata: list[dict[str, Any]] = []
        self.chunks: dict[int, int] = {}
        self.store_id = "store"
        self.create_revision = 1
        self.missing = False
        # Called with each chunk; raises or aborts to fail before it (with `after`: after it).
        self.before: Callable[[int, Any], None] = lambda sequence, context: None
        self.after: Callable[[int, Any], None] = lambda sequence, context: None
        self._server = grpc.server(concurrent.futures.ThreadPoolExecutor(8))
        hull_pb2_grpc.add_HullServiceServicer_to_server(self, self._server)
        status_pb2_grpc.add_StatusServiceServicer_to_server(self, self._server)
        self.address = f"127.0.0.1:{self._server.add_insecure_port('127.0.0.1:0')}"

    def __enter__(self) -> FakeHulld:
        self._server.start()
        return self

    def __exit__(self, *error: Any) -> None:
        self._server.stop(None).wait()

    def _begin(self, call: str, context: Any) -> None:
        self.calls.append(call)
        self.metadata.append(dict(context.invocation_metadata()))
        if self.script:
            self.script.pop(0)(context)

    def GetStatus(self, request: Any, context: Any) -> Any:
        self._begin("GetStatus", context)
        return status_pb2.GetStatusResponse(version="fake")

    def CreateHull(self, request: Any, context: Any) -> Any:
        self._begin("CreateHull", context)
        return hull_pb2.CreateHullResponse(created=True)

    def DeleteHull(self, request: Any, context: Any) -> Any:
        self._begin("DeleteHull", context)
        return hull_pb2.DeleteHullResponse()

    def GetHullMesh(self, request: Any, context: Any) -> Iterator[Any]:
        self._begin("GetHullMesh", context)
        yield hull_pb2.GetHullMeshResponse(header=hull_pb2.MeshHeader(vertex_count=2))
        yield hull_pb2.GetHullMeshResponse(vertices=hull_pb2.MeshVertices(xyz=[0, 0, 0]))
        if self.script:
            self.script.pop(0)(context)
        yield hull_pb2.GetHullMeshResponse(vertices=hull_pb2.MeshVertices(xyz=[1, 1, 1]))

    def WatchHulls(self, request: Any, context: Any) -> Iterator[Any]:
        self._begin(f"WatchHulls after {request.after_revision}", context)
        message = hull_pb2.WatchHullsResponse(synced=True)
        message.header.store_id, message.header.revision = "store", request.after_revision + 10
        message.events.add(kind=hull_pb2.HULL_EVENT_KIND_PRESENT).hull.hull_id = "a"
        yield message
        refuse(context, grpc.StatusCode.UNAVAILABLE, "the server ends soon", reason="DRAINING")

    def AppendPoints(self, requests: Any, context: Any) -> Iterator[Any]:
        self._begin("AppendPoints", context)
        for request in requests:
            response = hull_pb2.AppendPointsResponse()
            if request.HasField("open"):
                if self.missing and not request.open.create_if_absent:
                    refuse(
                        context, grpc.StatusCode.NOT_FOUND, "no such hull", reason="HULL_NOT_FOUND"
                    )
                opened = response.opened
                opened.header.store_id = self.store_id
                opened.hull.create_revision = self.create_revision
                opened.writer_id = request.open.writer_id
                opened.last_sequence = max(self.chunks, default=0)
                yield response
                continue
            sequence = request.chunk.sequence
            self.before(sequence, context)
            points = len(request.chunk.points.xyz) // 3
            response.ack.sequence = sequence
            response.ack.outcome = (
                hull_pb2.APPEND_OUTCOME_ALREADY_APPLIED
                if sequence in self.chunks
                else hull_pb2.APPEND_OUTCOME_APPLIED
            )
            self.chunks.setdefault(sequence, points)
            response.ack.counts.received = points
            self.after(sequence, context)
            yield response
