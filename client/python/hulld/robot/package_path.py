"""Finds the files that a robot description names."""

from __future__ import annotations

import os
import pathlib
import urllib.parse
from collections.abc import Iterator, Mapping

_PACKAGE_DEPTH = 3
_MAX_FOLDERS = 10_000


def resolve_file(
    name: str, description: str | os.PathLike[str], packages: Mapping[str, str | os.PathLike[str]]
) -> pathlib.Path:
    """The file of package://PACKAGE/FILE, model://PACKAGE/FILE, file://FILE, or a path relative to
    the description's folder, as in package:///FILE. If no file has the name, its escapes such as
    %20 are decoded.

    A package is the first of these folders that contains the file: the folder in `packages`,
    exclusively; DIR/PACKAGE, or DIR itself if it is named PACKAGE, for each DIR of
    ROS_PACKAGE_PATH, and packages at most three folders below it; DIR/share/PACKAGE for each DIR of
    AMENT_PREFIX_PATH; the nearest folder above the description that is named PACKAGE or contains
    one. FileNotFoundError lists these folders.
    """
    scheme, separator, rest = name.partition("://")
    # Exporters write no name for the package of the description itself.
    unnamed = scheme in ("package", "model") and rest.startswith("/")
    if not separator or scheme == "file" or unnamed:
        rest = name.removeprefix("file://localhost").removeprefix("file://").removeprefix("file:")
        rest = rest.removeprefix(f"{scheme}:///") if unnamed else rest
        folder = pathlib.Path(description).parent
        if (path := _file_in(folder, rest)) is not None:
            return path
        raise FileNotFoundError(f"no such file: {folder / rest}")
    package, _, file = rest.partition("/")
    if scheme not in ("package", "model") or not package or not file:
        raise FileNotFoundError(f"{name!r} is not a package file; write package://PACKAGE/FILE")
    tried: dict[str, None] = {}
    for folder in _folders_of(package, description, packages):
        if (path := _file_in(folder, file)) is not None:
            return path
        tried[str(folder)] = None
    named = [*tried][:8]
    more = f" and {len(tried) - len(named)} more" if len(tried) > len(named) else ""
    raise FileNotFoundError(
        f"no folder of the package {package!r} contains {file}; set its folder with "
        f"packages={{{package!r}: DIR}} (looked in {', '.join(named)}{more})"
    )


def _file_in(folder: pathlib.Path, name: str) -> pathlib.Path | None:
    """folder/name. URIs may contain escapes such as %20, and so may file names. Exporters on Windows
    may write its separator."""
    for spelled in (name, urllib.parse.unquote(name), name.replace("\\", "/")):
        if (folder / spelled).is_file():
            return folder / spelled
    return None


def _folders_of(
    package: str,
    description: str | os.PathLike[str],
    packages: Mapping[str, str | os.PathLike[str]],
) -> Iterator[pathlib.Path]:
    if package in packages:
        yield pathlib.Path(packages[package])
        return
    ros = [pathlib.Path(one) for one in os.environ.get("ROS_PACKAGE_PATH", "").split(":") if one]
    for entry in ros:
        if entry.name == package:
            yield entry
        yield entry / package
    for entry in ros:
        yield from _packages_below(entry, package)
    for prefix in os.environ.get("AMENT_PREFIX_PATH", "").split(":"):
        if prefix:
            yield pathlib.Path(prefix, "share", package)
    for folder in pathlib.Path(os.path.abspath(description)).parents:
        if folder.name == package:
            yield folder
        yield folder / package


def _packages_below(folder: pathlib.Path, package: str) -> Iterator[pathlib.Path]:
    """The folders named `package`, level by level, each level in the order of its paths."""
    level, seen = [folder], 0
    for _ in range(_PACKAGE_DEPTH):
        below: list[pathlib.Path] = []
        for at in level:
            try:
                below += [e for e in at.iterdir() if e.is_dir() and not e.name.startswith(".")]
            except OSError:
                continue
        seen += len(below)
        if seen > _MAX_FOLDERS:
            return
        level = sorted(below)
        yield from (entry for entry in level if entry.name == package)
