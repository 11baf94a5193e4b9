"""Operations that wait: calls, streams, pauses. hulld.aio.transport defines the same names for
asyncio; generate_aio.py derives the asynchronous clients from the modules that use them."""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Iterator
from typing import Any, Union, cast

from hulld.calls.channel import Channel, check_process, is_forked
from hulld.connection import Connection
from hulld.errors import HulldError, InternalError, from_rpc_error
from hulld.geometry.points import PointsLike

#: Points of a call: an array, or an iterator of arrays that are sent as they arrive.
PointsSource = Union[PointsLike, Iterator[PointsLike]]

Event = threading.Event
Lock = threading.Lock
sleep = time.sleep
_END: Any = object()


def open_channel(connection: Connection, pem_files: Any) -> Any:
    """gRPC's channel."""
    import grpc
    import grpc.experimental

    # Streamed answers then need no separate thread. Observed: saves 2 ms per call.
    options = [
        *connection.options(),
        (grpc.experimental.ChannelOptions.SingleThreadedUnaryStream, 1),
    ]
    if pem_files is None:
        return grpc.insecure_channel(connection.target, options)
    credentials = grpc.ssl_channel_credentials(*pem_files)
    return grpc.secure_channel(connection.target, credentials, options)


def running_loop() -> None:
    """Returns None: a channel belongs to no event loop."""


def close_channel(channel: Channel) -> None:
    """Closes a channel and every call on it."""
    channel.close()


def pause(event: Event, seconds: float) -> None:
    """Waits until the event is set, at most this many seconds."""
    event.wait(seconds)


def cancel_call(call: Any) -> None:
    """Ends a call, unless it belongs to the parent of a forked process."""
    if not is_forked():
        call.cancel()


def invoke(call: Any, request: Any, timeout: float | None, metadata: Any) -> bytes:
    """The answer of a call. request: one message, or an iterator of messages. HulldError: the call
    failed."""
    import grpc

    try:
        answer: bytes = call(request, timeout=timeout, metadata=metadata)
    except grpc.RpcError as error:
        raise from_rpc_error(error) from None
    return answer


def read(call: Any) -> bytes | None:
    """The next message of a stream of answers; None: the stream ended without an error.
    HulldError: the call failed."""
    import grpc

    check_process()
    try:
        message: bytes | None = next(call, None)
    except grpc.RpcError as error:
        raise from_rpc_error(error) from None
    return message


def is_iterator(points: PointsSource) -> bool:
    """True if `points` yields arrays one by one."""
    return isinstance(points, Iterator)


def each(points: PointsSource) -> Iterator[PointsLike]:
    """The arrays of `points`. A list or tuple counts as an array."""
    if isinstance(points, Iterator):
        yield from points
    else:
        yield cast(PointsLike, points)


class Duplex:
    """A bidirectional streaming call with a bound on each wait. gRPC's own iterators wait without a
    bound, so a thread reads. Not thread-safe, except for `cancel` and `send`."""

    def __init__(self, call: Any, metadata: Any, max_waiting: int | None = None) -> None:
        """max_waiting: the maximum number of messages read ahead of `receive`; beyond it, the
        server waits. None: unbounded, for calls whose requests bound their answers."""
        check_process()
        self._outgoing: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self._incoming: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self._room = threading.Semaphore(max_waiting) if max_waiting else None
        self._end: HulldError | None = None
        self._ended = False
        self._call = call(iter(self._outgoing.get, _END), metadata=metadata)
        self._reader = threading.Thread(target=self._read, name="hulld-reader", daemon=True)
        self._reader.start()

    def _read(self) -> None:
        import grpc

        end: HulldError | None = None
        try:
            for message in self._call:
                self._incoming.put(message)
                if self._room is not None:
                    self._room.acquire()
        except grpc.RpcError as error:
            end = from_rpc_error(error)
        self._incoming.put((_END, end))
        # Releases gRPC's thread, which waits for a message to send.
        self._outgoing.put(_END)

    @property
    def ready(self) -> bool:
        """True if `receive` would not wait."""
        return self._ended or not self._incoming.empty()

    def send(self, message: bytes, timeout: float | None) -> None:
        """Queues a message. If the call has ended, does nothing; `receive` raises the error."""
        check_process()
        self._outgoing.put(message)

    def close_sending(self) -> None:
        """Ends this side of the call."""
        self._outgoing.put(_END)

    def receive(self, timeout: float | None) -> bytes | None:
        """The next message; None: the call ended without an error. TimeoutError: no message within
        `timeout` seconds. HulldError: the call failed; later calls raise the error again."""
        check_process()
        if not self._ended:
            try:
                item = self._incoming.get(True, timeout)
            except queue.Empty:
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

    def expect(self, timeout: float | None) -> bytes:
        """Like `receive`, for a call that must not end yet. InternalError: the call ended."""
        message = self.receive(timeout)
        if message is None:
            raise InternalError("the server ended the stream early")
        return message

    def cancel(self) -> None:
        """Ends the call if it has not ended."""
        cancel_call(self._call)
        self._outgoing.put(_END)
        if self._room is not None:
            self._room.release()
