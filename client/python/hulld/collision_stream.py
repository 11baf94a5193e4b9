"""Repeated queries while poses change."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

from hulld.answers.assembly import StepAssembly
from hulld.answers.collisions import StreamAnswer
from hulld.calls.requests import update_stream
from hulld.calls.transport import Duplex
from hulld.calls.wanted import Wanted
from hulld.errors import (
    DeadlineExceededError,
    FailedPreconditionError,
    HulldError,
    InternalError,
    read_answer,
)
from hulld.geometry.placements import check_update
from hulld.geometry.poses import PosesLike

#: The indices of moved placements, and their new poses.
Update = tuple[npt.ArrayLike, PosesLike]


class CollisionStream:
    """A StreamCollisions call, step by step: the client sends poses and receives the relations of
    the affected pairs. The server caches the evidence that decided each pair and tries it first at
    the next poses, so that small motions are cheap.

    Never retried, because the server's state ends with the stream. Not thread-safe. A context
    manager that ends the call. Created by Client.stream_collisions.
    """

    def __init__(
        self,
        call: Any,
        metadata: Any,
        opening: bytes,
        placements: int,
        pairs: npt.NDArray[np.uint32],
        wanted: Wanted,
        orthogonality_tolerance: float,
        timeout: float | None,
    ) -> None:
        self._call = call
        self._metadata = metadata
        self._opening = opening
        self._placements = placements
        self._pairs = pairs
        self._wanted = wanted
        self._orthogonality_tolerance = orthogonality_tolerance
        self._timeout = timeout
        self._count = 0
        self._failed: HulldError | None = None
        self._connection: Duplex | None = None
        self._opened: StreamAnswer | None = None
        self._ensure_open()  # sync only

    @property
    def opened(self) -> StreamAnswer:
        """The answer to the opening message: every pair, at the first poses."""
        if self._opened is None:
            raise RuntimeError("the stream is not open yet; enter it, or await open()")
        return self._opened

    def _ensure_open(self) -> StreamAnswer:
        """Opens the stream if it is not open. Returns the answer to the opening message."""
        if self._opened is None:
            self._opened = self._ask(self._opening)
        return self._opened

    def update(
        self, placements: npt.ArrayLike, poses: PosesLike, *, refresh_hulls: bool = False
    ) -> StreamAnswer:
        """Moves placements. Returns the answers for all pairs with a moved placement or, with
        only_changes, for the pairs whose relation changed.

        placements: k distinct indices into the placements of the stream.
        poses: the new poses, k x 7, k x 4 x 4, or k x 3.
        refresh_hulls: resolves all hulls again first. If a hull has changed, its placements count
        as moved.

        ValueError: an index is out of range, a pose is malformed, or there are not k poses. Nothing
        was sent, and the stream remains usable. HulldError: the stream has ended; all later calls
        raise the same error.
        """
        moved = check_update(placements, poses, self._placements, self._orthogonality_tolerance)
        self._ensure_open()
        return self._ask(update_stream(*moved, refresh_hulls))

    def refresh(self) -> StreamAnswer:
        """Resolves every hull again, and answers the pairs of changed hulls."""
        self._ensure_open()
        return self._ask(update_stream(np.empty(0, np.uint32), np.empty((0, 7)), True))

    def follow(self, updates: Iterable[Update]) -> Iterator[StreamAnswer]:
        """The answer to each update, (placements, poses), in order."""
        for placements, poses in updates:
            yield self.update(placements, poses)

    def close(self) -> None:
        """Ends the stream, and waits for the server to confirm. HulldError: the call failed."""
        if self._failed is not None or self._connection is None:
            return
        self._failed = FailedPreconditionError("the collision stream is closed")
        self._connection.close_sending()
        try:
            if self._connection.receive(self._timeout) is not None:
                raise InternalError("the server sent more answers than there were requests")
        except TimeoutError:
            self._connection.cancel()

    def __enter__(self) -> CollisionStream:
        self._ensure_open()
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is None:
            self.close()
        else:
            self._failed = self._failed or FailedPreconditionError("the collision stream is closed")
            if self._connection is not None:
                self._connection.cancel()

    def __del__(self) -> None:
        connection = getattr(self, "_connection", None)
        if connection is not None:
            connection.cancel()

    def _ask(self, request: bytes) -> StreamAnswer:
        if self._failed is not None:
            raise self._failed
        if self._connection is None:
            self._connection = Duplex(self._call, self._metadata)
        step = StepAssembly(self._count, self._pairs, self._wanted)
        self._count += 1
        try:
            self._connection.send(request, self._timeout)
            while not read_answer(step.add, self._connection.expect(self._timeout)):
                pass
            return read_answer(lambda _: step.finish(), None)
        except TimeoutError:
            failed: HulldError = DeadlineExceededError(
                f"the server did not answer within {self._timeout} s"
            )
        except HulldError as error:
            failed = error
        self._failed = failed
        self._connection.cancel()
        raise failed
