"""Arrays that are points, and arrays that are refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import hulld
from conftest import CUBE


def test_doubles_and_floats_keep_their_memory() -> None:
    for kind in (np.float64, np.float32):
        points = np.ones((4, 3), kind)
        assert np.shares_memory(hulld.as_points(points), points)


def test_lists_single_points_and_no_points_are_taken() -> None:
    assert hulld.as_points([[1, 2, 3]]).dtype == np.float64
    assert hulld.as_points((1, 2, 3)).shape == (1, 3)
    assert hulld.as_points([]).shape == (0, 3)
    assert hulld.as_points(np.empty((0, 3))).shape == (0, 3)


@pytest.mark.parametrize("shape", [(4,), (3, 2), (2, 3, 3), (0, 2)])
def test_another_shape_is_named(shape: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match=r"\(n, 3\)"):
        hulld.as_points(np.zeros(shape))


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_a_coordinate_that_is_not_finite_is_named(bad: float) -> None:
    points = np.zeros((20, 3))
    points[17, 1] = bad
    with pytest.raises(ValueError, match=r"points\[17\]\.y is "):
        hulld.as_points(points)


def test_rows_of_different_lengths_are_named() -> None:
    with pytest.raises(ValueError, match="^points has rows of different lengths$"):
        hulld.as_points([[1, 2, 3], [1, 2]])


def test_integers_are_accepted_if_a_double_represents_them() -> None:
    exact = np.array([[2**53, -(2**60), 2**62]])
    assert hulld.as_points(exact).tolist() == [[2.0**53, -(2.0**60), 2.0**62]]
    assert hulld.as_points(np.array([[1, 2, 3]], np.int8)).tolist() == [[1, 2, 3]]
    for bad in (2**53 + 1, 2**63 - 1, -(2**53) - 1):
        with pytest.raises(ValueError, match=rf"points\[0\]\[2\] is {bad}"):
            hulld.as_points(np.array([[0, 0, bad]]))
    with pytest.raises(ValueError, match="no double represents exactly"):
        hulld.as_points(np.array([[0, 0, 2**64 - 1]], np.uint64))


def test_long_doubles_are_not_rounded_silently() -> None:
    with pytest.raises(ValueError, match="no double represents exactly"):
        hulld.as_points(np.array([[0, 0, 1]], np.longdouble) / 3)
    assert hulld.as_points(np.array([[0, 0, 0.5]], np.longdouble)).tolist() == [[0, 0, 0.5]]


def test_values_that_are_not_numbers_are_refused() -> None:
    for bad in (np.array([["a", "b", "c"]]), np.zeros((1, 3), complex)):
        with pytest.raises(TypeError, match="not numbers"):
            hulld.as_points(bad)


class _Table:
    """A table as pandas and polars provide it."""

    def __init__(self, columns: list[str]) -> None:
        self.columns = columns

    def __array__(self, dtype: Any = None) -> Any:
        return np.array([range(len(self.columns))], dtype)


# The columns z, y, and x were taken for x, y, and z.
def test_columns_in_another_order_are_refused_with_advice() -> None:
    assert hulld.as_points(_Table(["x", "y", "z"])).tolist() == [[0, 1, 2]]
    assert hulld.as_points(_Table(["0", "1", "2"])).tolist() == [[0, 1, 2]]
    for columns in (["z", "y", "x"], ["x", "y", "z", "red"]):
        names = ", ".join(columns)
        with pytest.raises(ValueError, match=rf"columns {names}; pass points\[\['x', 'y', 'z'\]\]"):
            hulld.as_points(_Table(columns))


def test_structured_arrays_are_refused_with_advice() -> None:
    structured = np.zeros(4, [("x", "f4"), ("y", "f4"), ("z", "f4"), ("i", "u1")])
    with pytest.raises(TypeError, match="fields x, y, z, i; pass .*structured_to_unstructured"):
        hulld.as_points(structured)


def test_the_name_of_a_file_is_refused_with_advice() -> None:
    with pytest.raises(TypeError, match="points is 'part.stl'; read the file first"):
        hulld.as_points("part.stl")


def test_meshes_and_clouds_of_other_libraries_are_points(either: Any, name: str) -> None:
    class Buffer:
        """Like the vectors of Open3D: an array only for numpy."""

        def __array__(self, dtype: Any = None, copy: Any = None) -> Any:
            return CUBE if dtype is None else CUBE.astype(dtype)

    class Mesh:  # of trimesh or Open3D
        vertices: Any = Buffer()
        triangles = faces = np.zeros((1, 3), int)

    class Cloud:  # of Open3D, meshio, or PyVista
        points: Any = CUBE.astype(np.float32)

    for shape in (Mesh(), Cloud(), Buffer()):
        assert hulld.as_points(shape).tolist() == CUBE.tolist()
    done = either.append_points(name, Mesh(), create=True)
    assert done.counts.received == 8 and done.vertex_count == 8
    assert either.replace_hull(name, Cloud()).hull.counts.received == 8
    # A mesh of this library, too.
    assert len(hulld.as_points(either.get_hull_mesh(name))) == 8
    broken = Mesh()
    broken.vertices = CUBE * np.nan
    with pytest.raises(ValueError, match=r"points\[0\]\.x is nan"):
        hulld.as_points(broken)
