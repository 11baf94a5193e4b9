"""Placements: hulls and bodies at poses, packed for the wire."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Union

import numpy as np
import numpy.typing as npt

from hulld import arguments
from hulld.geometry.poses import (
    ORTHOGONALITY_TOLERANCE,
    PackedPoses,
    Pose,
    PoseLike,
    PosesLike,
    QuaternionOrder,
    pack_pose,
    pack_poses,
)
from hulld.wire import MessageWriter

_HULL_IDS, _HULLS, _POSES = 1, 2, 3  # fields of PackedPlacements


@dataclass(frozen=True)
class Placement:
    """The hull or body with this ID, at a pose; None: the identity."""

    id: str
    pose: PoseLike = None

    def __post_init__(self) -> None:
        arguments.hull_id(self.id, "the ID of a placement")


#: A hull or body at a pose: its ID, a Placement, or (ID, pose).
PlacementLike = Union[str, Placement, tuple[str, PoseLike]]


def as_placement(placement: PlacementLike) -> Placement:
    """TypeError: not a placement. ValueError: a malformed ID."""
    if isinstance(placement, Placement):
        return placement
    if isinstance(placement, str):
        return Placement(placement)
    if isinstance(placement, tuple) and len(placement) == 2 and isinstance(placement[0], str):
        return Placement(*placement)
    raise TypeError(
        f"{placement!r} is not a placement; pass an ID, (ID, pose), or hulld.Placement(ID, pose)"
    )


class Placements:
    """Many placements of few hulls or bodies: each ID once, the poses as one array.

    ids: the distinct IDs. poses: for each placement, as in pack_poses; None: the identity.
    indices: for each placement, the index of its ID; None: each ID is placed once, or a single ID
    as often as there are poses. orthogonality_tolerance, quaternion_order: as in pack_poses.

        Placements("cube", poses)                        # one hull at n poses
        Placements(["arm", "box"], poses)                # two hulls, two poses
        Placements(["arm", "box"], poses, [0, 1, 1, 1])  # four placements of two hulls

    ValueError: the lists do not fit each other, or hold a malformed ID.
    """

    def __init__(
        self,
        ids: str | Sequence[str],
        poses: PosesLike | None = None,
        indices: npt.ArrayLike | None = None,
        *,
        orthogonality_tolerance: float = ORTHOGONALITY_TOLERANCE,
        quaternion_order: QuaternionOrder = "wxyz",
    ) -> None:
        self.ids: list[str] = [ids] if isinstance(ids, str) else list(ids)
        for index, one in enumerate(self.ids):
            arguments.hull_id(one, f"ids[{index}]")
        packed: PackedPoses | None = None
        if poses is not None:
            packed = pack_poses(
                poses,
                orthogonality_tolerance=orthogonality_tolerance,
                quaternion_order=quaternion_order,
            )
        if indices is None:
            many = len(self.ids) == 1 and packed is not None
            chosen = (
                np.zeros(len(packed), np.uint32)
                if many and packed is not None
                else np.arange(len(self.ids), dtype=np.uint32)
            )
        else:
            chosen = as_indices(indices, len(self.ids), "indices")
        if packed is None:
            packed = np.tile(pack_pose(None), (len(chosen), 1))
        if len(packed) != len(chosen):
            raise ValueError(f"there are {len(packed)} poses for {len(chosen)} placements")
        self.indices: npt.NDArray[np.uint32] = chosen
        self.poses: PackedPoses = packed

    @classmethod
    def of(
        cls, placements: PlacementsLike, *, orthogonality_tolerance: float = ORTHOGONALITY_TOLERANCE
    ) -> Placements:
        """Packs placements."""
        if isinstance(placements, cls):
            return placements
        if isinstance(placements, str):
            raise TypeError(
                f"{placements!r} is one ID; pass a list of placements, or "
                f"Placements({placements!r}, poses)"
            )
        single = [as_placement(placement) for placement in placements]  # type: ignore[union-attr]
        places: dict[str, int] = {}
        indices = [places.setdefault(placement.id, len(places)) for placement in single]
        rows = [placement.pose for placement in single]
        return cls(
            list(places),
            rows,
            np.array(indices, np.uint32),
            orthogonality_tolerance=orthogonality_tolerance,
        )

    def __len__(self) -> int:
        return len(self.indices)

    def __getitem__(self, index: int) -> Placement:
        return Placement(self.ids[self.indices[index]], Pose.from_packed(self.poses[index]))

    def __repr__(self) -> str:
        return f"Placements({len(self)} of {len(self.ids)} IDs)"

    def packed(self) -> MessageWriter:
        """The message PackedPlacements."""
        return (
            MessageWriter()
            .strings(_HULL_IDS, self.ids)
            .uint32s(_HULLS, self.indices)
            .doubles(_POSES, self.poses)
        )


PlacementsLike = Union[Placements, Iterable[PlacementLike]]


def as_integers(values: npt.ArrayLike, name: str) -> npt.NDArray[Any]:
    """`values` as an array of integers. TypeError: not integers."""
    array = arguments.as_array(values, name)
    if array.size == 0:
        return np.empty(array.shape, np.uint32)
    if array.dtype.kind not in "iu":
        raise TypeError(f"{name} holds {array.dtype}, not integers")
    return array


def as_indices(values: npt.ArrayLike, count: int, name: str) -> npt.NDArray[np.uint32]:
    """`values` as indices below `count`, in their shape. ValueError names the first that is not;
    TypeError: not integers."""
    array = as_integers(values, name)
    if not array.size:
        return np.empty(array.shape, np.uint32)
    if not (array.min() >= 0 and array.max() < count):
        at = np.argwhere((array < 0) | (array >= count))[0]
        raise ValueError(
            f"{name}{arguments.place(tuple(at))} is {array[tuple(at)]}; there are {count}, counted "
            "from 0"
        )
    return array.astype(np.uint32, copy=False)


def as_pairs(pairs: npt.ArrayLike, count: int) -> npt.NDArray[np.uint32]:
    """m x 2 indices of placements. ValueError: another shape, or an index out of range."""
    array = arguments.as_array(pairs, "pairs")
    if array.size == 0:
        array = np.empty((0, 2), np.uint32)
    if array.ndim != 2 or array.shape[1] != 2:
        raise ValueError(
            f"pairs has the shape {array.shape}; it takes (m, 2), two indices of placements in "
            "each row"
        )
    return as_indices(array, count, "pairs")


def all_pairs(count: int) -> npt.NDArray[np.uint32]:
    """Every pair of `count` placements once, the lower index first: (m, 2)."""
    return np.stack(np.triu_indices(count, 1), axis=1).astype(np.uint32)


def check_update(
    placements: npt.ArrayLike, poses: PosesLike, count: int, orthogonality_tolerance: float
) -> tuple[npt.NDArray[np.uint32], PackedPoses]:
    """The indices of moved placements, of `count`, and their packed poses; errors as in
    CollisionStream.update."""
    indices = as_indices(placements, count, "placements").reshape(-1)
    packed = pack_poses(poses, orthogonality_tolerance=orthogonality_tolerance)
    if len(packed) != len(indices):
        raise ValueError(f"there are {len(packed)} poses for {len(indices)} placements")
    values, counts = np.unique(indices, return_counts=True)
    if len(values) != len(indices):
        raise ValueError(
            f"placement {values[np.argmax(counts)]} is listed twice; list each placement once"
        )
    return indices, packed
