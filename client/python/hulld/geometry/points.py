"""Points as numpy arrays, and their form on the wire."""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import Any, Protocol, Union

import numpy as np
import numpy.typing as npt

from hulld.arguments import as_array, as_floats
from hulld.wire import MessageWriter


class _Mesh(Protocol):
    """A mesh of trimesh, Open3D, or hulld."""

    @property
    def vertices(self) -> Any:
        ...


class _Cloud(Protocol):
    """A point cloud of Open3D, or a mesh of meshio or PyVista."""

    @property
    def points(self) -> Any:
        ...


#: n x 3 numbers in the caller's length unit, or an object with these as `vertices` or `points`.
PointsLike = Union[npt.ArrayLike, _Mesh, _Cloud]
Points = Union[npt.NDArray[np.float64], npt.NDArray[np.float32]]

_XYZ, _XYZ_FLOAT = 1, 2  # fields of PointBlock


def as_points(points: PointsLike, name: str = "points") -> Points:
    """Converts points to an n x 3 array of float64 or float32 with exactly the same numbers.

    points: n x 3, the caller's length unit, or an object with these as `vertices` or `points`, such
    as those of trimesh, Open3D, meshio, PyVista, or hulld. A single point of shape (3,) counts as 1
    x 3. float64 and float32 are kept without a copy; float16 and integers are widened. Copies only
    if necessary.

    ValueError: a different shape; a table with the columns x, y, and z in another order, or with
    further ones; a coordinate that is masked or not finite (the message names it); numbers that are
    not exactly doubles, such as some integers beyond 2^53 or long doubles.
    TypeError: not numbers, such as booleans, complex numbers, structures, or the name of a file.
    """
    if isinstance(points, (str, os.PathLike)):
        raise TypeError(
            f"{name} is {str(points)!r}; read the file first, as with np.loadtxt or trimesh.load, or "
            "append it with hullctl append"
        )
    if not isinstance(points, np.ndarray):
        points = getattr(points, "vertices", getattr(points, "points", points))
    columns = [str(column) for column in getattr(points, "columns", ())]
    if columns != ["x", "y", "z"] and {"x", "y", "z"} <= {*columns}:
        raise ValueError(
            f"{name} has the columns {', '.join(columns)}; pass {name}[['x', 'y', 'z']]"
        )
    array = as_array(points, name)
    if array.dtype.names:
        raise TypeError(
            f"{name} has the fields {', '.join(array.dtype.names)}; pass np.lib.recfunctions."
            f"structured_to_unstructured({name}[['x', 'y', 'z']])"
        )
    if array.size == 0 and array.ndim < 2:
        array = array.reshape(0, 3)
    if array.ndim == 1 and array.shape[0] == 3:
        array = array.reshape(1, 3)
    if array.ndim != 2 or array.shape[1] != 3:
        raise ValueError(f"{name} has the shape {array.shape}; expected (n, 3), x y z in each row")
    array = as_floats(array, name)
    finite = np.isfinite(array)
    if not finite.all():
        row, column = np.argwhere(~finite)[0]
        raise ValueError(
            f"{name}[{row}].{'xyz'[column]} is {array[row, column]}; leave such points out, as in "
            f"{name}[np.isfinite({name}).all(axis=1)]"
        )
    return array


def point_block(points: Points) -> MessageWriter:
    """The message PointBlock, whose array is the bytes of `points`."""
    writer = MessageWriter()
    return (
        writer.floats(_XYZ_FLOAT, points)
        if points.dtype.itemsize == 4
        else writer.doubles(_XYZ, points)
    )


def chunks_of(points: Points, max_bytes: int) -> Iterator[Points]:
    """`points` in pieces of at most `max_bytes`, with at least one point each."""
    rows = max(1, max_bytes // (3 * points.dtype.itemsize))
    for first in range(0, len(points), rows):
        yield points[first : first + rows]
