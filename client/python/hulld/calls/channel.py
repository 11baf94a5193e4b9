"""gRPC's channel, opened by the first call, and its behavior in forked processes."""

from __future__ import annotations

import os
import threading
import weakref
from collections.abc import Callable
from typing import Any, NoReturn

from hulld.connection import Connection
from hulld.errors import FailedPreconditionError


class Channel:
    """A channel that opens at the first call. gRPC, which would otherwise take most of the time of
    `import hulld`, is imported at that time."""

    def __init__(
        self,
        connection: Connection,
        opener: Callable[[Connection, Any], Any],
        running_loop: Callable[[], Any],
    ) -> None:
        """opener: creates gRPC's channel for the connection and its PEM files. running_loop:
        returns the event loop to which a new channel belongs; None: any."""
        self._connection = connection
        self._opener = opener
        self._running_loop = running_loop
        self._loop: Any = None
        self._pem_files = connection.pem_files()
        self._lock = threading.Lock()
        self._channel: Any = None
        self._closed = False
        self._calls: dict[str, Any] = {}

    def __reduce__(self) -> NoReturn:
        raise TypeError(
            "a client can neither be copied nor sent to another process; create another one with "
            "its address, client.server"
        )

    def get(self) -> Any:
        """gRPC's channel. FailedPreconditionError: the channel is closed or belongs to another
        event loop; or as in check_process."""
        check_process()
        with self._lock:
            if self._closed:
                raise FailedPreconditionError("the client is closed; create a new one")
            if self._channel is None:
                # gRPC's own fork support blocks a fork forever while a channel is reconnecting, and
                # forked processes cannot make calls anyway.
                os.environ.setdefault("GRPC_ENABLE_FORK_SUPPORT", "0")
                self._channel = self._opener(self._connection, self._pem_files)
                self._loop = self._running_loop()
                _open_channels.add(self)
            elif self._loop not in (None, self._running_loop()):
                raise FailedPreconditionError(
                    "the client belongs to the event loop of its first call; create one in each "
                    "asyncio.run"
                )
            return self._channel

    def call(self, kind: str, method: str) -> Any:
        """gRPC's callable of a method; kind: as in "unary_unary"."""
        channel = self.get()
        return self._calls.get(method) or self._calls.setdefault(
            method, getattr(channel, kind)(method)
        )

    def close(self) -> Any:
        """Closes the channel. Returns gRPC's result, which asyncio awaits; None: nothing to do."""
        self._closed = True
        if self._channel is None or _is_forked:
            return None
        _open_channels.discard(self)
        return self._channel.close()


_open_channels: weakref.WeakSet[Channel] = weakref.WeakSet()
_is_forked = False


def _note_fork() -> None:
    global _is_forked
    _is_forked = _is_forked or len(_open_channels) > 0


os.register_at_fork(after_in_child=_note_fork)


def check_process() -> None:
    """FailedPreconditionError: the parent of this process had connections when it forked. gRPC's
    threads are missing in the child: calls would hang or fail at random, even with new clients."""
    if _is_forked:
        raise FailedPreconditionError(
            f"process {os.getpid()} was forked while its parent had an open hulld client, which "
            'gRPC does not support; start processes with multiprocessing\'s "spawn" or '
            '"forkserver" method, or close every client before the fork'
        )


def is_forked() -> bool:
    """True if check_process raises."""
    return _is_forked
