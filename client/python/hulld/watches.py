"""Tells of hulls, and of pairs, as they change."""

from __future__ import annotations

import dataclasses
import math
import threading
import time
from collections.abc import Callable, Iterator
from types import TracebackType
from typing import Any

import grpc
import numpy.typing as npt

from hulld.answers.collision_messages import decode_collision_changes
from hulld.answers.collisions import CollisionChanges
from hulld.answers.hulls import Header, HullChanges
from hulld.calls.duplex import Duplex
from hulld.calls.requests import Call, update_stream
from hulld.calls.told_pairs import ToldPairs, WatchedPlacements
from hulld.collision_stream import check_update
from hulld.errors import HulldError, InternalError, UnavailableError, from_rpc_error, read_answer

from hulld.geometry.poses import PosesLike
from hulld.retry import RetryPolicy


#: Messages that a watch reads ahead. Behind them, what changes is put together by the server.
MOST_WAITING = 16


class Search:
    """The search for a server that was lost. It takes its time from the first failure on, however
    long it was quiet before."""

    def __init__(self, retry: RetryPolicy, patience: float | None) -> None:
        self._retry = retry
        self._patience = math.inf if patience is None else patience
        self._deadline = math.inf
        self._failures = 0

    def wait_after(self, error: HulldError, connected: bool) -> float:
        """The seconds to wait before the next attempt. `connected`: there was a server, so that
        only time bounds the attempts. Raises `error` where there is no other."""
        if self._failures == 0:
            self._deadline = time.monotonic() + self._patience
        self._failures += 1
        attempts = math.inf if connected else None
        remaining = self._deadline - time.monotonic()
        wait = self._retry.wait_after(self._failures, error, remaining, attempts)
        if wait is None:
            raise error
        return wait


class WatchPosition:
    """Where a watch of hulls is, over all its connections."""

    def __init__(self, after: Header | None) -> None:
        self.after = after
        self.connected = False
        self._told = False

    def take(self, changes: HullChanges, first: bool) -> HullChanges:
        """`first`: of its connection. A call that resumed nothing tells everything, but not what
        went meanwhile."""
        resumed = self.after is not None and (self.after.revision > 0 or bool(self.after.shards))
        if first and self._told and not resumed:
            changes = dataclasses.replace(changes, anew=True)
        self.connected = True
        self._told = self._told or bool(changes.events)
        self.after = changes.header
        return changes


class HullWatch:
    """An iterator over what happens to hulls: first what is there, then a message with `synced`,
    then changes as they are committed, in the order of their revisions. A slow reader misses states
    in between, and never the last one. A watch whose connection is lost goes on where it was.

    It ends when it is cancelled, by any thread; iterating is for one. A context manager, which
    cancels it. Raises HulldError where the server refuses it, or was not found again in time. Made
    by Client.watch_hulls.
    """

    def __init__(
        self,
        start: Callable[[Call[HullChanges]], Any],
        request: Callable[[Header | None], Call[HullChanges]],
        after: Header | None,
        retry: RetryPolicy,
        patience: float | None,
    ) -> None:
        self._start = start
        self._request = request
        self._position = WatchPosition(after)
        self._retry = retry
        self._patience = patience
        self._lock = threading.Lock()
        self._call: Any = None
        self._cancelled = False

    @property
    def position(self) -> Header | None:
        """From where another watch can resume: Client.watch_hulls(..., after=position)."""
        return self._position.after

    def __iter__(self) -> Iterator[HullChanges]:
        return self

    def __next__(self) -> HullChanges:
        search = Search(self._retry, self._patience)
        while True:
            request = self._request(self._position.after)
            with self._lock:
                if self._cancelled:
                    raise StopIteration
                first = self._call is None
                if first:
                    self._call = self._start(request)
                call = self._call
            try:
                return self._position.take(read_answer(request.decode, next(call)), first)
            except StopIteration:
                error: HulldError = UnavailableError("the server ended the watch")
            except grpc.RpcError as rpc_error:
                error = from_rpc_error(rpc_error)
            with self._lock:
                self._call = None
                if self._cancelled:
                    raise StopIteration
            time.sleep(search.wait_after(error, self._position.connected))

    def cancel(self) -> None:
        """Ends the iteration, now and ever after."""
        with self._lock:
            self._cancelled = True
            if self._call is not None:
                self._call.cancel()

    def __enter__(self) -> HullWatch:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.cancel()

    def __del__(self) -> None:
        if hasattr(self, "_lock"):
            self.cancel()


class CollisionWatch:
    """An iterator over pairs that begin and end to collide, or to be within a clearance: because
    their poses change, which `update` says, and because their hulls change, which the server sees
    by itself. What happened between two messages is told as one event, or as none where it is as it
    was. A watch whose connection is lost goes on with the poses as they are by then: it tells what
    changed meanwhile, and nothing twice, and is `synced` once more.

    It connects when it is first asked, and ends when it is cancelled. Iterating is for one thread;
    update and cancel are for any. A context manager, which cancels it. Raises HulldError where the
    server refuses it, or was not found again in time. Made by Client.watch_collisions.
    """

    def __init__(
        self,
        call: Any,
        metadata: Any,
        watched: WatchedPlacements,
        retry: RetryPolicy,
        patience: float | None,
    ) -> None:
        self._call = call
        self._metadata = metadata
        self._watched = watched
        self._told = ToldPairs(watched)
        self._retry = retry
        self._patience = patience
        # Guards the poses, and that a call begins with them.
        self._lock = threading.Lock()
        self._connection: Duplex | None = None
        self._updates_before = 0
        self._first = self._connected = self._cancelled = False

    def __iter__(self) -> Iterator[CollisionChanges]:
        return self

    def __next__(self) -> CollisionChanges:
        search = Search(self._retry, self._patience)
        while True:
            connection = self._open()
            try:
                message = connection.receive(None)
                if message is not None:
                    return self._take(read_answer(decode_collision_changes, message))
                # The client never says that it has said all.
                error: HulldError = InternalError("the server ended the watch without a cause")
            except HulldError as ended:
                error = ended
            # It may not have ended: an answer that cannot be read is an error, too.
            connection.cancel()
            with self._lock:
                self._connection = None
                if self._cancelled:
                    raise StopIteration
            time.sleep(search.wait_after(error, self._connected))

    def _open(self) -> Duplex:
        with self._lock:
            if self._cancelled:
                raise StopIteration
            if self._connection is None:
                self._connection = Duplex(self._call, self._metadata, MOST_WAITING)
                self._connection.send(self._watched.opening())
                self._updates_before = self._watched.updates
                self._first = True
            return self._connection

    def _take(self, changes: CollisionChanges) -> CollisionChanges:
        if self._first and self._connected:
            self._told.start_anew()
        self._first, self._connected = False, True
        return self._told.take(changes, self._updates_before)

    def update(self, placements: npt.ArrayLike, poses: PosesLike) -> None:
        """Says where placements are now; arguments and ValueError as in CollisionStream.update. The
        message that takes it into account has its number in `update`, counted from 1. While there
        is no connection it is noted, for the next."""
        indices, packed = check_update(placements, poses, len(self._watched.placements))
        with self._lock:
            self._watched.move(indices, packed)
            if self._connection is not None:
                self._connection.send(update_stream(indices, packed, False))

    def cancel(self) -> None:
        """Ends the iteration, now and ever after."""
        with self._lock:
            self._cancelled = True
            if self._connection is not None:
                self._connection.cancel()

    def __enter__(self) -> CollisionWatch:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.cancel()

    def __del__(self) -> None:
        if hasattr(self, "_connection"):
            self.cancel()
