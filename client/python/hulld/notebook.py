"""Answers in notebooks: a table, and the viewer's page if hullctl is found.

The page is 1.1 MB, of which all but a few kilobytes are the same for every answer. The first cell
of a process contains this common part, compressed; the frames of all cells are filled from there.
"""

from __future__ import annotations

import base64
import gzip
import hashlib
import html
import json
import os
import pathlib
import secrets
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

from hulld.connection import Connection
from hulld.programs import find_program

if TYPE_CHECKING:
    from hulld.geometry.placements import Placements

_PATIENCE = 15.0  # seconds for hullctl, which reads each hull's mesh
_HEIGHT = 480  # pixels

# The content of a page is between these two.
_START, _END = '<script type="application/json" id="recording">', "</script>"
_MARK = "<!-- recording -->"
_FILL = """(async () => {
  const pages = window.hulldPages ??= {}, found = (id) => document.getElementById(id);
  while (!found("FRAME")) await new Promise(requestAnimationFrame);
  pages["KEY"] ??= found("hulld-KEY")?.textContent;
  if (pages["KEY"] === undefined) {
    found("FRAME").srcdoc = "The cell that carries the viewer is gone. Restart the kernel.";
    return;
  }
  const packed = Uint8Array.from(atob(pages["KEY"]), (c) => c.charCodeAt(0));
  const plain = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  const page = await new Response(plain).text();
  found("FRAME").srcdoc = page.replace("MARK", () => RECORDING);
})();"""
#: The page without its content, by its key: the cell that carries it, None if it has no ID.
_carriers: dict[str, str | None] = {}


class Viewer:
    """Generates pages with `hullctl view --html`. Uses the client's server, TLS settings, and
    token, which is passed in the environment, so that no process list shows it."""

    def __init__(self, connection: Connection | None, missing: str = "") -> None:
        self._connection = connection
        self._missing = missing

    @classmethod
    def absent(cls, why: str) -> Viewer:
        """A viewer that shows only tables."""
        return cls(None, why)

    def html(
        self,
        rows: Iterable[tuple[str, Any]],
        shown: Placements | Sequence[str],
        pairs: Sequence[tuple[int, int]] = (),
    ) -> str:
        """A table of the `rows` that are not None, and the page for `shown` (IDs or placements), or
        the reason why it is missing. Never raises: a notebook would show the error instead of the
        answer."""
        body = "".join(
            f"<tr><th style='text-align:left'>{html.escape(str(name))}</th><td "
            f"style='text-align:left'>{html.escape(str(value))}</td></tr>"
            for name, value in rows
            if value is not None
        )
        table = f"<table>{body}</table>"
        try:
            page = self._page(shown, pairs)
        except (OSError, ValueError, subprocess.SubprocessError) as error:
            return f"{table}<p><small>No picture: {html.escape(str(error))}</small></p>"
        return _frame_of(page) + table

    def _page(self, shown: Placements | Sequence[str], pairs: Sequence[tuple[int, int]]) -> str:
        if self._connection is None:
            raise ValueError(self._missing)
        hullctl = find_program("hullctl")
        with tempfile.TemporaryDirectory(prefix="hulld-view-") as folder:
            page = pathlib.Path(folder) / "page.html"
            if isinstance(shown, Sequence):
                subjects = list(shown)
            else:
                scene = pathlib.Path(folder) / "scene.json"
                scene.write_text(scene_json(shown, pairs), encoding="utf-8")
                subjects = [str(scene)]
            command = [str(hullctl), "view", *subjects, "--html", str(page), *self._options()]
            done = subprocess.run(
                command,
                env=self._environment(),
                stdin=subprocess.DEVNULL,
                capture_output=True,
                text=True,
                timeout=_PATIENCE,
                check=False,
            )
            if done.returncode != 0:
                raise ValueError(
                    done.stderr.strip() or f"hullctl view ended with {done.returncode}"
                )
            return page.read_text(encoding="utf-8")

    def _options(self) -> list[str]:
        assert self._connection is not None
        options = ["--server", self._connection.server]
        tls = self._connection.tls
        if tls is not None:
            options.append("--tls")
            for flag, value in (
                ("--ca-cert", tls.ca_cert),
                ("--cert", tls.cert),
                ("--key", tls.key),
                ("--server-name", tls.server_name),
            ):
                if value is not None:
                    options += [flag, os.fspath(value)]
        if self._connection.insecure:
            options.append("--insecure")
        return options

    def _environment(self) -> dict[str, str]:
        assert self._connection is not None
        kept = {
            name: value
            for name, value in os.environ.items()
            if not name.startswith("HULLCTL_") and name != "HULLD_TOKEN"
        }
        if self._connection.token:
            kept["HULLD_TOKEN"] = self._connection.token
        return kept


def _frame_of(page: str) -> str:
    """A separate frame, so that the page's script cannot access the notebook, and the script that
    fills it."""
    before, start, rest = page.partition(_START)
    recording, end, after = rest.partition(_END)
    if not end:
        raise ValueError(
            "this hullctl writes pages in a different format; use a hullctl of the package's "
            "version"
        )
    shell = gzip.compress((before + start + _MARK + end + after).encode(), mtime=0)
    key = hashlib.blake2b(shell, digest_size=8).hexdigest()
    carrier = ""
    # Running a cell again replaces its output.
    if key not in _carriers or _carriers[key] == (_cell() or ""):
        _carriers[key] = _cell()
        carrier = f"<div hidden id='hulld-{key}'>{base64.b64encode(shell).decode()}</div>"
    frame = f"hulld-frame-{secrets.token_hex(8)}"
    content = json.dumps(recording).replace("<", "\\u003c")
    fill = _FILL.replace("FRAME", frame).replace("KEY", key).replace("MARK", _MARK)
    return (
        f"{carrier}<iframe id='{frame}' sandbox='allow-scripts' "
        f"style='width:100%;height:{_HEIGHT}px;border:0'></iframe>"
        f"<script>{fill.replace('RECORDING', content)}</script>"
    )


def _cell() -> str | None:
    """The ID of the running notebook cell; None if unknown."""
    try:
        return str(sys.modules["IPython"].get_ipython().get_parent()["metadata"]["cellId"])
    except (AttributeError, KeyError, TypeError):
        return None


def scene_json(placements: Placements, pairs: Sequence[tuple[int, int]]) -> str:
    """A scene in the format of hullctl. Numbers read back as the same doubles."""

    def pose(numbers: list[float]) -> dict[str, dict[str, float]]:
        return {
            "rotation": dict(zip("wxyz", numbers[:4])),
            "translation": dict(zip("xyz", numbers[4:])),
        }

    def subject(index: int) -> dict[str, Any]:
        one = placements.subject(index)
        if isinstance(one, str):
            return {"hullId": one}
        return {"points": {"xyz": one.astype(float).reshape(-1).tolist()}}

    return json.dumps(
        {
            "placements": [
                {**subject(index), "pose": pose(numbers), "radius": placements.radius(index)}
                for index, numbers in enumerate(placements.poses.tolist())
            ],
            "pairs": [index for pair in pairs for index in pair],
        }
    )
