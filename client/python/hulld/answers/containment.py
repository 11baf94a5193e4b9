"""Points inside, on, or outside a hull: the query as a batch, and its answer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hulld.answers.collisions import Answers, Batch, Relation
from hulld.answers.equality import ArrayFields
from hulld.answers.status import Limits
from hulld.geometry.placements import Placement, Placements
from hulld.geometry.points import Points
from hulld.geometry.poses import pack_pose, pack_poses

#: Maximum number of points per call: about 4 MiB.
_POINTS_PER_CALL = 1 << 16
_ORIGIN = np.zeros((1, 3))


@dataclass(frozen=True, repr=False, eq=False)
class Containment(ArrayFields):
    """The positions of n points, as in `points[found.inside]`.

    relations: of each point to the hull, as Relation in uint8. separations, separation_bounds: if
    requested, the distance from the hull (minus the depth below the surface inside it, 0 on its
    boundary) and its proven bound; otherwise None.
    """

    relations: npt.NDArray[np.uint8]
    separations: npt.NDArray[np.float64] | None
    separation_bounds: npt.NDArray[np.float64] | None

    @property
    def inside(self) -> npt.NDArray[np.bool_]:
        """n: strictly inside. Always false for a flat hull, which has no interior."""
        return self._are(Relation.OVERLAPPING)

    @property
    def on(self) -> npt.NDArray[np.bool_]:
        """n: exactly on the boundary, or anywhere in a flat hull."""
        return self._are(Relation.TOUCHING)

    @property
    def outside(self) -> npt.NDArray[np.bool_]:
        """n: not in the hull. Always true for an empty hull."""
        return self._are(Relation.SEPARATED)

    def _are(self, relation: Relation) -> npt.NDArray[np.bool_]:
        found: npt.NDArray[np.bool_] = self.relations == relation
        return found

    def __len__(self) -> int:
        return len(self.relations)

    def __bool__(self) -> bool:
        raise TypeError("answers are neither true nor false; use .inside.all() or .outside.any()")

    def __repr__(self) -> str:
        counts = [int(mask.sum()) for mask in (self.inside, self.on, self.outside)]
        return "Containment({} inside, {} on, {} outside)".format(*counts)


class PointQuery:
    """The points of a call, as pairs with a hull. Each point is the same inline shape, the origin,
    translated to the point, which is exact."""

    def __init__(self, hull: Placement, orthogonality_tolerance: float) -> None:
        self._ids = [] if hull.id is None else [hull.id]
        self._shapes: list[Points] = [_ORIGIN] if hull.shape is None else [hull.shape, _ORIGIN]
        self._pose = pack_pose(hull.pose, orthogonality_tolerance=orthogonality_tolerance)

    def pairs(self, points: Points) -> tuple[Placements, npt.NDArray[np.uint32]]:
        """The placements, the hull first, and the pairs of the hull with each point."""
        indices = np.ones(len(points) + 1, np.uint32)
        indices[0] = 0
        poses = np.vstack([self._pose, pack_poses(points)])
        placements = Placements(self._ids, poses, indices, shapes=self._shapes)
        pairs = np.zeros((len(points), 2), np.uint32)
        pairs[:, 1] = np.arange(1, len(points) + 1)
        return placements, pairs


def points_per_call(limits: Limits) -> int:
    """The maximum number of points per call that the server accepts."""
    return max(1, min(_POINTS_PER_CALL, limits.max_pairs_per_batch, limits.max_placements - 1))


def require_answers(batch: Batch, first: int) -> Answers:
    """The answers of a batch. Raises the error of the first point without one. first: the first
    point."""
    missing = np.flatnonzero(batch.answers.relations == Relation.UNSPECIFIED)
    if missing.size:
        row = int(missing[0])
        # A problem of the hull is not a problem of the point.
        raise batch.error(row, "" if batch.placement_problems else f"points[{first + row}]: ")
    return batch.answers


def collect(parts: Sequence[Answers], separation: bool) -> Containment:
    """Concatenates the answers of consecutive calls."""
    relations = [part.relations for part in parts]
    values = [part.separations for part in parts if part.separations is not None]
    bounds = [part.separation_bounds for part in parts if part.separation_bounds is not None]
    return Containment(
        np.concatenate([np.empty(0, np.uint8), *relations]),
        np.concatenate([np.empty(0), *values]) if separation else None,
        np.concatenate([np.empty(0), *bounds]) if separation else None,
    )
