"""Builds the package, with the code of the contract (from ../../proto) and the asyncio client (by
generate_aio.py).

    pip install --no-build-isolation client/python

needs protoc and grpc_python_plugin (Debian: protobuf-compiler, protobuf-compiler-grpc), and no
network. Nothing is written to the source tree, except by an editable install (pip install -e).
"""

import atexit
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

from setuptools import setup
from setuptools.command.build_py import build_py

HERE = pathlib.Path(__file__).resolve().parent
PROTO = HERE.parent.parent / "proto"
sys.path.insert(0, str(HERE))

import generate_aio  # noqa: E402


def version():
    """The version of the whole project, which CMakeLists.txt contains."""
    text = (HERE.parent.parent / "CMakeLists.txt").read_text(encoding="utf-8")
    return re.search(r"^project\(hulld VERSION ([0-9.]+)", text, re.MULTILINE)[1]


def find_program(name, package):
    program = shutil.which(name)
    if program is None:
        raise SystemExit(f"hulld: {name} is not on the PATH; Debian has it in {package}")
    return program


def generate(target):
    """Writes the messages (*_pb2.py), their types (*_pb2.pyi) and gRPC's stubs (*_pb2_grpc.py)
    below `target`/hulld."""
    sources = sorted(str(path.relative_to(PROTO)) for path in PROTO.glob("hulld/*/*.proto"))
    if not sources:
        raise SystemExit(
            f"hulld: no contract in {PROTO}; install from a checkout of hulld, not from a copy of "
            "client/python"
        )
    plugin = find_program("grpc_python_plugin", "protobuf-compiler-grpc")
    subprocess.run(
        [
            find_program("protoc", "protobuf-compiler"),
            f"-I{PROTO}",
            f"--python_out={target}",
            f"--pyi_out={target}",
            f"--grpc_python_out={target}",
            f"--plugin=protoc-gen-grpc_python={plugin}",
            *sources,
        ],
        check=True,
    )


class BuildWithContract(build_py):
    def run(self):
        super().run()
        target = HERE if getattr(self, "editable_mode", False) else self.build_lib
        generate(target)
        generate_aio.generate(HERE / "hulld", pathlib.Path(target, "hulld"))
        pathlib.Path(target, "hulld", "_version.py").write_text(
            f'__version__ = "{version()}"\n', encoding="utf-8"
        )


# Concurrent builds, as in tests, need directories of their own.
scratch = tempfile.mkdtemp(prefix="hulld-build-")
atexit.register(shutil.rmtree, scratch, ignore_errors=True)

setup(
    version=version(),
    cmdclass={"build_py": BuildWithContract},
    options={"build": {"build_base": scratch}, "egg_info": {"egg_base": scratch}},
)
