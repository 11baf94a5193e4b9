"""Hits of rays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hulld.answers.collisions import Answers, SeparatedInterval


@dataclass(frozen=True)
class Hits:
    """The placements that rays meet: k rows, ascending by ray, then by time.

    rays, placements: k indices. times: k, from 0 at the origin of the ray to 1 at its end; a time
    that no double represents becomes the next one. points: k x 3, on the ray at that time. normals:
    k x 3, of unit length, out of the facet that is met; NaN if the ray starts in contact.
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
        """The first hit of each ray that meets a placement."""
        rows = np.unique(self.rays, return_index=True)[1]
        return Hits(
            self.rays[rows],
            self.placements[rows],
            self.times[rows],
            self.points[rows],
            self.normals[rows],
        )


def _normal(proof: Sequence[SeparatedInterval]) -> npt.NDArray[np.float64]:
    """The plane that separates a ray from a hull until they meet is that of the facet."""
    if not proof or proof[-1].direction is None:
        return np.full(3, np.nan)
    # Integers may exceed doubles; their quotients do not.
    largest = max(abs(n) for n in proof[-1].direction)
    n = np.array([-x / largest for x in proof[-1].direction]) + 0.0
    normal: npt.NDArray[np.float64] = n / np.linalg.norm(n)
    return normal


def hits_of(
    answers: Answers, origins: npt.NDArray[np.float64], ends: npt.NDArray[np.float64]
) -> Hits:
    """The hits among the answers of all rays with all placements, row by row."""
    count = len(answers) // len(origins) if len(origins) else 0
    empty = np.empty(0)
    all_times = answers.contact_times if answers.contact_times is not None else empty
    rows = np.flatnonzero(~np.isnan(all_times))
    rows = rows[np.lexsort((all_times[rows], rows // max(count, 1)))]
    rays, placements, times = rows // max(count, 1), rows % max(count, 1), all_times[rows]
    along = times[:, np.newaxis]
    proofs = [answers.motion_proofs.get(int(row), ()) for row in rows]
    return Hits(
        rays.astype(np.uint32),
        placements.astype(np.uint32),
        times,
        (1 - along) * origins[rays] + along * ends[rays],
        np.array([_normal(proof) for proof in proofs]).reshape(-1, 3),
    )
