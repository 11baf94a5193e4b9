"""Finds hulld and hullctl."""

from __future__ import annotations

import os
import pathlib
import shutil
from collections.abc import Iterator


def find_program(name: str) -> pathlib.Path:
    """Finds a program: by HULLD_BINARY (for hulld) or HULLCTL_BINARY, then in the directory of
    HULLD_BINARY, on the PATH, or in the newest build of the hulld checkout around the working
    directory or this package. FileNotFoundError lists the searched locations."""
    variable = f"{name.upper()}_BINARY"
    named = os.environ.get(variable)
    if named:
        if os.access(named, os.X_OK) and os.path.isfile(named):
            return pathlib.Path(named)
        raise FileNotFoundError(f"{variable} is {named}, which is not an executable program")
    beside = pathlib.Path(os.environ.get("HULLD_BINARY", "")).parent / name
    if "HULLD_BINARY" in os.environ and os.access(beside, os.X_OK):
        return beside
    found = shutil.which(name)
    if found:
        return pathlib.Path(found)
    builds = [
        build
        for checkout in _checkouts()
        for build in checkout.glob(f"build/*/bin/{name}")
        if os.access(build, os.X_OK)
    ]
    if builds:
        return max(builds, key=lambda path: path.stat().st_mtime)
    raise FileNotFoundError(
        f"{name} not found: {variable} is not set, it is not on the PATH, and no checkout "
        f"around the working directory has a build; build hulld, or set {variable}"
    )


def _checkouts() -> Iterator[pathlib.Path]:
    """The hulld source trees above the working directory and above this file."""
    for start in (pathlib.Path.cwd(), pathlib.Path(__file__).resolve().parent):
        for folder in (start, *start.parents):
            if (folder / "proto/hulld/v1/hull.proto").is_file():
                yield folder
                break
