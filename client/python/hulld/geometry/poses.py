"""Poses: quaternion and translation, as the contract has them, and 4 x 4 matrices."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Union

import numpy as np
import numpy.typing as npt

from hulld.geometry.points import as_floats

#: How far R Rᵀ of a matrix may be from the identity, in its largest entry. It is relative to 1, the
#: length of a row: within it, a hull of 1 m stands within about a nanometre of where the matrix
#: would put it. Products of hundreds of rotations in double precision stay far below (observed:
#: 1e-13), matrices of float32 do not (1e-7).
ORTHOGONALITY_TOLERANCE = 1e-9

PackedPoses = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Pose:
    """X_WA, the pose of a hull's frame A in the world W: p_W = R(rotation) p_A + translation.

    rotation: quaternion w x y z, finite and not zero; it need not be normalized: q and s q are the
    same rotation. translation: x y z, the caller's length unit. The pose is the exact rigid motion
    for these doubles.
    """

    rotation: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)
    translation: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        for name, size in (("rotation", 4), ("translation", 3)):
            values = tuple(float(value) for value in getattr(self, name))
            if len(values) != size:
                raise ValueError(
                    f"{name} has {len(values)} numbers; it takes {size}, "
                    f"{'w x y z' if size == 4 else 'x y z'}"
                )
            object.__setattr__(self, name, values)

    @classmethod
    def from_matrix(
        cls, matrix: npt.ArrayLike, *, tolerance: float = ORTHOGONALITY_TOLERANCE
    ) -> Pose:
        """The pose that a 4 x 4 matrix stands for, [R t; 0 0 0 1].

        A matrix of doubles is a rotation only up to rounding, so the pose is that of the quaternion
        nearest by: its matrix differs from R by some units of rounding more than R differs from a
        rotation. Quarter turns, as in rotations by 90 degrees, are exact. Nothing else is repaired:
        ValueError where R Rᵀ is farther than `tolerance` from the identity (says how far), where R
        mirrors, where the last row is not 0 0 0 1, where a number is not finite.
        """
        array = _doubles(matrix)
        if array.shape != (4, 4):
            raise ValueError(f"the matrix has the shape {array.shape}; it takes (4, 4)")
        return cls.from_packed(pack_matrices(array.reshape(1, 4, 4), tolerance=tolerance)[0])

    @classmethod
    def from_packed(cls, numbers: npt.ArrayLike) -> Pose:
        """The pose of seven numbers, w x y z x y z."""
        values = [float(value) for value in _doubles(numbers)]
        if len(values) != 7:
            raise ValueError(f"a packed pose has seven numbers, not {len(values)}")
        return cls((values[0], values[1], values[2], values[3]), (values[4], values[5], values[6]))

    def packed(self) -> npt.NDArray[np.float64]:
        """The seven numbers w x y z x y z, as they travel."""
        return np.array(self.rotation + self.translation, np.float64)

    def matrix(self) -> npt.NDArray[np.float64]:
        """The 4 x 4 matrix, rounded: for drawing and for other libraries, not to be exact with."""
        matrix: npt.NDArray[np.float64] = matrices_of(self.packed().reshape(1, 7))[0]
        return matrix


#: A pose: none (where the hull was built), a Pose, 4 x 4, seven numbers w x y z x y z, or a
#: translation x y z.
PoseLike = Union[None, Pose, npt.ArrayLike]
#: Many poses: n x 4 x 4, n x 7, n x 3, or a sequence of single ones.
PosesLike = Union[npt.ArrayLike, Sequence[PoseLike]]


def _doubles(values: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """ValueError: a number that no double holds."""
    doubles: npt.NDArray[np.float64] = as_floats(np.asarray(values), "pose").astype(
        np.float64, copy=False
    )
    return doubles


def pack_pose(pose: PoseLike) -> npt.NDArray[np.float64]:
    """The seven numbers of one pose. Errors as in pack_poses."""
    if pose is None:
        return np.array([1.0, 0, 0, 0, 0, 0, 0])
    if isinstance(pose, Pose):
        return pose.packed()
    array = _doubles(pose)
    if array.shape not in ((3,), (7,), (4, 4)):
        raise ValueError(
            f"a pose of shape {array.shape} is none of (4, 4), a matrix; (7,), a quaternion and a "
            "translation w x y z x y z; (3,), a translation"
        )
    packed: npt.NDArray[np.float64] = _pack_array(array[np.newaxis])[0]
    return packed


def pack_poses(poses: PosesLike) -> PackedPoses:
    """Poses as n x 7 numbers, w x y z x y z in each row, as they travel.

    Doubles pass as they are; matrices become quaternions as Pose.from_matrix says. ValueError:
    another shape, or a matrix that is no rigid motion; it names the pose and says how far off it
    is.
    """
    if isinstance(poses, np.ndarray) and poses.dtype != object:
        return _pack_array(_doubles(poses))
    sequence: Sequence[Any] = list(poses)  # type: ignore[arg-type]
    if not sequence:
        return np.empty((0, 7))
    rows = []
    for index, pose in enumerate(sequence):
        try:
            rows.append(pack_pose(pose))
        except ValueError as error:
            raise ValueError(f"poses[{index}]: {_without_index(str(error))}") from None
    return np.stack(rows)


def _without_index(message: str) -> str:
    return message.removeprefix("poses[0]: ")


def _pack_array(array: npt.NDArray[np.float64]) -> PackedPoses:
    if array.ndim == 3 and array.shape[1:] == (4, 4):
        return pack_matrices(array)
    if array.ndim == 2 and array.shape[1] == 7:
        return np.ascontiguousarray(array)
    if array.ndim == 2 and array.shape[1] == 3:
        packed = np.zeros((len(array), 7))
        packed[:, 0] = 1
        packed[:, 4:] = array
        return packed
    raise ValueError(
        f"poses of shape {array.shape} are none of (n, 4, 4), matrices; (n, 7), quaternions and "
        "translations w x y z x y z; (n, 3), translations"
    )


def pack_matrices(
    matrices: npt.NDArray[np.float64], *, tolerance: float = ORTHOGONALITY_TOLERANCE
) -> PackedPoses:
    """n x 4 x 4 matrices as n x 7 numbers; checks and errors as in Pose.from_matrix."""
    _check_matrices(matrices, tolerance)
    packed = np.empty((len(matrices), 7))
    packed[:, :4] = _quaternions_of(matrices[:, :3, :3])
    packed[:, 4:] = matrices[:, :3, 3]
    return packed


def _check_matrices(matrices: npt.NDArray[np.float64], tolerance: float) -> None:
    def first(bad: npt.NDArray[np.bool_]) -> int | None:
        return int(np.argmax(bad)) if bad.any() else None

    if (index := first(~np.isfinite(matrices).all(axis=(1, 2)))) is not None:
        raise ValueError(f"poses[{index}]: the matrix holds a number that is not finite")
    if (index := first((matrices[:, 3] != (0, 0, 0, 1)).any(axis=1))) is not None:
        raise ValueError(f"poses[{index}]: the last row is {matrices[index, 3]}, not 0 0 0 1")
    rotations = matrices[:, :3, :3]
    with np.errstate(over="ignore", invalid="ignore"):
        off = np.abs(rotations @ rotations.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2))
    if (index := first(~(off <= tolerance))) is not None:
        raise ValueError(
            f"poses[{index}]: the rotation is not orthogonal: R Rᵀ is off the identity by "
            f"{off[index]:.3g}, and at most {tolerance:g} is allowed; orthonormalize it yourself, "
            "or allow more with Pose.from_matrix(..., tolerance=...)"
        )
    if (index := first(np.linalg.det(rotations) < 0)) is not None:
        raise ValueError(
            f"poses[{index}]: the matrix mirrors (its determinant is negative), which no motion "
            "does"
        )


def _quaternions_of(rotations: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Quaternions w x y z of n x 3 x 3 rotations, scaled by their largest component, which avoids
    every root: so quarter turns are exact. Source: Shepperd 1978, Quaternion from Rotation Matrix.
    """
    m = rotations
    xx, yy, zz = m[:, 0, 0], m[:, 1, 1], m[:, 2, 2]
    # 4 w², 4 w x, ...: the symmetric matrix 4 q qᵀ.
    products = np.empty((len(m), 4, 4))
    products[:, 0, 0] = 1 + xx + yy + zz
    products[:, 1, 1] = 1 + xx - yy - zz
    products[:, 2, 2] = 1 - xx + yy - zz
    products[:, 3, 3] = 1 - xx - yy + zz
    products[:, 0, 1] = products[:, 1, 0] = m[:, 2, 1] - m[:, 1, 2]
    products[:, 0, 2] = products[:, 2, 0] = m[:, 0, 2] - m[:, 2, 0]
    products[:, 0, 3] = products[:, 3, 0] = m[:, 1, 0] - m[:, 0, 1]
    products[:, 1, 2] = products[:, 2, 1] = m[:, 0, 1] + m[:, 1, 0]
    products[:, 1, 3] = products[:, 3, 1] = m[:, 0, 2] + m[:, 2, 0]
    products[:, 2, 3] = products[:, 3, 2] = m[:, 1, 2] + m[:, 2, 1]
    largest = np.argmax(np.einsum("nii->ni", products), axis=1)
    chosen: npt.NDArray[np.float64] = products[np.arange(len(m)), largest] * 0.25
    return chosen


def matrices_of(packed: PackedPoses) -> npt.NDArray[np.float64]:
    """The n x 4 x 4 matrices of n x 7 numbers, rounded."""
    q = packed[:, :4] / np.abs(packed[:, :4]).max(axis=1, keepdims=True)
    w, x, y, z = (q / np.linalg.norm(q, axis=1, keepdims=True)).T
    out = np.zeros((len(packed), 4, 4))
    out[:, 0, 0], out[:, 0, 1], out[:, 0, 2] = (
        1 - 2 * (y * y + z * z),
        2 * (x * y - w * z),
        2 * (x * z + w * y),
    )
    out[:, 1, 0], out[:, 1, 1], out[:, 1, 2] = (
        2 * (x * y + w * z),
        1 - 2 * (x * x + z * z),
        2 * (y * z - w * x),
    )
    out[:, 2, 0], out[:, 2, 1], out[:, 2, 2] = (
        2 * (x * z - w * y),
        2 * (y * z + w * x),
        1 - 2 * (x * x + y * y),
    )
    out[:, :3, 3] = packed[:, 4:]
    out[:, 3, 3] = 1
    return out
