"""The connection of a client and its calls, with timeouts and retries."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, Protocol, Self, TypeVar

from hulld import arguments
from hulld.calls.attempts import Attempts
from hulld.calls.channel import Channel
from hulld.calls.freshness import Freshness
from hulld.calls.requests import Call, Page, as_fresh
from hulld.calls.transport import (
    cancel_call,
    close_channel,
    invoke,
    open_channel,
    read,
    running_loop,
    sleep,
)
from hulld.connection import DEFAULT_SERVER, Connection, Tls
from hulld.errors import HulldError, read_answer
from hulld.notebook import Viewer
from hulld.retry import RetryPolicy

R = TypeVar("R", covariant=True)
T = TypeVar("T")

DEFAULT_TIMEOUT = 30.0


class Assembly(Protocol[R]):
    """Assembles the parts of an answer. ValueError: they are inconsistent."""

    def add(self, data: bytes) -> None:
        ...

    def finish(self) -> R:
        ...


class ClientBase:
    """Like Client, with the same arguments. Its methods are for subclasses that add calls."""

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
        self._timeout = arguments.seconds(timeout)
        self._retry = retry
        self._channel = Channel(self._connection, open_channel, running_loop)

    @property
    def server(self) -> str:
        """The address, with its port."""
        return self._connection.server

    @property
    def channel(self) -> Any:
        """gRPC's channel, for the generated stubs in hulld.v1; opened if necessary. Calls through
        it carry no token."""
        return self._channel.get()

    def close(self) -> None:
        """Ends the connection and every call on it."""
        close_channel(self._channel)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"hulld.{type(self).__name__}({self.server!r})"

    def _seconds(self, timeout: float | None) -> float | None:
        return self._timeout if timeout is None else arguments.seconds(timeout)

    def _start(self, call: Call[Any], timeout: float | None) -> Any:
        """Starts a call with a streamed answer."""
        method = self._channel.call("unary_stream", call.method)
        return method(call.request, timeout=timeout, metadata=self._connection.metadata())

    def _unary(self, call: Call[T], timeout: float | None, freshness: Freshness | None = None) -> T:
        call = as_fresh(call, freshness)
        method = self._channel.call("unary_unary", call.method)
        metadata = self._connection.metadata()
        attempts = Attempts(self._retry, call.safe_to_repeat, self._seconds(timeout))
        while True:
            try:
                answer = invoke(method, call.request, attempts.remaining(), metadata)
                return read_answer(call.decode, answer)
            except HulldError as error:
                sleep(attempts.wait_after(error))

    def _items(
        self,
        page_at: Callable[[str], Call[Page[T]]],
        timeout: float | None,
        freshness: Freshness | None,
    ) -> Iterator[T]:
        """The items of a list, page by page. page_at: the call for a page token."""
        token = ""
        while True:
            page = self._unary(page_at(token), timeout, freshness)
            yield from page.items
            token = page.next_page
            freshness = freshness and freshness.for_next_page(page.header)
            if not token:
                return

    def _whole(
        self,
        call: Call[Any],
        assembly: Callable[[], Assembly[R]],
        timeout: float | None,
        freshness: Freshness | None,
    ) -> R:
        """The assembled messages of an answer. Retried from the start."""
        call = as_fresh(call, freshness)
        attempts = Attempts(self._retry, call.safe_to_repeat, self._seconds(timeout))
        while True:
            parts = assembly()
            stream = self._start(call, attempts.remaining())
            try:
                while (data := read(stream)) is not None:
                    read_answer(parts.add, data)
                return read_answer(lambda _: parts.finish(), None)
            except HulldError as error:
                failed = error
            finally:
                cancel_call(stream)
            sleep(attempts.wait_after(failed))
