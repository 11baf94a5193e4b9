"""mypy --strict accepts the package, its examples, and correct user code, and finds mistakes."""

from __future__ import annotations

import pathlib
import subprocess
import sys

import pytest

import hulld
from conftest import SOURCE

pytest.importorskip("mypy")
CONFIGURATION = SOURCE / "client/python/pyproject.toml"


def check(*arguments: str, cwd: pathlib.Path) -> subprocess.CompletedProcess[str]:
    # The tests share a cache.
    cache = str(cwd.parent / "mypy")
    return subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", "--cache-dir", cache, *arguments],
        cwd=cwd,
        capture_output=True,
        text=True,
        check=False,
    )


def test_the_package_is_typed(tmp_path: pathlib.Path) -> None:
    done = check("--config-file", str(CONFIGURATION), "-p", "hulld", cwd=tmp_path)
    assert done.returncode == 0, done.stdout
    assert (pathlib.Path(hulld.__file__).parent / "py.typed").exists()


def test_the_examples_are_typed(tmp_path: pathlib.Path) -> None:
    examples = sorted((SOURCE / "client/python/examples").glob("*.py"))
    assert len(examples) >= 3
    done = check(*map(str, examples), cwd=tmp_path)
    assert done.returncode == 0, done.stdout


def test_a_type_checker_finds_the_mistakes_of_users(tmp_path: pathlib.Path) -> None:
    (tmp_path / "user.py").write_text(
        "import hulld\n"
        "with hulld.local() as client:\n"
        "    reveal_type(client.check_collision('a', ('b', (1, 0, 0))).relation)\n"
        "    client.get_hull(3)\n"
        "    client.get_hull('a').vertices\n"
        "async def ask(client: hulld.AsyncClient) -> None:\n"
        "    reveal_type(await client.get_hull_mesh('a'))\n"
        "    client.get_hull('a').info\n"
    )
    said = check("user.py", cwd=tmp_path).stdout
    assert 'user.py:3: note: Revealed type is "hulld.answers.collisions.Relation"' in said
    assert 'user.py:4: error: Argument 1 to "get_hull" of "Client"' in said
    assert 'user.py:5: error: "Hull" has no attribute "vertices"' in said
    assert 'user.py:7: note: Revealed type is "hulld.answers.hulls.HullMesh"' in said
    assert "user.py:8: error: " in said and "Coroutine" in said


def test_every_public_name_is_there_and_documented() -> None:
    for name in hulld.__all__:
        thing = getattr(hulld, name)
        if isinstance(thing, type) and not issubclass(thing, hulld.HulldError):
            assert thing.__doc__ and not thing.__doc__.startswith(f"{name}("), name
