#!/usr/bin/env python3
"""Compiles every source of core and every public header by itself.

Unity builds and precompiled headers hide missing includes. A source of core includes its own header
first, so of core's headers only those without a source are compiled separately. Parsing large
external headers takes most of the time, so they are precompiled. Each file uses only precompiled
headers that it includes anyway, directly or through other headers of the project.

Usage: includes.py INCLUDE_DIR      the folder of the installed headers, with core/ and client/
"""
import collections
import concurrent.futures
import os
import pathlib
import re
import subprocess
import sys
import tempfile

LARGE = ("Eigen/Core", "Eigen/Geometry", "absl/status/statusor.h", "boost/multiprecision/cpp_int.hpp",
         "grpcpp/grpcpp.h")
# A set of large headers is precompiled if at least this many files include exactly this set.
MIN_FILES = 4
INCLUDE = re.compile(r'^#include ["<]([^">]+)[">]', re.MULTILINE)


def find_included(path, folders, names):
    """Adds to `names` all headers that the file includes, directly or through project headers."""
    for name in set(INCLUDE.findall(path.read_text())) - names:
        names.add(name)
        if (header := find(name, folders)) is not None:
            find_included(header, folders, names)
    return names


def find(name, folders):
    return next((folder / name for folder in folders if (folder / name).exists()), None)


def main():
    installed = pathlib.Path(sys.argv[1])
    folders = [pathlib.Path("."), installed]
    files = {path.as_posix() for path in pathlib.Path("core").rglob("*.cc")}
    for part in ("core", "client"):
        headers = {path.relative_to(installed) for path in (installed / part).rglob("*.h")}
        files |= {path.as_posix() for path in headers
                  if part == "client" or not path.with_suffix(".cc").exists()}

    # Files by the set of large headers that they include.
    groups = collections.defaultdict(list)
    for name in sorted(files):
        names = find_included(find(name, folders), folders, set())
        groups[tuple(header for header in LARGE if header in names)].append(name)

    compiler = ["nice", "c++", "-std=c++20", "-I", ".", "-I", str(installed),
                "-isystem", "/usr/include/eigen3", "-Wno-subobject-linkage"]
    with tempfile.TemporaryDirectory() as work, \
            concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:

        def precompile(number, large):
            path = f"{work}/{number}.h"
            pathlib.Path(path).write_text("".join(f"#include <{header}>\n" for header in large))
            subprocess.run([*compiler, "-x", "c++-header", path, "-o", f"{path}.gch"], check=True)
            return ["-include", path]

        def compiles(name, options):
            return subprocess.run([*compiler, *options, "-fsyntax-only", "-x", "c++", "-"],
                                  input=f'#include "{name}"\n', text=True).returncode == 0

        precompiled = {large: pool.submit(precompile, number, large)
                       for number, (large, names) in enumerate(groups.items())
                       if large and len(names) >= MIN_FILES}
        options = {large: future.result() for large, future in precompiled.items()}
        outcomes = {name: pool.submit(compiles, name, options.get(large, []))
                    for large, names in groups.items() for name in names}
        failed = [name for name, outcome in outcomes.items() if not outcome.result()]
    for name in failed:
        print(f"{name} lacks an include")
    return 1 if failed else 0


sys.exit(main())
