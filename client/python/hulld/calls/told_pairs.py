"""What a watch of collisions has told, over all its connections."""

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

_COLLIDING = (Relation.OVERLAPPING, Relation.TOUCHING)


class WatchedPlacements:
    """Where the placements of a watch are by now, and how many updates said so."""

    def __init__(
        self,
        placements: Placements,
        pairs: npt.NDArray[np.uint32] | None,
        scene: SceneFilter,
        clearance: float | None,
    ) -> None:
        self.placements = Placements(placements.ids, placements.poses.copy(), placements.indices)
        self.clearance = clearance
        self.updates = 0
        self._pairs = pairs
        self._scene = scene

    def move(self, indices: npt.NDArray[np.uint32], poses: npt.NDArray[np.float64]) -> None:
        self.placements.poses[indices] = poses
        self.updates += 1

    def opening(self) -> bytes:
        """The first message of a call that begins with what is known by now."""
        return open_watch(self.placements, self._pairs, self._scene, self.clearance)

    def hull_of(self, placement: int) -> str:
        return self.placements.ids[int(self.placements.indices[placement])]


class ToldPairs:
    """A call that takes the place of one that was lost begins by telling everything. This leaves
    out what is known and adds what ended in between, so that both tell what one would have told.
    Memory: the pairs that collide or are near."""

    def __init__(self, watched: WatchedPlacements) -> None:
        self._watched = watched
        self._told: dict[tuple[int, int], tuple[Relation, bool]] = {}
        self._problems: dict[int, str] = {}
        self._revisions: dict[str, int] = {}
        # From start_anew until `synced`: the pairs that the present call told of.
        self._retold: set[tuple[int, int]] | None = None

    def start_anew(self) -> None:
        """What comes next is the first message of another call."""
        self._retold = set()

    def take(self, changes: CollisionChanges, updates_before: int) -> CollisionChanges:
        """Notes a message, and makes of it what it would be had there been one call."""
        for hull in changes.hulls:
            self._revisions[hull.hull_id] = hull.revision
            for placement in [p for p in self._problems if self._hull_of(p) == hull.hull_id]:
                del self._problems[placement]
        problems = self._take_problems(changes.placement_problems)
        events = [told for event in changes.events if (told := self._take_event(event))]
        if self._retold is not None and changes.synced:
            for pair in [pair for pair in self._told if pair not in self._retold]:
                events.append(self._end_of(pair, self._told.pop(pair)[0]))
            self._retold = None
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
            if self._retold is None or self._problems.get(placement) != problem.message:
                kept[placement] = problem
            self._problems[placement] = problem.message
        return kept

    def _take_event(self, event: CollisionEvent) -> CollisionEvent | None:
        """None: the state of the pair was known."""
        now = (event.relation, bool(event.within_clearance))
        before = self._told.pop(event.placements, (Relation.UNSPECIFIED, False))
        if now[0] in _COLLIDING or now[1]:
            self._told[event.placements] = now
        if self._retold is None:
            return event
        self._retold.add(event.placements)
        if now == before:
            return None
        # The other call compares with nothing.
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
