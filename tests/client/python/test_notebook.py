"""Notebook cells: the viewer's page, or a table with the reason for its absence."""

from __future__ import annotations

import html
import json
import pathlib
import re
import shutil
import subprocess
from typing import Any

import pytest

import hulld
from conftest import CUBE
from hulld.notebook import Viewer, _frame_of, scene_json


def test_a_collision_shows_both_hulls_and_its_numbers(either: Any, name: str) -> None:
    either.append_points(name, CUBE, create=True)
    shown = either.check_collision(name, (name, (2, 0, 0)), separation=True)._repr_html_()
    content = json.loads(re.findall(r'=> (".*")\);$', shown, re.M)[0])
    assert json.loads(content) and content.count(name) >= 2 and "SEPARATED" in shown
    assert "sandbox='allow-scripts'" in shown
    for view in (either.get_hull(name), either.get_hull_mesh(name)):
        assert "<iframe" in view._repr_html_() and name in view._repr_html_()


def test_cells_share_the_page(either: Any, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("hulld.notebook._carriers", {})
    either.append_points(name, CUBE, create=True)
    hull = either.get_hull(name)
    first, second = hull._repr_html_(), either.get_hull_mesh(name)._repr_html_()
    assert "<div hidden" in first and len(first) < 500_000
    assert "<div hidden" not in second and len(second) < 10_000
    # A cell that runs again contains the page again; other cells do not.
    for cell, carries in (("a", False), (None, False)):
        monkeypatch.setattr("hulld.notebook._cell", lambda cell=cell: cell)
        assert ("<div hidden" in hull._repr_html_()) == carries
    monkeypatch.setattr("hulld.notebook._carriers", {})
    for cell, carries in (("a", True), ("b", False), ("a", True), ("b", False)):
        monkeypatch.setattr("hulld.notebook._cell", lambda cell=cell: cell)
        assert ("<div hidden" in hull._repr_html_()) == carries


def test_a_browser_fills_the_frames_of_all_cells(
    client: hulld.Client, name: str, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    browser = shutil.which("chromium")
    if browser is None:
        pytest.skip("no chromium")
    monkeypatch.setattr("hulld.notebook._carriers", {})
    pages: list[str] = []
    monkeypatch.setattr(
        "hulld.notebook._frame_of", lambda page: pages.append(page) or _frame_of(page)
    )
    client.append_points(name, CUBE, create=True)
    cells = [client.get_hull(name), client.check_collision(name, (name, (2, 0, 0)))]
    document = tmp_path / "notebook.html"
    document.write_text("<!doctype html>" + "".join(cell._repr_html_() for cell in cells))
    command = [browser, "--headless", "--no-sandbox", "--disable-gpu", "--virtual-time-budget=9999"]
    done = subprocess.run(
        [*command, f"--user-data-dir={tmp_path}/profile", "--dump-dom", document.as_uri()],
        capture_output=True,
        text=True,
        check=True,
    )
    filled = re.findall(r'<iframe [^>]*srcdoc="([^"]*)"', done.stdout)
    assert [html.unescape(one) for one in filled] == pages


def test_without_hullctl_a_table_is_shown(
    either: Any, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    either.append_points(name, CUBE, create=True)
    monkeypatch.setenv("HULLCTL_BINARY", "/nowhere/hullctl")
    shown = either.get_hull(name)._repr_html_()
    assert "<table>" in shown and "<iframe" not in shown and "HULLCTL_BINARY" in shown


def test_a_deleted_hull_is_not_an_error(either: Any, name: str) -> None:
    either.append_points(name, CUBE, create=True)
    answer = either.check_collision(name, name)
    either.delete_hull(name)
    assert "No picture" in answer._repr_html_() and "OVERLAPPING" in answer._repr_html_()


def test_names_are_escaped() -> None:
    shown = Viewer.absent("<b>why</b>").html([("<i>", "<script>"), ("none", None)], ["a"])
    assert "<script>" not in shown and "<i>" not in shown and "<b>" not in shown
    assert "&lt;script&gt;" in shown and "none" not in shown


def test_a_scene_reads_back_as_the_same_doubles() -> None:
    numbers = [0.1, 1 / 3, 5e-324, -0.0, 1e308, 2 / 3, 1.0]
    scene = json.loads(scene_json(hulld.Placements("a", [numbers]), [(0, 0)]))
    pose = scene["placements"][0]["pose"]
    read = [pose["rotation"][k] for k in "wxyz"] + [pose["translation"][k] for k in "xyz"]
    assert [x.hex() for x in read] == [x.hex() for x in numbers] and scene["pairs"] == [0, 0]
