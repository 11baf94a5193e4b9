"""As hulld.client_base, for asyncio."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from types import TracebackType
from typing import Any, Self, TypeVar

import grpc

from hulld.answers.hulls import HullMesh, MeshAssembly, MeshPart
from hulld.calls.attempts import Attempts
from hulld.calls.freshness import Freshness
from hulld.calls.requests import Call, as_fresh
from hulld.client_base import DEFAULT_TIMEOUT
from hulld.connection import DEFAULT_SERVER, Connection, Tls
from hulld.errors import from_rpc_error, read_answer
from hulld.notebook import Viewer
from hulld.retry import RetryPolicy

T = TypeVar("T")


class AsyncClientBase:
    """As AsyncClient, whose arguments these are. Its methods are for those that add calls."""

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
        self._credentials = self._connection.credentials()
        self._open_channel: Any = None
        self._calls: dict[str, Any] = {}

    @property
    def server(self) -> str:
        """As Client.server."""
        return self._connection.server

    @property
    def channel(self) -> Any:
        """As Client.channel: a grpc.aio.Channel, made when it is first needed, as it belongs to the
        loop that runs then."""
        if self._open_channel is None:
            options = self._connection.options()
            self._open_channel = (
                grpc.aio.insecure_channel(self._connection.target, options)
                if self._credentials is None
                else grpc.aio.secure_channel(self._connection.target, self._credentials, options)
            )
        return self._open_channel

    async def close(self) -> None:
        """As Client.close."""
        if self._open_channel is not None:
            await self._open_channel.close()

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        await self.close()

    def __repr__(self) -> str:
        return f"hulld.{type(self).__name__}({self.server!r})"

    def _seconds(self, timeout: float | None) -> float | None:
        return self._timeout if timeout is None else timeout

    def _start(self, call: Call[Any], timeout: float | None) -> Any:
        """Starts a call whose answer streams."""
        multi = self._calls.get(call.method) or self._calls.setdefault(
            call.method, self.channel.unary_stream(call.method)
        )
        return multi(call.request, timeout=timeout, metadata=self._connection.metadata())

    async def _unary(
        self, call: Call[T], timeout: float | None, freshness: Freshness | None = None
    ) -> T:
        call = as_fresh(call, freshness)
        multi = self._calls.get(call.method) or self._calls.setdefault(
            call.method, self.channel.unary_unary(call.method)
        )
        attempts = Attempts(self._retry, call.safe_to_repeat, self._seconds(timeout))
        while True:
            try:
                answer = await multi(
                    call.request, timeout=attempts.remaining(), metadata=self._connection.metadata()
                )
            except grpc.RpcError as error:
                await asyncio.sleep(attempts.wait_after(from_rpc_error(error)))
                continue
            return read_answer(call.decode, answer)

    async def _received(
        self, call: Call[Any], timeout: float | None, freshness: Freshness | None = None
    ) -> AsyncIterator[bytes]:
        """The messages of an answer. Retried only while nothing was received."""
        call = as_fresh(call, freshness)
        attempts = Attempts(self._retry, call.safe_to_repeat, timeout)
        received = False
        while True:
            stream = self._start(call, attempts.remaining())
            try:
                async for data in stream:
                    received = True
                    yield data
                return
            except grpc.RpcError as error:
                failed = from_rpc_error(error)
            finally:
                stream.cancel()
            if received:
                raise failed
            await asyncio.sleep(attempts.wait_after(failed))

    async def _parts(
        self, call: Call[T], timeout: float | None, freshness: Freshness | None = None
    ) -> AsyncIterator[T]:
        async for data in self._received(call, self._seconds(timeout), freshness):
            yield read_answer(call.decode, data)

    async def _mesh(
        self, call: Call[MeshPart], timeout: float | None, freshness: Freshness | None
    ) -> HullMesh:
        """Retried from the start, whatever was received."""
        call = as_fresh(call, freshness)
        attempts = Attempts(self._retry, call.safe_to_repeat, self._seconds(timeout))
        while True:
            mesh = MeshAssembly()
            try:
                async for data in self._start(call, attempts.remaining()):
                    mesh.add(read_answer(call.decode, data))
            except grpc.RpcError as error:
                await asyncio.sleep(attempts.wait_after(from_rpc_error(error)))
                continue
            return read_answer(mesh.finish, self._viewer)
