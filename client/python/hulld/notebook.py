"""Answers in notebooks: a table, and the viewer's page if hullctl is found."""

from __future__ import annotations

import html
import json
import os
import pathlib
import subprocess
import tempfile
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

from hulld.connection import Connection
from hulld.programs import find_program

if TYPE_CHECKING:
    from hulld.geometry.placements import Placements

_PATIENCE = 15.0  # seconds for hullctl, which reads each hull's mesh
_HEIGHT = 480  # pixels


class Viewer:
    """Asks `hullctl view --html` for a page. It gets server, TLS and token as the client has them;
    the token travels in the environment, where no list of processes shows it."""

    def __init__(self, connection: Connection | None, missing: str = "") -> None:
        self._connection = connection
        self._missing = missing

    @classmethod
    def absent(cls, why: str) -> Viewer:
        """One that shows tables only."""
        return cls(None, why)

    def html(
        self,
        rows: Iterable[tuple[str, Any]],
        shown: Placements | Sequence[str],
        pairs: Sequence[tuple[int, int]] = (),
    ) -> str:
        """A table of `rows`, without None, and the page of `shown`, IDs or placements, or the
        reason for its absence. Never raises: a notebook would show the error in place of the
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
        # A frame of its own: the page's script reaches nothing of the notebook.
        return (
            f"<iframe sandbox='allow-scripts' style='width:100%;height:{_HEIGHT}px;border:0' "
            f'srcdoc="{html.escape(page, quote=True)}"></iframe>{table}'
        )

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


def scene_json(placements: Placements, pairs: Sequence[tuple[int, int]]) -> str:
    """A scene as hullctl reads it. Numbers read back as the same doubles."""

    def pose(numbers: list[float]) -> dict[str, dict[str, float]]:
        return {
            "rotation": dict(zip("wxyz", numbers[:4])),
            "translation": dict(zip("xyz", numbers[4:])),
        }

    return json.dumps(
        {
            "placements": [
                {"hullId": placements.ids[index], "pose": pose(numbers)}
                for index, numbers in zip(placements.indices.tolist(), placements.poses.tolist())
            ],
            "pairs": [index for pair in pairs for index in pair],
        }
    )
