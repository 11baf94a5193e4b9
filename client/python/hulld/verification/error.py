"""The error of a certificate that does not hold."""

from __future__ import annotations


class VerificationError(Exception):
    """A certificate does not prove the answer, or cannot be checked. moved: the hull or body has
    changed since, or is gone; a new answer may be checked."""

    def __init__(self, reason: str, *, moved: bool = False) -> None:
        super().__init__(reason)
        self.moved = moved
