"""hulld.calls.transport for asyncio."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Iterator
from typing import Any, Union, cast

from hulld.calls.channel import Channel, check_process, is_forked
from hulld.connection import Connection
from hulld.errors import CancelledError, HulldError, InternalError, from_rpc_error, from_status
from hulld.geometry.points import PointsLike

#: Points of a call: an array, or a synchronous or asynchronous iterator of arrays that are sent
#: as they arrive.
PointsSource = Union[PointsLike, Iterator[PointsLike], AsyncIterator[PointsLike]]

Event = asyncio.Event
Lock = asyncio.Lock
sleep = asyncio.sleep
_END: Any = object()


def open_channel(connection: Connection, pem_files: Any) -> Any:
    """gRPC's channel, for the running loop."""
    import grpc.aio

    if pem_files is None:
        return grpc.aio.insecure_channel(connection.target, connection.options())
    credentials = grpc.ssl_channel_credentials(*pem_files)
    return grpc.aio.secure_channel(connection.target, credentials, connection.options())


def running_loop() -> asyncio.AbstractEventLoop | None:
    """The running event loop, to which a new channel belongs; None: no loop is running."""
    try:
        return asyncio.get_running_loop()
    except RuntimeError:
        return None


async def close_channel(channel: Channel) -> None:
    """Closes a channel and every call on it."""
    closing = channel.close()
    if closing is not None:
        await closing


async def pause(event: Event, seconds: float) -> None:
    """Waits until the event is set, at most this many seconds."""
    with contextlib.suppress(TimeoutError):
        await asyncio.wait_for(event.wait(), seconds)


def cancel_call(call: Any) -> None:
    """Ends a call, unless it belongs to the parent of a forked process."""
    if not is_forked():
        call.cancel()


async def invoke(call: Any, request: Any, timeout: float | None, metadata: Any) -> bytes:
    """Calls a method with a message, or with an asynchronous iterator of messages. HulldError: the
    call failed."""
    import grpc

    try:
        answer: bytes = await call(request, timeout=timeout, metadata=metadata)
    except grpc.RpcError as error:
        raise from_rpc_error(error) from None
    return answer


async def read(call: Any) -> bytes | None:
    """The next message of a stream of answers; None: the stream ended without an error.
    HulldError: the call failed. hulld.CancelledError means that the call was cancelled, not the
    task."""
    import grpc.aio

    check_process()
    try:
        message = await call.read()
    except grpc.RpcError as error:
        raise from_rpc_error(error) from None
    except asyncio.CancelledError:
        if _is_task_cancelled():
            raise
        raise CancelledError("the call was cancelled") from None
    except UnboundLocalError:
        # grpc 1.51 raises it if the task is cancelled just after the call has ended.
        raise asyncio.CancelledError from None
    return None if message is grpc.aio.EOF else message


def _is_task_cancelled() -> bool:
    task = asyncio.current_task()
    return task is not None and task.cancelling() > 0


def is_iterator(points: PointsSource) -> bool:
    """True if `points` yields arrays one by one."""
    return isinstance(points, (AsyncIterator, Iterator))


async def each(points: PointsSource) -> AsyncIterator[PointsLike]:
    """The arrays of `points`. A list or tuple counts as an array."""
    if isinstance(points, AsyncIterator):
        async for block in points:
            yield block
    elif isinstance(points, Iterator):
        for block in points:
            yield block
    else:
        yield cast(PointsLike, points)


class Duplex:
    """A bidirectional streaming call with a bound on each wait. A task reads, because gRPC reports
    the end of a call only after all earlier messages are read, and a write to a finished call waits
    for that. Create it in a running loop. For use by one task, except for `cancel` and `send`."""

    def __init__(self, call: Any, metadata: Any, max_waiting: int | None = None) -> None:
        check_process()
        self._call = call(metadata=metadata)
        self._incoming: asyncio.Queue[Any] = asyncio.Queue()
        self._room = asyncio.Semaphore(max_waiting) if max_waiting else None
        self._end: HulldError | None = None
        self._ended = False
        self._reader = asyncio.get_running_loop().create_task(self._read())

    async def _read(self) -> None:
        import grpc.aio

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
        except (asyncio.CancelledError, UnboundLocalError):
            # UnboundLocalError: as in `read`.
            end = CancelledError("the call was cancelled")
        self._incoming.put_nowait((_END, end))

    @property
    def ready(self) -> bool:
        """True if `receive` would not wait."""
        return self._ended or not self._incoming.empty()

    async def send(self, message: bytes, timeout: float | None) -> None:
        """Sends a message; waits while the connection is congested. TimeoutError: not sent within
        `timeout` seconds. If the call has ended, does nothing; `receive` raises the error."""
        import grpc

        check_process()
        try:
            async with asyncio.timeout(timeout):
                await self._call.write(message)
        except (grpc.RpcError, asyncio.InvalidStateError):
            pass
        except asyncio.CancelledError:
            # If only the call was cancelled, this task continues.
            if _is_task_cancelled():
                raise

    async def close_sending(self) -> None:
        """Ends this side of the call."""
        import grpc

        try:
            await self._call.done_writing()
        except (grpc.RpcError, asyncio.InvalidStateError):
            pass

    async def receive(self, timeout: float | None) -> bytes | None:
        """The next message; None: the call ended without an error. TimeoutError: no message within
        `timeout` seconds. HulldError: the call failed; later calls raise the error again."""
        check_process()
        if not self._ended:
            item = await asyncio.wait_for(self._incoming.get(), timeout)
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
        """Like `receive`, for a call that must not end yet. InternalError: the call ended."""
        message = await self.receive(timeout)
        if message is None:
            raise InternalError("the server ended the stream early")
        return message

    def cancel(self) -> None:
        """Ends the call if it has not ended."""
        cancel_call(self._call)
        if self._room is not None:
            self._room.release()
