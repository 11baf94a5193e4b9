"""The code of the pages runs, in its order, and prints the output in the page."""

from __future__ import annotations

import contextlib
import io
import pathlib
import re
from typing import Any

import pytest
from conftest import SOURCE

PAGE = SOURCE / "client/python/README.md"


@pytest.mark.parametrize("page", [PAGE, SOURCE / "README.md"])
def test_the_code_of_the_page_runs(
    page: pathlib.Path, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    robots = (SOURCE / "client/guide/ROBOTS.md").read_text(encoding="utf-8")
    for name, content in re.findall(
        r"<!-- file: (\S+) -->\n```\w+\n(.*?)^```$", robots, re.M | re.S
    ):
        (tmp_path / name).write_text(content)
    monkeypatch.chdir(tmp_path)
    text = page.read_text(encoding="utf-8")
    blocks = re.findall(r"^```(python|text)\n(.*?)^```$", text, re.M | re.S)
    names: dict[str, Any] = {"__name__": "page"}
    ran = 0
    try:
        for index, (language, code) in enumerate(blocks):
            if language != "python":
                continue
            said = io.StringIO()
            with contextlib.redirect_stdout(said):
                exec(compile(code, f"block {index} of {page}", "exec"), names)
            follows = blocks[index + 1] if index + 1 < len(blocks) else ("", "")
            assert said.getvalue() == (follows[1] if follows[0] == "text" else ""), code
            ran += 1
    finally:
        if "client" in names:
            names["client"].close()
        if "server" in names:
            names["server"].stop()
    assert ran > (10 if page == PAGE else 0)


def test_the_page_lists_every_method() -> None:
    import hulld

    text = PAGE.read_text(encoding="utf-8")
    for name in dir(hulld.Client):
        if not name.startswith("_") and name not in ("close", "server", "channel"):
            assert f"`{name}`" in text, name
