"""The position of a watch of hulls across all its connections."""

from __future__ import annotations

import dataclasses

from hulld.answers.hulls import Header, HullChanges


class WatchPosition:
    """The header up to which changes were received."""

    def __init__(self, after: Header | None) -> None:
        self.after = after
        self.connected = False
        self._has_events = False

    def take(self, changes: HullChanges, first: bool) -> HullChanges:
        """Advances the position. first: of its connection. A call that could not resume starts with
        the full state, without the deletions in between; the message says so."""
        resumed = self.after is not None and self.after.revision > 0
        if first and self._has_events and not resumed:
            changes = dataclasses.replace(changes, restarted=True)
        self.connected = True
        self._has_events = self._has_events or bool(changes.events)
        self.after = changes.header
        return changes
