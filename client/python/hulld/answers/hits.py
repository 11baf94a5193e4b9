"""Hits of rays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hulld.answers.collisions import Answers, Relation, Scene, SeparatedInterval
from hulld.answers.equality import ArrayFields


@dataclass(frozen=True, eq=False)
class Hits(ArrayFields):
    """The placements that rays meet: k rows, ascending by ray, then by time.

    rays, placements: k indices. times: k, from 0 at the origin of the ray to 1 at its end; a time
    that is not a double is rounded up to the next one. For a placement with a radius or a rotation,
    a time is at most 2^-30 late, and NaN if the relation is WITHIN_TOLERANCE, which leaves open
    whether the ray hits it. points: k x 3, on the ray at that time. normals: k x 3, of unit length,
    outward from the facet that is hit. Within rounding of an edge or vertex, they are normal to
    some plane with the placement on one side; NaN if the ray starts in contact.
    """

    rays: npt.NDArray[np.uint32]
    placements: npt.NDArray[np.uint32]
    times: npt.NDArray[np.float64]
    points: npt.NDArray[np.float64]
    normals: npt.NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.rays)

    def __bool__(self) -> bool:
        raise TypeError("hits are neither true nor false; use len()")

    def __repr__(self) -> str:
        return f"Hits({len(self)} of {len(np.unique(self.rays))} rays)"

    def first(self) -> Hits:
        """The first hit of each ray that hits a placement."""
        rows = np.unique(self.rays, return_index=True)[1]
        return Hits(
            self.rays[rows],
            self.placements[rows],
            self.times[rows],
            self.points[rows],
            self.normals[rows],
        )


def _normal(proof: Sequence[SeparatedInterval]) -> npt.NDArray[np.float64]:
    """The plane that separates a ray from a hull until they meet is the plane of the facet, except
    within rounding of an edge or vertex."""
    if not proof or proof[-1].direction is None:
        return np.full(3, np.nan)
    direction = proof[-1].end_direction or proof[-1].direction
    # Integers may exceed doubles; their quotients do not.
    largest = max(abs(n) for n in direction)
    n = np.array([-x / largest for x in direction]) + 0.0
    normal: npt.NDArray[np.float64] = n / np.linalg.norm(n)
    return normal


def _proof(answers: Answers, row: int) -> Sequence[SeparatedInterval]:
    """The intervals of a row; for a body, those of the piece that is hit."""
    for one in answers.piece_proofs.get(row, ()):
        if one.relation != Relation.SEPARATED:
            return one.intervals
    return answers.motion_proofs.get(row, ())


def hits_of(found: Scene, origins: npt.NDArray[np.float64], ends: npt.NDArray[np.float64]) -> Hits:
    """The hits in a scene of rays, and then other placements."""
    answers = found.answers
    all_times = np.empty(0) if answers.contact_times is None else answers.contact_times
    by_time = np.argsort(all_times, kind="stable")
    rows = by_time[np.argsort(found.pairs[by_time, 0], kind="stable")]
    rays, times = found.pairs[rows, 0], all_times[rows]
    along = times[:, np.newaxis]
    normals = [_normal(_proof(answers, int(row))) for row in rows]
    return Hits(
        rays,
        found.pairs[rows, 1] - np.uint32(len(origins)),
        times,
        (1 - along) * origins[rays] + along * ends[rays],
        np.array(normals).reshape(-1, 3),
    )
