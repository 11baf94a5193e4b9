"""The asyncio client is the synchronous one, transformed by generate_aio.py."""

from __future__ import annotations

import ast
import importlib.util
import pathlib
from types import ModuleType

import hulld
from conftest import SOURCE

PACKAGE = SOURCE / "client/python"


def generator() -> ModuleType:
    spec = importlib.util.spec_from_file_location("generate_aio", PACKAGE / "generate_aio.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_installed_modules_are_those_of_this_source(tmp_path: pathlib.Path) -> None:
    script = generator()
    script.generate(PACKAGE / "hulld", tmp_path)
    installed = pathlib.Path(hulld.__file__).parent / "aio"
    for module in script.MODULES:
        made = (tmp_path / "aio" / f"{module}.py").read_text(encoding="utf-8")
        assert made == (installed / f"{module}.py").read_text(encoding="utf-8"), module


def test_no_generated_module_blocks(tmp_path: pathlib.Path) -> None:
    script = generator()
    script.generate(PACKAGE / "hulld", tmp_path)
    for module in script.MODULES:
        tree = ast.parse((tmp_path / "aio" / f"{module}.py").read_text(encoding="utf-8"))
        for node in ast.walk(tree):
            if isinstance(node, ast.Import):
                assert not {"time", "threading", "queue"} & {a.name for a in node.names}, module
            elif isinstance(node, ast.ImportFrom):
                assert node.module != "hulld.calls.transport", module
                assert not (node.module or "").removeprefix("hulld.") in script.MODULES, module
            elif isinstance(node, ast.FunctionDef):
                # Left synchronous: no step of it waits.
                calls = {script.called(part)[0] for part in ast.walk(node)}
                assert not calls & script.AWAITED, node.name
