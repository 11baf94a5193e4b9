"""What a client is before it knows any call: its connection, and how calls over it are made,
bounded in time and repeated."""

from __future__ import annotations

import time
from collections.abc import Iterator
from types import TracebackType
from typing import Any, Self, TypeVar

import grpc
import grpc.experimental

from hulld.answers.hulls import HullMesh, MeshAssembly, MeshPart
from hulld.calls.attempts import Attempts
from hulld.calls.freshness import Freshness
from hulld.calls.requests import Call, as_fresh
from hulld.connection import DEFAULT_SERVER, Connection, Tls
from hulld.errors import from_rpc_error, read_answer
from hulld.notebook import Viewer
from hulld.retry import RetryPolicy

T = TypeVar("T")

DEFAULT_TIMEOUT = 30.0


class ClientBase:
    """As Client, whose arguments these are. Its methods are for those that add calls."""

    def __init__(
        self,
        server: str = DEFAULT_SERVER,
        *,
        timeout: float | None = DEFAULT_TIMEOUT,
        retry: RetryPolicy = RetryPolicy(),
        tls: Tls | None = None,
        token: str | None = None,
        insecure: bool = False,
    ) -> None:
        self._connection = Connection(server, tls, token, insecure)
        self._viewer = Viewer(self._connection)
        self._timeout = timeout
        self._retry = retry
        credentials = self._connection.credentials()
        # Answers that stream then need no thread of their own: observed, 2 ms less for each call.
        options = [
            *self._connection.options(),
            (grpc.experimental.ChannelOptions.SingleThreadedUnaryStream, 1),
        ]
        self._channel = (
            grpc.insecure_channel(self._connection.target, options)
            if credentials is None
            else grpc.secure_channel(self._connection.target, credentials, options)
        )
        self._calls: dict[str, Any] = {}

    @property
    def server(self) -> str:
        """The address that was given."""
        return self._connection.server

    @property
    def channel(self) -> Any:
        """gRPC's channel, for the generated stubs in hulld.v1. Calls through it carry no token of
        their own accord."""
        return self._channel

    def close(self) -> None:
        """Ends the connection and every call on it."""
        self._channel.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"hulld.{type(self).__name__}({self.server!r})"

    def _seconds(self, timeout: float | None) -> float | None:
        return self._timeout if timeout is None else timeout

    def _start(self, call: Call[Any], timeout: float | None) -> Any:
        """Starts a call whose answer streams."""
        multi = self._calls.get(call.method) or self._calls.setdefault(
            call.method, self._channel.unary_stream(call.method)
        )
        return multi(call.request, timeout=timeout, metadata=self._connection.metadata())

    def _unary(self, call: Call[T], timeout: float | None, freshness: Freshness | None = None) -> T:
        call = as_fresh(call, freshness)
        multi = self._calls.get(call.method) or self._calls.setdefault(
            call.method, self._channel.unary_unary(call.method)
        )
        attempts = Attempts(self._retry, call.safe_to_repeat, self._seconds(timeout))
        while True:
            try:
                answer = multi(
                    call.request, timeout=attempts.remaining(), metadata=self._connection.metadata()
                )
            except grpc.RpcError as error:
                time.sleep(attempts.wait_after(from_rpc_error(error)))
                continue
            return read_answer(call.decode, answer)

    def _received(
        self, call: Call[Any], timeout: float | None, freshness: Freshness | None = None
    ) -> Iterator[bytes]:
        """The messages of an answer. Retried only while nothing was received."""
        call = as_fresh(call, freshness)
        attempts = Attempts(self._retry, call.safe_to_repeat, timeout)
        received = False
        while True:
            stream = self._start(call, attempts.remaining())
            try:
                for data in stream:
                    received = True
                    yield data
                return
            except grpc.RpcError as error:
                failed = from_rpc_error(error)
            finally:
                stream.cancel()
            if received:
                raise failed
            time.sleep(attempts.wait_after(failed))

    def _parts(
        self, call: Call[T], timeout: float | None, freshness: Freshness | None = None
    ) -> Iterator[T]:
        for data in self._received(call, self._seconds(timeout), freshness):
            yield read_answer(call.decode, data)

    def _mesh(
        self, call: Call[MeshPart], timeout: float | None, freshness: Freshness | None
    ) -> HullMesh:
        """Retried from the start, whatever was received."""
        call = as_fresh(call, freshness)
        attempts = Attempts(self._retry, call.safe_to_repeat, self._seconds(timeout))
        while True:
            mesh = MeshAssembly()
            try:
                for data in self._start(call, attempts.remaining()):
                    mesh.add(read_answer(call.decode, data))
            except grpc.RpcError as error:
                time.sleep(attempts.wait_after(from_rpc_error(error)))
                continue
            return read_answer(mesh.finish, self._viewer)
