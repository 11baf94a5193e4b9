"""Mesh files of robots, and where they are found."""

from __future__ import annotations

import gzip
import pathlib
import struct
from fractions import Fraction

import numpy as np
import pytest

import hulld
from hulld.robot.meshes import read_pieces
from hulld.robot.package_path import resolve_file

ONE = (Fraction(1),) * 3
FACES = ("0462", "1375", "0154", "2673", "0231", "4576")


def box_obj(keyword: str, x: float, first: int) -> str:
    """A box from x to x + 1 with vertices numbered from `first`."""
    corners = "".join(f"v {x + c % 2} {c // 2 % 2} {c // 4}\n" for c in range(8))
    faces = "".join(f"f {' '.join(str(int(c) + first) for c in face)}\n" for face in FACES)
    return f"{keyword}\n{corners}{faces}"


def binary_stl(triangles: np.ndarray, count: int | None = None, header: bytes = b"") -> bytes:
    data = header.ljust(80, b" ") + struct.pack("<I", len(triangles) if count is None else count)
    for triangle in triangles:
        data += struct.pack("<12fH", 0, 0, 0, *triangle.reshape(-1), 0)
    return data


TRIANGLES = np.array([[(0, 0, 0), (1, 0, 0), (0, 2, 0)], [(0, 0, 3), (1, 0, 0), (0, 2, 0)]], "f4")
FACET = (
    "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 2 0\nendloop\nendfacet\n"
)


def points_of(
    path: pathlib.Path, data: str | bytes, scale: tuple[Fraction, ...] = ONE
) -> np.ndarray:
    path.write_bytes(data.encode() if isinstance(data, str) else data)
    ((points, _),) = read_pieces(path, scale, True, None)
    return points


def test_stl_is_read_in_both_forms(tmp_path: pathlib.Path) -> None:
    expected = TRIANGLES.reshape(-1, 3).tolist()
    for data in (
        binary_stl(TRIANGLES),
        binary_stl(TRIANGLES, header=b"solid of a CAD program"),
        binary_stl(TRIANGLES) + b"\0\1",
    ):
        assert points_of(tmp_path / "a.STL", data).tolist() == expected
    for text in (
        f"solid\n{FACET}endsolid\n",
        f"SOLID two words\r\n{FACET.upper()}ENDSOLID two words",
        f"solid a\n{FACET.replace('normal 0 0 1', 'normal nan nan nan')}endsolid a",
        f"solid a\n{FACET.replace(' normal 0 0 1', '')}endsolid a",
        f"\ufeffsolid a\n\t{FACET.replace(' ', chr(9))}endsolid a",
        f"solid a\n{FACET}endsolid a\n\x1a",
    ):
        assert points_of(tmp_path / "a.stl", text).tolist() == expected[:3]


# The next vertex was lost.
def test_a_backslash_ends_names_and_comments(tmp_path: pathlib.Path) -> None:
    text = "mtllib c:\\a\\\nv 0 0 0 # c:\\b\\\nv 1 \\\n0 0#c\ng d:\\c\\\nv 0 2 0\nf 1 2 3#c\n"
    points = points_of(tmp_path / "a.obj", text)
    assert points.tolist() == [[0, 0, 0], [1, 0, 0], [0, 2, 0]]


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "contains no facet"),
        (b"solid\nendsolid\n", "2: the file contains no facet"),
        (b"\0" * 83, "cut short after 0 of"),
        (binary_stl(TRIANGLES)[:-1], "cut short after 1 of 2 triangles"),
        (binary_stl(TRIANGLES, count=1), "declares 1 triangles and 50 bytes follow"),
        (binary_stl(TRIANGLES[:0]), "contains no triangle"),
        (gzip.compress(binary_stl(TRIANGLES)), "is compressed"),
        ("solid\n".encode("utf-16"), "is UTF-16 text"),
        (binary_stl(TRIANGLES * np.float32("nan")), "triangle 0 has a coordinate that is not"),
        (f"solid\n{FACET}".encode(), "8: the file ends after 1 facet, before .*; is it complete?"),
        (f"solid\n{FACET[:56]}".encode(), "ends after 0 facets"),
        (
            f"solid\n{FACET.replace('endloop', 'vertex 1 1 1')}endsolid".encode(),
            "7: 'vertex' after 0",
        ),
        (f"solid\n{FACET.replace('0 2 0', '0 x 0')}endsolid".encode(), "6: 'x' is not a finite"),
        (
            f"solid\n{FACET.replace('0 2 0', '0 1e999 0')}endsolid".encode(),
            "6: '1e999' is not a finite",
        ),
        (b"v 0 0 0\n", "1: 'v' after 0 facets where \"solid\" is expected"),
    ],
)
def test_a_broken_stl_is_named(tmp_path: pathlib.Path, data: bytes, message: str) -> None:
    with pytest.raises(ValueError, match=message) as refused:
        points_of(tmp_path / "a.stl", data)
    assert "a.stl" in str(refused.value)


def test_obj_is_read(tmp_path: pathlib.Path) -> None:
    text = (
        "# C:\\parts\\\nmtllib a.mtl\nf 1 2 3\nv 0 0 0 1.0\nv 1 \\\n 0 0\nvn 0 0 1\n"
        "v 0 2 0 0.5 0.5 0.5\nf -3//1 -2/1 -1/1/1 # a face\n"
    )
    assert points_of(tmp_path / "a.obj", text).tolist() == [[0, 0, 0], [1, 0, 0], [0, 2, 0]]
    assert points_of(tmp_path / "a.obj", "v 1.5D+03 -.5d-1 2.D0\n").tolist() == [[1500, -0.05, 2]]
    varied = "v 0 0 1\r# a\rv 0 0 2\r\nv 0 0 3\n# b\x0cv 9 9 9\x85v 9 9 9"
    assert points_of(tmp_path / "a.obj", varied)[:, 2].tolist() == [1, 2, 3]
    for bad, message in (
        ("", "contains no vertices"),
        ("v 0 0\n", "1: a vertex has 2 of 3 coordinates"),
        ("v 0 0 nan\n", "1: 'nan' is not a finite number"),
        ("v 0 0 D5\n", "1: 'D5' is not a finite number"),
        ("v 0 0 0\nf 1 1 2\n", "2: a face names vertex 2, but the file has 1"),
        ("v 0 0 0\nf 1 0 1\n", "2: '0' is not a vertex"),
        ("v 0 0 0\nf -2 1 1\n", "2: '-2' is not a vertex; 1 precede this line"),
        ("v 0 0 0\nf a\n", "2: 'a' is not a vertex"),
        ("v 0 0 0\nf\n", "2: a face names no vertex"),
        ("v 0 0 0 \\", "1: the file ends after a backslash"),
        ("v 0 0 0\nv1 2 3\n", "2: 'v1' is not a statement; separate 'v' from its first number"),
        ("v 0 0 0\ncall part 2.obj\n", "2: the file refers to 'part 2.obj', which is not read"),
        ("v 0 0 \u0661\n", "1: '\u0661' is not a finite number"),
    ):
        with pytest.raises(ValueError, match=message):
            points_of(tmp_path / "a.obj", bad)


def test_scales_are_exact(tmp_path: pathlib.Path) -> None:
    inch = (Fraction("0.0254"), Fraction("-2"), Fraction("0.001"))
    # 3 in are 0.0762 m: the product is rounded once.
    assert points_of(tmp_path / "a.obj", "v 3 1 0.1\n", inch).tolist() == [[0.0762, -2, 0.0001]]
    triangle = np.full((1, 3, 3), 3, "f4")
    assert points_of(tmp_path / "a.stl", binary_stl(triangle), inch)[0].tolist() == [
        0.0762,
        -6,
        0.003,
    ]


@pytest.mark.parametrize("keyword", ["o convex_", "g hull_"])
def test_named_convex_parts_of_a_file_are_pieces(tmp_path: pathlib.Path, keyword: str) -> None:
    path = tmp_path / "parts.obj"
    path.write_text(box_obj(f"{keyword}0", 0, 1) + box_obj(f"{keyword}1", 5, 9))
    pieces = read_pieces(path, ONE, True, None)
    assert [len(points) for points, _ in pieces] == [8, 8]
    assert [volume for _, volume in pieces] == [1, 1]
    assert len(read_pieces(path, ONE, False, None)) == 1
    # Parts that are not convex stay one mesh: two boxes in one part, or an open one.
    path.write_text(box_obj("o a", 0, 1) + box_obj("# a", 5, 9) + box_obj("o b", 9, 17))
    assert len(read_pieces(path, ONE, True, None)) == 1
    path.write_text(box_obj("o a", 0, 1) + box_obj("o b", 5, 9).rsplit("f", 1)[0])
    assert [volume for _, volume in read_pieces(path, ONE, True, None)] == [0]


def test_other_formats_are_read_by_a_library(tmp_path: pathlib.Path) -> None:
    path = tmp_path / "a.dae"
    path.touch()
    with pytest.raises(ValueError, match=r"a.dae: meshes are read from stl and obj.*load_mesh"):
        read_pieces(path, ONE, True, None)

    class Mesh:
        vertices = np.array([[0, 0, 3]], np.float32)

    scale = (Fraction(1), Fraction(1), Fraction("0.0254"))
    ((points, _),) = read_pieces(path, scale, True, lambda file: Mesh())
    assert points.tolist() == [[0, 0, 0.0762]]


def test_packages_are_searched_in_order(
    tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def make(folder: str) -> pathlib.Path:
        file = tmp_path / folder / "meshes/a.stl"
        file.parent.mkdir(parents=True)
        file.touch()
        return file

    above, ament = make("robots/arm"), make("prefix/share/arm")
    deep, ros, named = make("ws/src/x/arm"), make("rpp/arm"), make("elsewhere")
    urdf, name = tmp_path / "robots/arm/urdf/arm.urdf", "package://arm/meshes/a.stl"
    urdf.parent.mkdir()
    monkeypatch.delenv("ROS_PACKAGE_PATH", raising=False)
    monkeypatch.delenv("AMENT_PREFIX_PATH", raising=False)
    assert resolve_file(name, urdf, {}) == above
    assert resolve_file("../meshes/a.stl", urdf, {}).samefile(above)
    assert resolve_file("..\\meshes\\a.stl", urdf, {}).samefile(above)
    assert resolve_file(f"file://{above}", urdf, {}) == above
    assert resolve_file(f"file://localhost{above}", urdf, {}) == above
    assert resolve_file(f"file:{above}", urdf, {}) == above
    assert resolve_file("package:///../meshes/a.stl", urdf, {}).samefile(above)
    assert resolve_file(f"file://{str(above).replace('a.stl', '%61.stl')}", urdf, {}) == above
    assert resolve_file(str(above), urdf, {}) == above
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path / "prefix"))
    assert resolve_file(name, urdf, {}) == ament
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "ws"))
    assert resolve_file(name, urdf, {}) == deep
    monkeypatch.setenv("ROS_PACKAGE_PATH", f"{tmp_path}/ws:{tmp_path}/rpp/arm")
    assert resolve_file(name, urdf, {}) == ros
    assert resolve_file(name, urdf, {"arm": tmp_path / "elsewhere"}) == named
    with pytest.raises(
        FileNotFoundError, match=r"package 'arm' contains b.stl; .*'arm': DIR.*elsewhere"
    ):
        resolve_file("package://arm/b.stl", urdf, {"arm": tmp_path / "elsewhere"})
    for bad in ("package://arm", "package://arm/", "http://a/b.stl"):
        with pytest.raises(FileNotFoundError, match="write package://PACKAGE/FILE"):
            resolve_file(bad, urdf, {})


def test_a_defect_of_a_mesh_names_the_link(tmp_path: pathlib.Path) -> None:
    urdf = tmp_path / "a.urdf"
    urdf.write_text(
        '<robot name="r">\n<link name="l">\n<collision><geometry><mesh filename="a.stl"/>'
        "</geometry></collision></link></robot>"
    )
    with pytest.raises(FileNotFoundError, match=r"a.urdf:3: link 'l': no such file: .*a.stl"):
        hulld.Robot.from_urdf(urdf)
    (tmp_path / "a.stl").write_text("solid\n")
    with pytest.raises(ValueError, match=r"a.urdf:3: link 'l': .*a.stl:1: the file ends"):
        hulld.Robot.from_urdf(urdf)
