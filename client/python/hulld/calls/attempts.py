"""Attempts of a call, and attempts to reach a lost server."""

from __future__ import annotations

import dataclasses
import time

from hulld.errors import HulldError
from hulld.retry import RetryPolicy


class Attempts:
    """Counts the attempts of a call within its deadline; the clients wait in between."""

    def __init__(self, policy: RetryPolicy, safe_to_repeat: bool, timeout: float | None) -> None:
        self._policy = policy if safe_to_repeat else RetryPolicy(max_attempts=1)
        self._deadline = None if timeout is None else time.monotonic() + timeout
        self._failures = 0

    def remaining(self) -> float | None:
        """Seconds until the deadline; None: unbounded."""
        return None if self._deadline is None else max(0.0, self._deadline - time.monotonic())

    def wait_after(self, error: HulldError) -> float:
        """The seconds to wait after this attempt. Raises `error` if it was the last."""
        self._failures += 1
        wait = self._policy.wait_after(self._failures, error, self.remaining())
        if wait is None:
            raise error from None
        return wait


class Search:
    """Attempts to reach a lost server. The deadline counts from the first failure, regardless of
    how long the connection was quiet before."""

    def __init__(
        self, policy: RetryPolicy, reconnect_timeout: float | None, connected: bool
    ) -> None:
        """connected: True if the server was reached before; then only `reconnect_timeout` bounds
        the attempts."""
        self._policy = dataclasses.replace(policy, max_attempts=None) if connected else policy
        self._reconnect_timeout = reconnect_timeout
        self._attempts: Attempts | None = None

    def wait_after(self, error: HulldError) -> float:
        """Like Attempts.wait_after."""
        if self._attempts is None:
            self._attempts = Attempts(self._policy, True, self._reconnect_timeout)
        return self._attempts.wait_after(error)
