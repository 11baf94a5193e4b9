"""A call whose both sides stream, with a bound on each wait."""

from __future__ import annotations

import asyncio
from typing import Any

import grpc

from hulld.errors import CancelledError, InternalError, from_rpc_error, from_status


class AsyncDuplex:
    """gRPC's call with one kind of error. Not for several tasks at a time, but for send, which
    another may call."""

    def __init__(self, call: Any, metadata: Any) -> None:
        self._call = call(metadata=metadata)

    async def send(self, message: bytes) -> None:
        """Where the call has ended, nothing happens, and receive tells why."""
        try:
            await self._call.write(message)
        except (grpc.RpcError, asyncio.InvalidStateError):
            pass
        except asyncio.CancelledError:
            if not self._call.done():
                raise

    async def close_sending(self) -> None:
        """Says that nothing follows."""
        try:
            await self._call.done_writing()
        except (grpc.RpcError, asyncio.InvalidStateError):
            pass

    async def receive(self, timeout: float | None) -> bytes | None:
        """The next message; None where the call has ended well. TimeoutError: none came within
        `timeout` seconds, and the call is cancelled. HulldError: how the call ended."""
        try:
            message = await asyncio.wait_for(self._call.read(), timeout)
        except grpc.RpcError as error:
            raise from_rpc_error(error) from None
        except asyncio.TimeoutError:
            raise TimeoutError from None
        except asyncio.CancelledError:
            # Ours, where the call was cancelled by `cancel`; else the task's.
            if self._call.cancelled():
                raise CancelledError("the call was cancelled") from None
            raise
        if message is grpc.aio.EOF:
            await self._raise_end()
            return None
        found: bytes = message
        return found

    async def _raise_end(self) -> None:
        code = await self._call.code()
        if code is not grpc.StatusCode.OK:
            raise from_status(
                code.name, await self._call.details() or "", await self._call.trailing_metadata()
            )

    async def expect(self, timeout: float | None) -> bytes:
        """The same where the call must not end yet: InternalError."""
        message = await self.receive(timeout)
        if message is None:
            raise InternalError("the server ended the stream early")
        return message

    def cancel(self) -> None:
        """Ends the call, unless it has ended."""
        self._call.cancel()
