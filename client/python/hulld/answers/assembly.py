"""Puts the messages of a batch, a scene, or a step of a stream together, whole columns per
message."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hulld.answers.collision_messages import ColumnReader, Frame
from hulld.answers.collisions import Batch, Scene, StreamAnswer
from hulld.calls.wanted import Wanted
from hulld.v1 import collision_pb2


class BatchAssembly:
    """Assembles the answer to BatchCheckCollisions."""

    def __init__(self, pairs: npt.NDArray[np.uint32], wanted: Wanted) -> None:
        self._pairs = pairs
        self._frame = Frame(ColumnReader(wanted))

    def add(self, data: bytes) -> None:
        """ValueError: the message does not follow the previous one."""
        before = self._frame.columns.rows
        self._frame.read(collision_pb2.BatchCheckCollisionsResponse, data)
        if self._frame.columns.rows > before and self._frame.numbers.get("first_pair", 0) != before:
            raise ValueError("the batch's answers are out of order")

    def finish(self) -> Batch:
        """ValueError: something is missing."""
        frame = self._frame
        if frame.header is None or frame.columns.rows != len(self._pairs):
            raise ValueError(
                f"the batch ended with {frame.columns.rows} answers for {len(self._pairs)} pairs"
            )
        return Batch(self._pairs, *frame.finish())


class SceneAssembly:
    """Assembles the answer to FindCollisions."""

    def __init__(self, wanted: Wanted) -> None:
        self._frame = Frame(ColumnReader(wanted))

    def add(self, data: bytes) -> None:
        self._frame.read(collision_pb2.FindCollisionsResponse, data)

    def finish(self) -> Scene:
        """ValueError: something is missing."""
        frame = self._frame
        pairs = frame.indices()
        if frame.header is None or frame.totals is None or pairs.size != 2 * frame.columns.rows:
            raise ValueError("the scene ended early, or its pairs and answers disagree")
        return Scene(pairs.reshape(-1, 2), *frame.finish(), frame.totals)


class StepAssembly:
    """The messages that answer one message of StreamCollisions."""

    def __init__(self, update: int, pairs: npt.NDArray[np.uint32], wanted: Wanted) -> None:
        self._update = update
        self._pairs = pairs
        self._frame = Frame(ColumnReader(wanted))

    def add(self, data: bytes) -> bool:
        """Returns true for the last message of the step. ValueError: the message belongs to another
        step."""
        self._frame.read(collision_pb2.StreamCollisionsResponse, data)
        update = self._frame.numbers.get("update", 0)
        if update != self._update:
            raise ValueError(f"the server answered message {update}, not {self._update}")
        return bool(self._frame.numbers.get("last", 0))

    def finish(self) -> StreamAnswer:
        """ValueError: something is missing."""
        frame = self._frame
        rows = frame.indices()
        if (
            frame.header is None
            or rows.size != frame.columns.rows
            or (rows.size and int(rows.max()) >= len(self._pairs))
        ):
            raise ValueError("the answer's pairs and columns disagree")
        return StreamAnswer(self._pairs[rows], *frame.finish(), self._update, rows)
