"""Rays: points that move from an origin to an end."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hulld.geometry.placements import Placements
from hulld.geometry.points import as_points
from hulld.geometry.poses import pack_poses

Vectors = npt.NDArray[np.float64]


def ray_ends(origins: npt.ArrayLike, directions: npt.ArrayLike) -> tuple[Vectors, Vectors]:
    """The origins and ends of rays, n x 3 each; a single origin or direction applies to all rays.
    ValueError: other shapes; an origin, direction, or end that is not finite."""
    starts = as_points(origins, "origins").astype(np.float64)
    along = as_points(directions, "directions").astype(np.float64)
    if len(starts) != len(along) and 1 not in (len(starts), len(along)):
        raise ValueError(f"there are {len(starts)} origins and {len(along)} directions")
    starts, along = np.broadcast_arrays(starts, along)
    with np.errstate(over="ignore"):
        ends = starts + along
    as_points(ends, "(origins + directions)")
    return starts, ends


def with_rays(targets: Placements, starts: Vectors, ends: Vectors) -> Placements:
    """The rays, and then the targets."""
    shape = len(targets.ids) + len(targets.shapes)
    radii = np.zeros(len(targets)) if targets.radii is None else targets.radii
    at_end = targets.poses if targets.end_poses is None else targets.end_poses
    return Placements(
        targets.ids,
        np.vstack([pack_poses(starts), targets.poses]),
        np.concatenate([np.full(len(starts), shape, np.uint32), targets.indices]),
        shapes=[*targets.shapes, np.zeros((1, 3))],
        radii=np.concatenate([np.zeros(len(starts)), radii]),
        end_poses=np.vstack([pack_poses(ends), at_end]),
    )
