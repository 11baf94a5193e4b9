"""Asks again and again while poses change."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from types import TracebackType
from typing import Any

import numpy as np
import numpy.typing as npt

from hulld.answers.assembly import StepAssembly
from hulld.answers.collisions import StreamAnswer
from hulld.calls.duplex import Duplex
from hulld.calls.freshness import Freshness
from hulld.calls.requests import open_stream, update_stream
from hulld.calls.wanted import Wanted
from hulld.errors import (
    DeadlineExceededError,
    FailedPreconditionError,
    HulldError,
    InternalError,
    read_answer,
)
from hulld.geometry.placements import Placements, as_indices
from hulld.geometry.poses import PosesLike, pack_poses

#: Which placements move, and where to.
Update = tuple[npt.ArrayLike, PosesLike]


class CollisionStream:
    """One StreamCollisions call, step by step: poses go up, the relations of the pairs that they
    change come down. What decided a pair is kept by the server and tried first at its next poses,
    so that small motions cost little.

    Never retried: what the server keeps of a stream ends with it. For one thread. A context
    manager, which ends the call. Made by Client.stream_collisions.
    """

    def __init__(
        self,
        call: Any,
        metadata: Any,
        placements: Placements,
        pairs: npt.NDArray[np.uint32],
        wanted: Wanted,
        tolerance: float,
        only_changes: bool,
        freshness: Freshness | None,
        timeout: float | None,
    ) -> None:
        self._placements = len(placements)
        self._pairs = pairs
        self._wanted = wanted
        self._timeout = timeout
        self._count = 0
        self._failed: HulldError | None = None
        self._connection = Duplex(call, metadata)
        self._opened = self._ask(
            open_stream(placements, pairs, wanted, tolerance, only_changes, freshness)
        )

    @property
    def opened(self) -> StreamAnswer:
        """The answer to the opening: every pair, at the first poses."""
        return self._opened

    def update(
        self, placements: npt.ArrayLike, poses: PosesLike, *, refresh_hulls: bool = False
    ) -> StreamAnswer:
        """Moves placements, and answers every pair that this concerns, or with only_changes those
        whose relation changed.

        placements: k indices into those of the stream, each at most once. poses: the new pose of
        each: k x 7, k x 4 x 4 or k x 3. refresh_hulls: looks every hull up anew before answering;
        hulls that changed count as moved.

        Raises ValueError, before anything is sent: an index out of range; poses that are none, or
        not k. HulldError: the stream has ended, and every later call raises it again.
        """
        return self._ask(encode_update(placements, poses, self._placements, refresh_hulls))

    def refresh(self) -> StreamAnswer:
        """Looks every hull up anew, and answers the pairs whose hulls changed."""
        return self._ask(update_stream(np.empty(0, np.uint32), np.empty((0, 7)), True))

    def follow(self, updates: Iterable[Update]) -> Iterator[StreamAnswer]:
        """The answer to each of the updates, (placements, poses), one after another."""
        for placements, poses in updates:
            yield self.update(placements, poses)

    def close(self) -> None:
        """Says that nothing follows, and waits for the end. HulldError: how the call ended, if not
        well."""
        if self._failed is not None:
            return
        self._failed = FailedPreconditionError("the collision stream is closed")
        self._connection.close_sending()
        try:
            if self._connection.receive(self._timeout) is not None:
                raise InternalError("the server answered more than it was asked")
        except TimeoutError:
            self._connection.cancel()

    def __enter__(self) -> CollisionStream:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if kind is None:
            self.close()
        else:
            self._failed = self._failed or FailedPreconditionError("the collision stream is closed")
            self._connection.cancel()

    def __del__(self) -> None:
        connection = getattr(self, "_connection", None)
        if connection is not None:
            connection.cancel()

    def _ask(self, request: bytes) -> StreamAnswer:
        if self._failed is not None:
            raise self._failed
        step = StepAssembly(self._count, self._pairs, self._wanted)
        self._count += 1
        self._connection.send(request)
        try:
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


def check_update(
    placements: npt.ArrayLike, poses: PosesLike, count: int
) -> tuple[npt.NDArray[np.uint32], npt.NDArray[np.float64]]:
    """Indices of some of `count` placements, and their poses, packed; errors as in
    CollisionStream.update."""
    indices = as_indices(placements, count, "placements").reshape(-1)
    packed = pack_poses(poses)
    if len(packed) != len(indices):
        raise ValueError(f"there are {len(packed)} poses for {len(indices)} placements")
    return indices, packed


def encode_update(
    placements: npt.ArrayLike, poses: PosesLike, count: int, refresh_hulls: bool
) -> bytes:
    """A message that moves placements; errors as in CollisionStream.update."""
    return update_stream(*check_update(placements, poses, count), refresh_hulls)
