"""Mesh files of robots: STL and OBJ, whole or as convex parts."""

from __future__ import annotations

import os
import pathlib
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
import numpy.typing as npt

from hulld.geometry.points import PointsLike, as_points

Points = npt.NDArray[np.float64]
Scale = Sequence[Fraction]
#: Reads a mesh file, as trimesh.load_mesh does.
MeshLoader = Callable[[pathlib.Path], PointsLike]

_MAX_CONVEX_VERTICES = 4096
_RELATIVE_TOLERANCE = 1e-3
_TRIANGLES_AT_ONCE = 256
_BYTES_TO_CLASSIFY = 1024
#: A comment, but not the end of 1.#INF.
_COMMENT = re.compile(r"(?<!\.)#.*")
#: The statements of OBJ that a backslash continues.
_CONTINUED = re.compile(r"[vf][\s\\]")
_FORTRAN_EXPONENT = re.compile(r"(?<=[0-9.])[dD]")
_LINE_END = re.compile("\r\n|\r|\n")
_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


@dataclass(frozen=True)
class Mesh:
    """vertices: n x 3. triangles: m x 3 indices. parts: for each triangle, the number of its named
    part."""

    vertices: Points
    triangles: npt.NDArray[np.intp]
    parts: npt.NDArray[np.intp]

    def pieces(self) -> list[Mesh]:
        """The parts, each with the vertices of its triangles."""
        pieces = []
        for part in np.unique(self.parts):
            triangles = self.triangles[self.parts == part]
            used, renumbered = np.unique(triangles, return_inverse=True)
            renumbered = renumbered.reshape(-1, 3)
            pieces.append(Mesh(self.vertices[used], renumbered, np.zeros(len(triangles), np.intp)))
        return pieces

    def is_closed(self) -> bool:
        """True if each edge is traversed equally often in both directions."""
        _, merged = np.unique(self.vertices + 0.0, axis=0, return_inverse=True)
        corners = merged.reshape(-1)[self.triangles]
        start, end = corners.reshape(-1), np.roll(corners, -1, axis=1).reshape(-1)
        edges = np.minimum(start, end) * len(self.vertices) + np.maximum(start, end)
        _, edge = np.unique(edges, return_inverse=True)
        balance = np.bincount(edge.reshape(-1), np.sign(end - start))
        return len(corners) > 0 and not bool(balance.any())

    def volume(self) -> float:
        """0 if the mesh is not closed, or if the volume is below its rounding error."""
        if not self.is_closed():
            return 0.0
        volume = enclosed_volume(self.vertices, self.triangles)
        rounding = 2.0**-52 * len(self.triangles) * self._diagonal() ** 3
        return volume if volume > rounding else 0.0

    def _diagonal(self) -> float:
        return float(np.linalg.norm(np.ptp(self.vertices, axis=0)))

    def is_convex(self) -> bool:
        """True if the mesh is closed, has at most 4096 vertices, and no vertex lies outside the
        plane of a triangle by more than a thousandth of the mesh's diagonal."""
        if len(self.vertices) > _MAX_CONVEX_VERTICES or not self.is_closed():
            return False
        tolerance = _RELATIVE_TOLERANCE * self._diagonal()
        a, b, c = (self.vertices[self.triangles[:, corner]] for corner in range(3))
        normals = np.cross(b - a, c - a)
        lengths = np.linalg.norm(normals, axis=1)
        # The normal of a sliver is dominated by rounding.
        usable = lengths > tolerance * tolerance
        normals, a = normals[usable] / lengths[usable, np.newaxis], a[usable]
        lowest = highest = 0.0
        for first in range(0, len(normals), _TRIANGLES_AT_ONCE):
            some = slice(first, first + _TRIANGLES_AT_ONCE)
            heights = normals[some] @ self.vertices.T - (normals[some] * a[some]).sum(1)[:, None]
            lowest, highest = min(lowest, heights.min()), max(highest, heights.max())
        # All triangles may face inward.
        return bool(highest <= tolerance or lowest >= -tolerance)


def enclosed_volume(vertices: Points, triangles: npt.NDArray[Any]) -> float:
    """Returns the volume of a closed mesh."""
    a, b, c = (vertices[triangles[:, corner]] - vertices[0] for corner in range(3))
    return abs(float((a * np.cross(b, c)).sum())) / 6


def read_pieces(
    path: pathlib.Path, scale: Scale, split: bool, load_mesh: MeshLoader | None
) -> list[tuple[Points, float]]:
    """Reads a mesh file. Returns the points and volume of each piece; the volume is 0 if unknown.

    Each coordinate is multiplied by its scale factor and rounded once. split: if all named parts of
    the file are convex, returns them as separate pieces. load_mesh: reads the file; if None, only
    STL and OBJ are supported. ValueError: the file cannot be read; names the file and the defect.
    """
    if load_mesh is not None:
        points = as_points(load_mesh(path), str(path)).astype(np.float64)
        return [(np.stack([_scaled(points[:, i], scale[i]) for i in range(3)], axis=1), 0.0)]
    reader = {".obj": _read_obj, ".stl": _read_stl}.get(path.suffix.lower())
    if reader is None:
        raise ValueError(
            f"{path}: meshes are read from stl and obj; convert it, or read it with another "
            "library, as with load_mesh=trimesh.load_mesh"
        )
    data = path.read_bytes()
    if data[:2] == b"\x1f\x8b":
        raise ValueError(f"{path} is compressed (gzip); decompress it first")
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        raise ValueError(f"{path} is UTF-16 text; convert it first: iconv -f UTF-16 -t UTF-8")
    mesh = reader(path, data, scale)
    if split:
        pieces = mesh.pieces()
        if len(pieces) > 1 and all(piece.is_convex() for piece in pieces):
            return [(piece.vertices, piece.volume()) for piece in pieces]
    return [(mesh.vertices, mesh.volume())]


def _scaled(values: Points, factor: Fraction) -> Points:
    """The doubles nearest to the products."""
    if factor == 1:
        return values
    distinct, place = np.unique(values, return_inverse=True)
    products = [float(Fraction(value) * factor) for value in distinct.tolist()]
    scaled: Points = np.array(products)[place.reshape(-1)]
    return scaled


def _number(word: str, factor: Fraction, place: str) -> float:
    """The double nearest to a decimal number times the factor. ValueError: not a finite number."""
    # Fortran writes 1.0D+03.
    decimal = _FORTRAN_EXPONENT.sub("E", word)
    try:
        value = float(decimal) if factor == 1 else float(Fraction(decimal) * factor)
        if word.isascii() and not set("_/") & set(word) and abs(value) < float("inf"):
            return value
    except (ValueError, OverflowError, ZeroDivisionError):
        pass
    raise ValueError(f"{place}: {word!r} is not a finite number")


def _lines(path: os.PathLike[str], data: bytes) -> Iterator[tuple[str, str]]:
    """Each line with its location, as in FILE:7."""
    # Removes the end-of-text mark of DOS.
    text = data.decode("utf-8-sig", "replace").removesuffix("\x1a")
    lines = _LINE_END.split(text)
    for number, line in enumerate(lines if lines[-1] else lines[:-1], 1):
        yield f"{os.fspath(path)}:{number}", line


# --- OBJ ---


def _read_obj(path: pathlib.Path, data: bytes, scale: Scale) -> Mesh:
    vertices: list[list[float]] = []
    triangles: list[tuple[int, int, int]] = []
    parts: list[int] = []
    number_of: dict[str, int] = {}
    name = group = continued = place = ""
    largest = (0, "")
    for place, line in _lines(path, data):
        statement = (continued + line).strip()
        without_comment = _COMMENT.sub("", statement)
        # Names and comments often contain Windows paths, which may end in a backslash; the next
        # line is then a statement of its own.
        is_continued = statement.endswith("\\") and statement == without_comment
        if is_continued and _CONTINUED.match(statement):
            continued = statement[:-1] + " "
            continue
        words, continued = statement.split(), ""
        if not words:
            continue
        if words[0] in ("v", "f"):
            words = without_comment.split()
        if words[0] == "v":
            if len(words) < 4:
                raise ValueError(f"{place}: a vertex has {len(words) - 1} of 3 coordinates")
            vertices.append([_number(words[i + 1], scale[i], place) for i in range(3)])
        elif words[0] == "f":
            corners = _corners(words[1:], len(vertices), place)
            largest = max(largest, (max(corners) + 1, place), key=lambda one: one[0])
            part = f"{name}.{group}" if name and group else name + group
            fan = [(corners[0], b, c) for b, c in zip(corners[1:], corners[2:])]
            triangles += fan
            parts += [number_of.setdefault(part, len(number_of))] * len(fan)
        elif words[0] == "o":
            # A new object starts without a group.
            name, group = " ".join(words[1:]), ""
        elif words[0] == "g":
            group = " ".join(words[1:])
        elif words[0] in ("call", "csh"):
            raise ValueError(
                f"{place}: the file refers to {' '.join(words[1:])!r}, which is not read; insert "
                f"the content of that file here, and remove {words[0]!r}"
            )
        elif words[0][0] in "vf" and not words[0].isalpha():
            raise ValueError(
                f"{place}: {words[0]!r} is not a statement; separate {words[0][0]!r} from its first "
                "number with a space"
            )
    if continued:
        raise ValueError(f"{place}: the file ends after a backslash that continues its line")
    if not vertices:
        raise ValueError(f"{path}: contains no vertices: no line starts with v; is it an OBJ file?")
    if largest[0] > len(vertices):
        raise ValueError(
            f"{largest[1]}: a face names vertex {largest[0]}, but the file has {len(vertices)}"
        )
    indices = np.array(triangles, np.intp).reshape(-1, 3)
    return Mesh(np.array(vertices), indices, np.array(parts, np.intp))


def _corners(words: list[str], before: int, place: str) -> list[int]:
    """The vertices of a face, from 0. Corners are 7, 7/1, 7//3, or 7/1/3; negative ones count back
    from the last vertex before the face."""
    corners = []
    for word in words:
        text = word.partition("/")[0]
        digits = text.removeprefix("-")
        corner = int(text) if digits.isascii() and digits.isdigit() else 0
        corner += before + 1 if corner < 0 else 0
        if corner <= 0:
            raise ValueError(f"{place}: {word!r} is not a vertex; {before} precede this line")
        corners.append(corner - 1)
    if not corners:
        raise ValueError(f"{place}: a face names no vertex")
    return corners


# --- STL ---


def _read_stl(path: pathlib.Path, data: bytes, scale: Scale) -> Mesh:
    """Text starts with `solid` and has no control characters in its first KiB; keywords may have
    any letter case, and normals may be missing."""
    start = data[:_BYTES_TO_CLASSIFY]
    if len(data) < _BYTES_TO_CLASSIFY:
        start = start.removesuffix(b"\x1a")
    if any(byte < 0x20 and byte not in b"\t\n\v\f\r" for byte in start):
        corners = _read_binary_stl(path, data).astype(np.float64)
        columns = [_scaled(corners[:, i], scale[i]) for i in range(3)]
        vertices, parts = np.stack(columns, axis=1), np.zeros(len(corners) // 3, np.intp)
    else:
        vertices, parts = _read_text_stl(path, data, scale)
    return Mesh(vertices, np.arange(len(vertices)).reshape(-1, 3), parts)


def _read_binary_stl(path: pathlib.Path, data: bytes) -> npt.NDArray[np.float32]:
    count = int.from_bytes(data[80:84], "little")
    rest = len(data) - 84 - count * _TRIANGLE.itemsize
    if len(data) < 84 or rest < 0:
        whole = max(0, len(data) - 84) // _TRIANGLE.itemsize
        raise ValueError(f"{path}: the file is cut short after {whole} of {count} triangles")
    if count == 0 and rest == 0:
        raise ValueError(f"{path}: the file contains no triangle")
    if count == 0 or (rest > 0 and rest % _TRIANGLE.itemsize == 0):
        raise ValueError(
            f"{path}: the header declares {count} triangles and {rest} bytes follow them; correct "
            "the count at byte 80, or cut the file at the last triangle"
        )
    corners: npt.NDArray[np.float32] = np.frombuffer(data, _TRIANGLE, count, 84)["corners"]
    finite = np.isfinite(corners).all(axis=(1, 2))
    if not finite.all():
        raise ValueError(
            f"{path}: triangle {int(np.argmin(finite))} has a coordinate that is not finite"
        )
    return corners.reshape(-1, 3)


def _read_text_stl(
    path: pathlib.Path, data: bytes, scale: Scale
) -> tuple[Points, npt.NDArray[np.intp]]:
    corners: list[list[float]] = []
    parts: list[int] = []
    number_of: dict[str, int] = {}
    end = str(path)

    def words() -> Iterator[tuple[str, str, str]]:
        """The location, the word, and, after `solid`, the name of the solid."""
        nonlocal end
        for end, line in _lines(path, data):
            for word in line.split():
                keyword = word.lower()
                if keyword in ("solid", "endsolid"):
                    yield end, keyword, line.strip()[len(word) :].strip()
                    break
                yield end, word, ""

    text = words()

    def facets_read() -> str:
        """The number of facets, as in "1 facet"."""
        return f"{len(parts)} facet" + "s" * (len(parts) != 1)

    def take(expected: str) -> tuple[str, str]:
        """The next word, and the name after it. ValueError: it is not `expected`."""
        place, word, name = next(text, ("", "", ""))
        if not place:
            raise ValueError(
                f"{end}: the file ends after {facets_read()}, before {expected}; is it complete?"
            )
        if expected and word.lower() not in expected.split(" or "):
            raise ValueError(
                f'{place}: {word!r} after {facets_read()} where "{expected}" is expected'
            )
        return word.lower(), name

    for place, word, name in text:
        if word != "solid":
            raise ValueError(
                f'{place}: {word!r} after {facets_read()} where "solid" is expected'
            )
        part = number_of.setdefault(name, len(number_of))
        while take("facet or endsolid")[0] == "facet":
            # `normal` and three words, which may be missing and are not used.
            for _ in range(5):
                if (found := take("")[0]) == "outer":
                    break
            else:
                raise ValueError(f'{end}: {found!r} where "outer" is expected')
            take("loop")
            for _ in range(3):
                take("vertex")
                corners.append([_number(take("")[0], factor, end) for factor in scale])
            take("endloop")
            take("endfacet")
            parts.append(part)
    if not parts:
        raise ValueError(f"{end}: the file contains no facet; is it an STL file?")
    return np.array(corners), np.array(parts, np.intp)
