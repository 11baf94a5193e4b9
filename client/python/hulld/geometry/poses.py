"""Poses: quaternion and translation, as in the contract, and 4 x 4 matrices."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import InitVar, dataclass
from typing import Any, Literal, Union

import numpy as np
import numpy.typing as npt

from hulld import arguments

#: Default of the largest entry of R Rᵀ - I that is accepted in a matrix. It is relative to
#: the length of a row, which is 1: a hull of 1 m is then placed within about a nanometer of the
#: position given by the matrix. Products of hundreds of rotations in double precision are far
#: below it (observed: 1e-13), but float32 matrices are not (1e-7).
ORTHOGONALITY_TOLERANCE = 1e-9

PackedPoses = npt.NDArray[np.float64]
#: The order of a quaternion's components in arrays. SciPy, ROS, and PyBullet write xyzw.
QuaternionOrder = Literal["wxyz", "xyzw"]


@dataclass(frozen=True)
class Pose:
    """X_WA, the pose of a hull's frame A in the world W: p_W = R(rotation) p_A + translation.

    rotation: quaternion w x y z, finite and not zero; it need not be normalized: q and s q are the
    same rotation. translation: x y z, the caller's length unit. quaternion_order: the order of
    `rotation` as given; the attribute is always w x y z. The pose is the exact rigid motion for
    these doubles.
    """

    rotation: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)
    translation: tuple[float, float, float] = (0.0, 0.0, 0.0)
    quaternion_order: InitVar[QuaternionOrder] = "wxyz"

    def __post_init__(self, quaternion_order: QuaternionOrder) -> None:
        for name, letters in (("rotation", quaternion_order), ("translation", "xyz")):
            given = tuple(getattr(self, name))
            if len(given) != len(letters):
                raise ValueError(
                    f"{name} has {len(given)} numbers; it needs {len(letters)}: "
                    f"{' '.join(letters)}"
                )
            values = tuple(arguments.number(v, f"{name}[{i}]") for i, v in enumerate(given))
            object.__setattr__(self, name, values)
        if not any(self.rotation):
            raise ValueError("rotation is zero; use (1, 0, 0, 0) for no rotation")
        rotation = _reordered(np.array([self.rotation]), quaternion_order)[0].tolist()
        object.__setattr__(self, "rotation", tuple(rotation))

    @classmethod
    def from_matrix(
        cls, matrix: npt.ArrayLike, *, tolerance: float = ORTHOGONALITY_TOLERANCE
    ) -> Pose:
        """The pose of a 4 x 4 matrix [R t; 0 0 0 1].

        A matrix of doubles is a rotation only up to rounding. The pose has the nearest quaternion,
        whose matrix differs from R by a few units of rounding more than R differs from a rotation.
        Rotations by multiples of 90 degrees are exact. tolerance: the largest entry of R Rᵀ - I
        that is accepted (elsewhere orthogonality_tolerance).

        ValueError: R Rᵀ is farther from the identity (the message says how far), R is a reflection,
        the last row is not 0 0 0 1, or a number is not finite.
        """
        array = _doubles(matrix)
        if array.shape != (4, 4):
            raise ValueError(f"the matrix has the shape {array.shape}; expected (4, 4)")
        return cls.from_packed(pack_matrices(array.reshape(1, 4, 4), tolerance=tolerance)[0])

    @classmethod
    def from_packed(
        cls, numbers: npt.ArrayLike, *, quaternion_order: QuaternionOrder = "wxyz"
    ) -> Pose:
        """The pose of seven numbers, a quaternion and a translation x y z."""
        values = _doubles(numbers).tolist()
        if np.shape(values) != (7,):
            raise ValueError(f"a packed pose has seven numbers, not the shape {np.shape(values)}")
        a, b, c, d, x, y, z = values
        return cls((a, b, c, d), (x, y, z), quaternion_order)

    def packed(self) -> npt.NDArray[np.float64]:
        """The seven numbers w x y z x y z."""
        return np.array(self.rotation + self.translation, np.float64)

    def matrix(self) -> npt.NDArray[np.float64]:
        """The 4 x 4 matrix, rounded: for drawing and for other libraries."""
        matrix: npt.NDArray[np.float64] = matrices_of(self.packed().reshape(1, 7))[0]
        return matrix


#: A pose: None (the identity), a Pose, a 4 x 4 matrix, seven numbers w x y z x y z, or a
#: translation x y z.
PoseLike = Union[None, Pose, npt.ArrayLike]
#: Many poses: n x 4 x 4, n x 7, n x 3, or a sequence of single ones.
PosesLike = Union[npt.ArrayLike, Sequence[PoseLike]]


def _doubles(values: Any, name: str = "pose") -> npt.NDArray[np.float64]:
    """ValueError: a number that is not exactly a double."""
    doubles: npt.NDArray[np.float64] = arguments.as_floats(
        arguments.as_array(values, name), name
    ).astype(np.float64, copy=False)
    return doubles


def pack_pose(
    pose: PoseLike,
    *,
    orthogonality_tolerance: float = ORTHOGONALITY_TOLERANCE,
    quaternion_order: QuaternionOrder = "wxyz",
) -> npt.NDArray[np.float64]:
    """The seven numbers of a pose. Arguments and errors are as in pack_poses."""
    if pose is None:
        return np.array([1.0, 0, 0, 0, 0, 0, 0])
    if isinstance(pose, Pose):
        return pose.packed()
    array = _doubles(pose)
    if array.shape not in ((3,), (7,), (4, 4)):
        raise ValueError(
            f"a pose has the shape {array.shape}; expected (4, 4), a matrix; (7,), a quaternion and "
            "a translation w x y z x y z; or (3,), a translation"
        )
    packed: npt.NDArray[np.float64] = _pack_array(
        array[np.newaxis], orthogonality_tolerance, quaternion_order
    )[0]
    return packed


def pack_poses(
    poses: PosesLike,
    *,
    orthogonality_tolerance: float = ORTHOGONALITY_TOLERANCE,
    quaternion_order: QuaternionOrder = "wxyz",
) -> PackedPoses:
    """Poses as n x 7 numbers, w x y z x y z in each row.

    Doubles are kept unchanged; matrices become quaternions as in Pose.from_matrix.
    orthogonality_tolerance: the largest entry of R Rᵀ - I that is accepted in a matrix.
    quaternion_order: the order of the quaternions in rows of seven numbers; a Pose has its own
    order.

    ValueError names the pose: a different shape, a masked or non-finite number, a zero quaternion,
    or a matrix that is not a rigid motion.
    """
    if isinstance(poses, (np.ndarray, np.ma.MaskedArray)) and poses.dtype != object:
        return _pack_array(_doubles(poses, "poses"), orthogonality_tolerance, quaternion_order)
    sequence: Sequence[Any] = list(poses)  # type: ignore[arg-type]
    if not sequence:
        return np.empty((0, 7))
    rows = []
    for index, pose in enumerate(sequence):
        try:
            row = pack_pose(
                pose,
                orthogonality_tolerance=orthogonality_tolerance,
                quaternion_order=quaternion_order,
            )
        except (TypeError, ValueError) as error:
            raise type(error)(f"poses[{index}]: {str(error).removeprefix('poses[0]: ')}") from None
        rows.append(row)
    return np.stack(rows)


def shorter_path(starts: PackedPoses, ends: PackedPoses) -> PackedPoses:
    """The end poses of motions, n x 7, each with the sign of its quaternion that makes the path
    from the start shorter: their scalar product is at least 0. Both signs are the same
    rotation."""

    def scaled(poses: PackedPoses) -> PackedPoses:
        rotations = poses[:, :4]
        largest_is_one: PackedPoses = rotations / np.abs(rotations).max(axis=1, keepdims=True)
        return largest_is_one

    longer = (scaled(starts) * scaled(ends)).sum(axis=1) < 0
    shorter = ends.copy()
    shorter[longer, :4] *= -1
    return shorter


def _pack_array(
    array: npt.NDArray[np.float64], tolerance: float, order: QuaternionOrder
) -> PackedPoses:
    if array.ndim == 3 and array.shape[1:] == (4, 4):
        return pack_matrices(array, tolerance=tolerance)
    if array.ndim != 2 or array.shape[1] not in (3, 7):
        raise ValueError(
            f"poses have the shape {array.shape}; expected (n, 4, 4), matrices; (n, 7), "
            "quaternions and translations w x y z x y z; or (n, 3), translations"
        )
    finite = np.isfinite(array)
    if not finite.all():
        row, column = np.argwhere(~finite)[0]
        raise ValueError(f"poses[{row}]: number {column} is {array[row, column]}")
    if array.shape[1] == 3:
        packed = np.zeros((len(array), 7))
        packed[:, 0] = 1
        packed[:, 4:] = array
        return packed
    zero = ~array[:, :4].any(axis=1)
    if zero.any():
        raise ValueError(
            f"poses[{int(np.argmax(zero))}]: the quaternion is zero; use 1 0 0 0 for no rotation"
        )
    return _reordered(array, order)


def _reordered(rows: npt.NDArray[np.float64], order: QuaternionOrder) -> npt.NDArray[np.float64]:
    """The rows, which begin with a quaternion, with w first."""
    if order == "wxyz":
        return rows
    if order != "xyzw":
        raise ValueError(f'quaternion_order is {order!r}; it must be "wxyz" or "xyzw"')
    return np.concatenate([rows[:, 3:4], rows[:, :3], rows[:, 4:]], axis=1)


def pack_matrices(
    matrices: npt.NDArray[np.float64], *, tolerance: float = ORTHOGONALITY_TOLERANCE
) -> PackedPoses:
    """n x 4 x 4 matrices as n x 7 numbers. Errors are as in Pose.from_matrix."""
    _check_matrices(matrices, arguments.length(tolerance, "orthogonality_tolerance"))
    packed = np.empty((len(matrices), 7))
    packed[:, :4] = _quaternions_of(matrices[:, :3, :3])
    packed[:, 4:] = matrices[:, :3, 3]
    return packed


def _check_matrices(matrices: npt.NDArray[np.float64], tolerance: float) -> None:
    def first(bad: npt.NDArray[np.bool_]) -> int | None:
        return int(np.argmax(bad)) if bad.any() else None

    if (index := first(~np.isfinite(matrices).all(axis=(1, 2)))) is not None:
        raise ValueError(f"poses[{index}]: the matrix contains a number that is not finite")
    if (index := first((matrices[:, 3] != (0, 0, 0, 1)).any(axis=1))) is not None:
        raise ValueError(f"poses[{index}]: the last row is {matrices[index, 3]}, not 0 0 0 1")
    rotations = matrices[:, :3, :3]
    with np.errstate(over="ignore", invalid="ignore"):
        off = np.abs(rotations @ rotations.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2))
    if (index := first(~(off <= tolerance))) is not None:
        raise ValueError(
            f"poses[{index}]: the rotation is not orthogonal: R Rᵀ deviates from the identity by "
            f"{off[index]:.3g}, and at most {tolerance:g} is allowed; orthonormalize it, or accept "
            f"the deviation with orthogonality_tolerance={_rounded_up(off[index])} "
            "(Pose.from_matrix: tolerance)"
        )
    if (index := first(np.linalg.det(rotations) < 0)) is not None:
        raise ValueError(
            f"poses[{index}]: the matrix contains a reflection (its determinant is negative); a "
            "pose must be a rotation and a translation"
        )


def _rounded_up(deviation: float) -> str:
    """A power of ten of at least `deviation`."""
    if not 0 < deviation < 1:
        return "..."
    return f"1e-{int(-np.log10(deviation)):02d}"


def _quaternions_of(rotations: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Quaternions w x y z of n x 3 x 3 rotations, scaled by their largest component, which avoids
    square roots, so quarter turns are exact. Source: Shepperd 1978, Quaternion from Rotation
    Matrix.
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
