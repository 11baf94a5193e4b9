"""The attempts of one call, within its deadline."""

from __future__ import annotations

import time

from hulld.errors import HulldError
from hulld.retry import RetryPolicy


class Attempts:
    """Counts the attempts of a call; the clients wait in between."""

    def __init__(self, policy: RetryPolicy, safe_to_repeat: bool, timeout: float | None) -> None:
        self._policy = policy if safe_to_repeat else RetryPolicy(max_attempts=1)
        self._deadline = None if timeout is None else time.monotonic() + timeout
        self._failures = 0

    def remaining(self) -> float | None:
        """Seconds until the deadline; None: there is none."""
        return None if self._deadline is None else max(0.0, self._deadline - time.monotonic())

    def wait_after(self, error: HulldError) -> float:
        """The seconds to wait after this attempt. Raises `error` where there is no other."""
        self._failures += 1
        wait = self._policy.wait_after(self._failures, error, self.remaining())
        if wait is None:
            raise error from None
        return wait
