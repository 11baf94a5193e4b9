"""The state of a watch of collisions across all its connections: poses and reported pairs."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from hulld.answers.collisions import (
    CollisionChanges,
    CollisionEvent,
    CollisionEventKind,
    Problem,
    Relation,
)
from hulld.calls.requests import SceneFilter, open_watch
from hulld.geometry.placements import Placements
from hulld.geometry.poses import ORTHOGONALITY_TOLERANCE

_COLLIDING = (Relation.OVERLAPPING, Relation.TOUCHING)


class WatchedPlacements:
    """The placements of a watch at their current poses, and the number of updates."""

    def __init__(
        self,
        placements: Placements,
        pairs: npt.NDArray[np.uint32] | None,
        scene: SceneFilter,
        clearance: float | None,
        orthogonality_tolerance: float = ORTHOGONALITY_TOLERANCE,
    ) -> None:
        self.placements = Placements(
            placements.ids,
            placements.poses.copy(),
            placements.indices,
            shapes=placements.shapes,
            radii=placements.radii,
            end_poses=placements.end_poses,
        )
        self.clearance = clearance
        self.orthogonality_tolerance = orthogonality_tolerance
        self.updates = 0
        self._pairs = pairs
        self._scene = scene
        self.opening()  # Raises for wrong arguments, before there is a connection.

    def move(self, indices: npt.NDArray[np.uint32], poses: npt.NDArray[np.float64]) -> None:
        self.placements.poses[indices] = poses
        self.updates += 1

    def opening(self) -> bytes:
        """The first message of a call that begins at the current poses."""
        return open_watch(self.placements, self._pairs, self._scene, self.clearance)

    def hull_of(self, placement: int) -> str:
        """Empty for an inline shape."""
        subject = self.placements.subject(placement)
        return subject if isinstance(subject, str) else ""


class ReportedPairs:
    """Merges the messages of a lost call and of its replacement, which starts with the full state:
    drops events already reported, and adds the end events of pairs that no longer collide. Memory:
    the pairs that collide or are near."""

    def __init__(self, watched: WatchedPlacements) -> None:
        self._watched = watched
        self._reported: dict[tuple[int, int], tuple[Relation, bool]] = {}
        self._problems: dict[int, str] = {}
        self._revisions: dict[str, int] = {}
        # From restart until `synced`: the pairs that the current call reported.
        self._repeated: set[tuple[int, int]] | None = None

    def restart(self) -> None:
        """The next message is the first of another call."""
        self._repeated = set()

    def take(self, changes: CollisionChanges, updates_before: int) -> CollisionChanges:
        """The message as a single uninterrupted call would have sent it."""
        for hull in changes.hulls:
            self._revisions[hull.hull_id] = hull.revision
            for placement in [p for p in self._problems if self._hull_of(p) == hull.hull_id]:
                del self._problems[placement]
        problems = self._take_problems(changes.placement_problems)
        events = [new for event in changes.events if (new := self._take_event(event))]
        if self._repeated is not None and changes.synced:
            for pair in [pair for pair in self._reported if pair not in self._repeated]:
                events.append(self._end_of(pair, self._reported.pop(pair)[0]))
            self._repeated = None
        return dataclasses.replace(
            changes,
            update=updates_before + changes.update,
            placement_problems=problems,
            events=tuple(events),
        )

    def _hull_of(self, placement: int) -> str:
        return self._watched.hull_of(placement)

    def _take_problems(self, problems: Mapping[int, Problem]) -> dict[int, Problem]:
        kept = {}
        for placement, problem in problems.items():
            if self._repeated is None or self._problems.get(placement) != problem.message:
                kept[placement] = problem
            self._problems[placement] = problem.message
        return kept

    def _take_event(self, event: CollisionEvent) -> CollisionEvent | None:
        """None: the state of the pair was already reported."""
        now = (event.relation, bool(event.within_clearance))
        before = self._reported.pop(event.placements, (Relation.UNSPECIFIED, False))
        if now[0] in _COLLIDING or now[1]:
            self._reported[event.placements] = now
        if self._repeated is None:
            return event
        self._repeated.add(event.placements)
        if now == before:
            return None
        # A new call does not know the earlier relation.
        if now[0] == Relation.SEPARATED and before[0] in _COLLIDING:
            return dataclasses.replace(event, kind=CollisionEventKind.EXIT)
        return event

    def _end_of(self, pair: tuple[int, int], before: Relation) -> CollisionEvent:
        if pair[0] in self._problems or pair[1] in self._problems:
            lost = CollisionEventKind.LOST
            return CollisionEvent(lost, pair, Relation.UNSPECIFIED, (0, 0), None)
        kind = CollisionEventKind.EXIT if before in _COLLIDING else CollisionEventKind.FAR
        a, b = (self._revisions.get(self._hull_of(placement), 0) for placement in pair)
        within = None if self._watched.clearance is None else False
        return CollisionEvent(kind, pair, Relation.SEPARATED, (a, b), within)
