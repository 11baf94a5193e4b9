"""The error of an invalid certificate."""

from __future__ import annotations


class VerificationError(Exception):
    """A certificate does not prove the answer, or cannot be checked. moved: the hull or body has
    been changed or deleted since the answer; a new answer can be checked."""

    def __init__(self, reason: str, *, moved: bool = False) -> None:
        super().__init__(reason)
        self.moved = moved
