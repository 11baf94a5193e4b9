"""A call whose both sides stream, with a bound on each wait."""

from __future__ import annotations

import queue
import threading
from typing import Any

import grpc

from hulld.errors import HulldError, InternalError, from_rpc_error

_END: Any = object()


class Duplex:
    """gRPC's own iterators wait without a bound. A thread reads instead, so that every wait has
    one. For one thread, but for cancel and send, which any thread may call."""

    def __init__(self, call: Any, metadata: Any, most_waiting: int | None = None) -> None:
        """most_waiting: messages that are read before `receive` asks for them; then the server has
        to wait. None: all. That is for calls whose answers are bounded by what was sent."""
        self._outgoing: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self._incoming: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self._room = threading.Semaphore(most_waiting) if most_waiting else None
        self._end: HulldError | None = None
        self._ended = False
        self._call = call(iter(self._outgoing.get, _END), metadata=metadata)
        self._reader = threading.Thread(target=self._read, name="hulld-reader", daemon=True)
        self._reader.start()

    def _read(self) -> None:
        end: HulldError | None = None
        try:
            for message in self._call:
                self._incoming.put(message)
                if self._room is not None:
                    self._room.acquire()
        except grpc.RpcError as error:
            end = from_rpc_error(error)
        self._incoming.put((_END, end))
        # Releases gRPC's thread that waits for something to send.
        self._outgoing.put(_END)

    def send(self, message: bytes) -> None:
        """Queues a message. Where the call has ended, receive tells why."""
        self._outgoing.put(message)

    def close_sending(self) -> None:
        """Says that nothing follows."""
        self._outgoing.put(_END)

    def receive(self, timeout: float | None) -> bytes | None:
        """The next message; None where the call has ended well. TimeoutError: none came within
        `timeout` seconds; 0 looks only. HulldError: how the call ended; every later call raises it
        again."""
        if not self._ended:
            try:
                item = self._incoming.get(timeout != 0, timeout)
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
        """The same where the call must not end yet: InternalError."""
        message = self.receive(timeout)
        if message is None:
            raise InternalError("the server ended the stream early")
        return message

    def cancel(self) -> None:
        """Ends the call, unless it has ended."""
        self._call.cancel()
        self._outgoing.put(_END)
        if self._room is not None:
            self._room.release()
