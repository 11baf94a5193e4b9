"""Watches of hulls, and of colliding pairs."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy.typing as npt

from hulld.answers.collision_messages import decode_collision_changes
from hulld.answers.collisions import CollisionChanges
from hulld.answers.hulls import Header, HullChanges
from hulld.calls.attempts import Search
from hulld.calls.reported_pairs import ReportedPairs, WatchedPlacements
from hulld.calls.requests import Call, update_stream
from hulld.calls.transport import Duplex, Event, Lock, cancel_call, pause, read
from hulld.calls.watch_position import WatchPosition
from hulld.errors import HulldError, InternalError, UnavailableError, read_answer
from hulld.geometry.placements import check_update
from hulld.geometry.poses import PosesLike
from hulld.retry import RetryPolicy

#: Messages that a watch reads ahead. The server merges changes behind them.
MAX_WAITING = 16


class HullWatch:
    """An iterator over changes of hulls: first the initial state, then a message with `synced`,
    then changes as they are committed, in the order of their revisions. A slow reader misses
    intermediate states, but never the last one. After a lost connection, the watch resumes without
    repeating events.

    The iteration ends when any thread calls `cancel`; only one thread may iterate. As a context
    manager, it cancels the watch. HulldError: the server refuses the watch, or was not reached
    again in time. Created by Client.watch_hulls.
    """

    def __init__(
        self,
        start: Callable[[Call[HullChanges]], Any],
        request: Callable[[Header | None], Call[HullChanges]],
        after: Header | None,
        retry: RetryPolicy,
        reconnect_timeout: float | None,
    ) -> None:
        request(after)  # Raises for wrong arguments, before there is a connection.
        self._start = start
        self._request = request
        self._position = WatchPosition(after)
        self._retry = retry
        self._reconnect_timeout = reconnect_timeout
        self._call: Any = None
        self._cancelled = Event()

    @property
    def position(self) -> Header | None:
        """The position at which to resume: Client.watch_hulls(..., after=position)."""
        return self._position.after

    def __iter__(self) -> Iterator[HullChanges]:
        return self

    def __next__(self) -> HullChanges:
        search = Search(self._retry, self._reconnect_timeout, self._position.connected)
        while not self._cancelled.is_set():
            request = self._request(self._position.after)
            first = self._call is None
            if first:
                self._call = self._start(request)
                # By another thread, which did not see the call.
                if self._cancelled.is_set():
                    break
            try:
                message = read(self._call)
                if message is not None:
                    return self._position.take(read_answer(request.decode, message), first)
                failed: HulldError = UnavailableError("the server ended the watch")
            except HulldError as error:
                failed = error
            cancel_call(self._call)
            self._call = None
            if not self._cancelled.is_set():
                pause(self._cancelled, search.wait_after(failed))
        self.cancel()
        raise StopIteration

    def cancel(self) -> None:
        """Ends the iteration permanently."""
        self._cancelled.set()
        call = self._call
        if call is not None:
            cancel_call(call)

    def __enter__(self) -> HullWatch:
        return self

    def __exit__(self, *_: object) -> None:
        self.cancel()

    def __del__(self) -> None:
        if hasattr(self, "_cancelled"):
            self.cancel()


class CollisionWatch:
    """An iterator over pairs that start or stop colliding, or being within a clearance, because
    their poses change (by `update`) or because their hulls change, which the server detects.
    Changes of a pair between two messages are reported as one event, or as none if they cancel out.
    After a lost connection, the watch resumes with the current poses: it reports the changes since
    then, without repeating events, and sets `synced` again.

    The watch connects at the first iteration, and ends when it is cancelled. Only one thread may
    iterate; any thread may call `update` and `cancel`. As a context manager, it cancels the watch.
    HulldError: the server refuses the watch, or was not reached again in time. Created by
    Client.watch_collisions.
    """

    def __init__(
        self,
        call: Any,
        metadata: Any,
        watched: WatchedPlacements,
        retry: RetryPolicy,
        reconnect_timeout: float | None,
    ) -> None:
        self._call = call
        self._metadata = metadata
        self._watched = watched
        self._reported = ReportedPairs(watched)
        self._retry = retry
        self._reconnect_timeout = reconnect_timeout
        # Messages are sent in the order of the pose changes, and a call begins with all of them.
        self._lock = Lock()
        self._connection: Duplex | None = None
        self._updates_before = 0
        self._first = self._connected = False
        self._cancelled = Event()

    def __iter__(self) -> Iterator[CollisionChanges]:
        return self

    def __next__(self) -> CollisionChanges:
        search = Search(self._retry, self._reconnect_timeout, self._connected)
        while not self._cancelled.is_set():
            connection = self._open()
            # By another thread, which did not see the connection.
            if self._cancelled.is_set():
                break
            try:
                message = connection.receive(None)
                if message is not None:
                    return self._take(read_answer(decode_collision_changes, message))
                # The client never ends its side.
                failed: HulldError = InternalError("the server ended the watch without an error")
            except HulldError as error:
                failed = error
            # After an answer that cannot be read, the call is still open.
            connection.cancel()
            with self._lock:
                self._connection = None
            if not self._cancelled.is_set():
                pause(self._cancelled, search.wait_after(failed))
        self.cancel()
        raise StopIteration

    def _open(self) -> Duplex:
        with self._lock:
            if self._connection is None:
                self._connection = Duplex(self._call, self._metadata, MAX_WAITING)
                self._updates_before = self._watched.updates
                self._first = True
                self._connection.send(self._watched.opening(), None)
            return self._connection

    def _take(self, changes: CollisionChanges) -> CollisionChanges:
        if self._first and self._connected:
            self._reported.restart()
        self._first, self._connected = False, True
        return self._reported.take(changes, self._updates_before)

    def update(self, placements: npt.ArrayLike, poses: PosesLike) -> None:
        """Moves placements; arguments and ValueError are as in CollisionStream.update. Updates are
        counted from 1, and messages that reflect this update have its number, or a higher one, in
        `update`. While disconnected, the watch keeps the poses for the next connection."""
        watched = self._watched
        indices, packed = check_update(
            placements, poses, len(watched.placements), watched.orthogonality_tolerance
        )
        with self._lock:
            watched.move(indices, packed)
            if self._connection is not None:
                self._connection.send(update_stream(indices, packed, False), None)

    def cancel(self) -> None:
        """Ends the iteration permanently."""
        self._cancelled.set()
        connection = self._connection
        if connection is not None:
            connection.cancel()

    def __enter__(self) -> CollisionWatch:
        return self

    def __exit__(self, *_: object) -> None:
        self.cancel()

    def __del__(self) -> None:
        if hasattr(self, "_cancelled"):
            self.cancel()
