"""Placements: hulls, bodies, and inline shapes at poses, packed for the wire."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Union

import numpy as np
import numpy.typing as npt

from hulld import arguments
from hulld.geometry.points import Points, PointsLike, as_points, point_block
from hulld.geometry.poses import (
    ORTHOGONALITY_TOLERANCE,
    PackedPoses,
    Pose,
    PoseLike,
    PosesLike,
    QuaternionOrder,
    pack_pose,
    pack_poses,
    shorter_path,
)
from hulld.wire import MessageWriter

# Fields of PackedPlacements.
_HULL_IDS, _HULLS, _POSES, _SHAPE_SIZES, _SHAPE_POINTS, _RADII, _END_POSES = range(1, 8)
#: Maximum number of points of an inline shape.
_MAX_SHAPE_POINTS = 4096


@dataclass(frozen=True)
class Placement:
    """The hull or body with this ID, or the inline shape of `points`, at a pose; None: the
    identity.

    points: 1 to 4096, n x 3. They are equivalent to a registered hull of these points, but are not
    stored. radius: grows the shape, or each piece of the body, by a closed ball: a point becomes a
    sphere, a segment a capsule. end_pose: the pose at time 1 of a motion; None: the placement is at
    rest. At time t, the quaternion is (1 - t) q0 + t q1, and the translation (1 - t) x0 + t x1,
    exactly. Since q1 and -q1 are the same rotation, the sign with the shorter path is used. A
    translation alone means that the rotation at the end is the identity, as in any pose of this
    form. ValueError: a malformed ID, shape, or radius, or not exactly one of ID and points.
    """

    id: str | None = None
    pose: PoseLike = None
    points: PointsLike | None = None
    radius: float = 0.0
    end_pose: PoseLike = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "radius", arguments.number(self.radius, "radius", minimum=0))
        if self.points is None:
            arguments.hull_id(self.id, "the ID of a placement")
        elif self.id is not None:
            raise ValueError("a placement has both an ID and points; pass one of them")
        else:
            object.__setattr__(self, "points", as_shape(self.points))

    @property
    def shape(self) -> Points | None:
        """The points of an inline shape; None for a hull or body."""
        return self.points  # type: ignore[return-value]


#: A hull or body by its ID, or the points of an inline shape, n x 3.
Subject = Union[str, npt.NDArray[Any], list[Any]]
#: One of these at a pose: alone, a Placement, or (ID or points, pose).
PlacementLike = Union[Subject, Placement, tuple[Subject, PoseLike]]


def as_shape(points: PointsLike, name: str = "points") -> Points:
    """The points of an inline shape. ValueError: as in as_points, or no points, or more than
    4096."""
    array = as_points(points, name)
    if not 1 <= len(array) <= _MAX_SHAPE_POINTS:
        raise ValueError(
            f"{name} has {len(array)} points; an inline shape must have 1 to "
            f"{_MAX_SHAPE_POINTS}; register a hull if there are more"
        )
    return array


def as_placement(placement: PlacementLike) -> Placement:
    """TypeError: not a placement. ValueError: a malformed ID or shape."""
    if isinstance(placement, Placement):
        return placement
    subject, pose = (
        placement if isinstance(placement, tuple) and len(placement) == 2 else (placement, None)
    )
    if isinstance(subject, str):
        return Placement(subject, pose)
    if isinstance(subject, (np.ndarray, list)):
        return Placement(pose=pose, points=subject)
    raise TypeError(
        f"{placement!r} is not a placement; pass an ID or points, (ID or points, pose), or "
        "hulld.Placement"
    )


def as_moving(placement: PlacementLike, end_pose: PoseLike) -> Placement:
    """The placement, with this end pose unless it is None. Errors are as in as_placement."""
    given = as_placement(placement)
    return given if end_pose is None else replace(given, end_pose=end_pose)


class Placements:
    """Placements of hulls, bodies, and inline shapes, stored compactly: each ID or shape once, and
    the poses in one array.

    ids: the distinct IDs. shapes: inline shapes, each as an array of points as in Placement.
    poses: the pose of each placement, as in pack_poses; None: the identity. indices: for each
    placement, the index of its subject in the list of ids followed by shapes; None: one placement
    per subject or, for a single subject, one per pose. radii: the radius of each placement, or one
    for all, as in Placement; None: 0. end_poses: the end pose of each placement, as in
    Placement.end_pose; a placement at rest repeats its pose. None: all are at rest.
    orthogonality_tolerance, quaternion_order: as in pack_poses.

        Placements("cube", poses)                        # one hull at n poses
        Placements(["arm", "box"], poses)                # two hulls, two poses
        Placements(["arm", "box"], poses, [0, 1, 1, 1])  # four placements of two hulls
        Placements([], poses, shapes=[points])           # one inline shape at n poses

    ValueError: the lists do not match, or contain a malformed ID, shape, or radius.
    """

    def __init__(
        self,
        ids: str | Sequence[str],
        poses: PosesLike | None = None,
        indices: npt.ArrayLike | None = None,
        *,
        shapes: Sequence[PointsLike] = (),
        radii: npt.ArrayLike | None = None,
        end_poses: PosesLike | None = None,
        orthogonality_tolerance: float = ORTHOGONALITY_TOLERANCE,
        quaternion_order: QuaternionOrder = "wxyz",
    ) -> None:
        self.ids: list[str] = [ids] if isinstance(ids, str) else list(ids)
        for index, one in enumerate(self.ids):
            arguments.hull_id(one, f"ids[{index}]")
        self.shapes: list[Points] = [
            as_shape(points, f"shapes[{index}]") for index, points in enumerate(shapes)
        ]
        count = len(self.ids) + len(self.shapes)

        def pack(given: PosesLike) -> PackedPoses:
            return pack_poses(
                given,
                orthogonality_tolerance=orthogonality_tolerance,
                quaternion_order=quaternion_order,
            )

        packed = None if poses is None else pack(poses)
        if indices is None:
            many = count == 1 and packed is not None
            chosen = (
                np.zeros(len(packed), np.uint32)
                if many and packed is not None
                else np.arange(count, dtype=np.uint32)
            )
        else:
            chosen = as_indices(indices, count, "indices")
        if packed is None:
            packed = np.tile(pack_pose(None), (len(chosen), 1))
        if len(packed) != len(chosen):
            raise ValueError(f"there are {len(packed)} poses for {len(chosen)} placements")
        self.indices: npt.NDArray[np.uint32] = chosen
        self.poses: PackedPoses = packed
        #: None if all are 0.
        self.radii: npt.NDArray[np.float64] | None = as_radii(radii, len(chosen))
        self.end_poses: PackedPoses | None = None
        if end_poses is not None:
            ends = pack(end_poses)
            if len(ends) != len(chosen):
                raise ValueError(f"there are {len(ends)} end poses for {len(chosen)} placements")
            self.end_poses = shorter_path(packed, ends)

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
        if not isinstance(placements, Iterable):
            raise TypeError(f"placements is {placements!r}; it must be a list of placements")
        single = [as_placement(placement) for placement in placements]
        places: dict[str, int] = {}
        for placement in single:
            if placement.id is not None:
                places.setdefault(placement.id, len(places))
        # An array that occurs several times is a single shape.
        shapes: dict[int, Points] = {}
        shape_places: dict[int, int] = {}
        indices = []
        for placement in single:
            if placement.shape is None:
                indices.append(places[placement.id or ""])
                continue
            key = id(placement.shape)
            shapes[key] = placement.shape
            indices.append(len(places) + shape_places.setdefault(key, len(shape_places)))
        rows = [placement.pose for placement in single]
        moves = any(placement.end_pose is not None for placement in single)
        ends = [
            placement.pose if placement.end_pose is None else placement.end_pose
            for placement in single
        ]
        return cls(
            list(places),
            rows,
            np.array(indices, np.uint32),
            shapes=list(shapes.values()),
            radii=[placement.radius for placement in single],
            end_poses=ends if moves else None,
            orthogonality_tolerance=orthogonality_tolerance,
        )

    def __len__(self) -> int:
        return len(self.indices)

    def __getitem__(self, index: int) -> Placement:
        pose = Pose.from_packed(self.poses[index])
        end = None if self.end_poses is None else Pose.from_packed(self.end_poses[index])
        one = self.subject(index)
        radius = self.radius(index)
        if isinstance(one, str):
            return Placement(one, pose, radius=radius, end_pose=end)
        return Placement(pose=pose, points=one, radius=radius, end_pose=end)

    def __repr__(self) -> str:
        shapes = f" and {len(self.shapes)} shapes" if self.shapes else ""
        return f"Placements({len(self)} of {len(self.ids)} IDs{shapes})"

    def subject(self, index: int) -> str | Points:
        """The ID of a placement, or the points of its inline shape."""
        one = int(self.indices[index])
        return self.ids[one] if one < len(self.ids) else self.shapes[one - len(self.ids)]

    def radius(self, index: int) -> float:
        """The radius of a placement."""
        return 0.0 if self.radii is None else float(self.radii[index])

    def packed(self) -> MessageWriter:
        """The message PackedPlacements."""
        message = (
            MessageWriter()
            .strings(_HULL_IDS, self.ids)
            .uint32s(_HULLS, self.indices)
            .doubles(_POSES, self.poses)
        )
        if self.shapes:
            sizes = [len(shape) for shape in self.shapes]
            message.uint32s(_SHAPE_SIZES, np.array(sizes, np.uint32))
            message.message(_SHAPE_POINTS, point_block(np.concatenate(self.shapes)))
        if self.radii is not None:
            message.doubles(_RADII, self.radii)
        if self.end_poses is not None:
            message.doubles(_END_POSES, self.end_poses)
        return message


PlacementsLike = Union[Placements, Iterable[PlacementLike]]


def as_radii(radii: npt.ArrayLike | None, count: int) -> npt.NDArray[np.float64] | None:
    """A radius for each of `count` placements; None if all are 0. ValueError: a different number of
    radii, or one that is negative or not finite."""
    if radii is None:
        return None
    array = arguments.as_floats(arguments.as_array(radii, "radii"), "radii").astype(np.float64)
    if array.ndim == 0:
        array = np.full(count, array)
    if array.shape != (count,):
        raise ValueError(
            f"radii has the shape {array.shape}; expected one number for each of {count}"
        )
    good = np.isfinite(array) & (array >= 0)
    if not good.all():
        at = int(np.argmin(good))
        raise ValueError(f"radii[{at}] is {array[at]}; it must be a finite length of at least 0")
    return array if array.any() else None


def as_integers(values: npt.ArrayLike, name: str) -> npt.NDArray[Any]:
    """`values` as an array of integers. TypeError: not integers."""
    array = arguments.as_array(values, name)
    if array.size == 0:
        return np.empty(array.shape, np.uint32)
    if array.dtype.kind not in "iu":
        raise TypeError(f"{name} has {array.dtype}, not integers")
    return array


def as_indices(values: npt.ArrayLike, count: int, name: str) -> npt.NDArray[np.uint32]:
    """`values` as indices below `count`, in the same shape. ValueError names the first index out of
    range; TypeError: not integers."""
    array = as_integers(values, name)
    if not array.size:
        return np.empty(array.shape, np.uint32)
    if not (array.min() >= 0 and array.max() < count):
        at = np.argwhere((array < 0) | (array >= count))[0]
        raise ValueError(
            f"{name}{arguments.place(tuple(at))} is {array[tuple(at)]}; indices start at 0 and "
            f"must be less than {count}"
        )
    return array.astype(np.uint32, copy=False)


def as_pairs(pairs: npt.ArrayLike, count: int) -> npt.NDArray[np.uint32]:
    """m x 2 indices of placements. ValueError: a different shape, or an index out of range."""
    array = arguments.as_array(pairs, "pairs")
    if array.size == 0:
        array = np.empty((0, 2), np.uint32)
    if array.ndim != 2 or array.shape[1] != 2:
        raise ValueError(
            f"pairs has the shape {array.shape}; expected (m, 2), two indices of placements in "
            "each row"
        )
    return as_indices(array, count, "pairs")


def all_pairs(count: int) -> npt.NDArray[np.uint32]:
    """Every pair of `count` placements once, the lower index first: (m, 2)."""
    return np.stack(np.triu_indices(count, 1), axis=1).astype(np.uint32)


def check_update(
    placements: npt.ArrayLike, poses: PosesLike, count: int, orthogonality_tolerance: float
) -> tuple[npt.NDArray[np.uint32], PackedPoses]:
    """The indices of moved placements, out of `count`, and their packed poses. Errors are as in
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
