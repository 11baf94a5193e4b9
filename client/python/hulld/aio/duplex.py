"""A call whose both sides stream, with a bound on each wait."""

from __future__ import annotations

import asyncio
from typing import Any

import grpc

from hulld.errors import CancelledError, HulldError, InternalError, from_rpc_error, from_status

_END: Any = object()


class AsyncDuplex:
    """A task reads all the while: gRPC tells how a call ended only when all that came before is
    read, and a write to a call that has ended waits for that. Made in a running loop. For one task,
    but for cancel and send, which any task of the loop may call."""

    def __init__(self, call: Any, metadata: Any, most_waiting: int | None = None) -> None:
        """As Duplex."""
        self._call = call(metadata=metadata)
        self._incoming: asyncio.Queue[Any] = asyncio.Queue()
        self._room = asyncio.Semaphore(most_waiting) if most_waiting else None
        self._end: HulldError | None = None
        self._ended = False
        self._reader = asyncio.get_running_loop().create_task(self._read())

    async def _read(self) -> None:
        end: HulldError | None = None
        try:
            while (message := await self._call.read()) is not grpc.aio.EOF:
                self._incoming.put_nowait(message)
                if self._room is not None:
                    await self._room.acquire()
            code = await self._call.code()
            if code is not grpc.StatusCode.OK:
                trailing = await self._call.trailing_metadata()
                end = from_status(code.name, await self._call.details() or "", trailing)
        except grpc.RpcError as error:
            end = from_rpc_error(error)
        except asyncio.CancelledError:
            end = CancelledError("the call was cancelled")
        self._incoming.put_nowait((_END, end))

    async def send(self, message: bytes) -> None:
        """Waits until there is room for it on the way. Where the call has ended, nothing happens,
        and receive tells why."""
        try:
            await self._call.write(message)
        except (grpc.RpcError, asyncio.InvalidStateError):
            pass
        except asyncio.CancelledError:
            # Either this task was cancelled, with which gRPC cancels the call, or the call alone.
            task = asyncio.current_task()
            if task is not None and task.cancelling() > 0:
                raise

    async def close_sending(self) -> None:
        """Says that nothing follows."""
        try:
            await self._call.done_writing()
        except (grpc.RpcError, asyncio.InvalidStateError):
            pass

    async def receive(self, timeout: float | None) -> bytes | None:
        """The next message; None where the call has ended well. TimeoutError: none came within
        `timeout` seconds. HulldError: how the call ended; every later call raises it again."""
        if not self._ended:
            try:
                item = await asyncio.wait_for(self._incoming.get(), timeout)
            except asyncio.TimeoutError:
                raise TimeoutError from None
            if not isinstance(item, tuple):
                if self._room is not None:
                    self._room.release()
                message: bytes = item
                return message
            self._ended, self._end = True, item[1]
        if self._end is not None:
            raise self._end
        return None

    async def expect(self, timeout: float | None) -> bytes:
        """The same where the call must not end yet: InternalError."""
        message = await self.receive(timeout)
        if message is None:
            raise InternalError("the server ended the stream early")
        return message

    def cancel(self) -> None:
        """Ends the call, unless it has ended."""
        self._call.cancel()
        if self._room is not None:
            self._room.release()
