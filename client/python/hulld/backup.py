"""A backup of a store in one file, as `hullctl backup` writes and restores it."""

from __future__ import annotations

import contextlib
import os
import pathlib
import struct
import zlib
from dataclasses import dataclass

from hulld.answers.hulls import Header, header_of
from hulld.connection import PathLike
from hulld.v1 import maintenance_pb2

_FIRST_LINE = b"hulld backup 1\n"


@dataclass(frozen=True)
class Backup:
    """A finished backup. header: the store and its revision at the start; byte_count: of all
    files."""

    header: Header
    version: str
    file_count: int
    byte_count: int


class BackupWriter:
    """Writes the parts of SaveBackup: a line that names the format, then each part after its size
    and CRC-32. The file gets its final name only when it is complete and on disk; otherwise it is
    removed. A context manager.

    OSError: the file cannot be written. ValueError: a part is damaged or out of order.
    """

    def __init__(self, path: PathLike) -> None:
        self._path = pathlib.Path(path)
        self._partial = self._path.with_name(self._path.name + f".{os.getpid()}.partial")
        self._begin: maintenance_pb2.BackupBegin | None = None
        self._end: maintenance_pb2.BackupEnd | None = None
        self._file = open(
            self._partial, "xb", opener=lambda name, flags: os.open(name, flags, 0o600)
        )
        self._file.write(_FIRST_LINE)

    def write(self, data: bytes) -> None:
        part = maintenance_pb2.SaveBackupResponse.FromString(data)
        kind = part.WhichOneof("part")
        if self._end is not None or (kind == "begin") != (self._begin is None) or kind is None:
            raise ValueError("the backup's parts are out of order")
        if kind == "begin":
            self._begin = part.begin
        elif kind == "end":
            self._end = part.end
        elif zlib.crc32(part.piece.data) != part.piece.crc32:
            raise ValueError(f"the checksum of a piece of {part.piece.path} does not match")
        self._file.write(struct.pack("<II", len(data), zlib.crc32(data)))
        self._file.write(data)

    def finish(self) -> Backup:
        if self._begin is None or self._end is None:
            raise ValueError("the backup is truncated: its end is missing")
        self._file.flush()
        os.fsync(self._file.fileno())
        self._file.close()
        os.replace(self._partial, self._path)
        folder = os.open(self._path.parent, os.O_RDONLY | os.O_DIRECTORY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)
        return Backup(
            header_of(self._begin.header),
            self._begin.version,
            self._end.file_count,
            self._end.byte_count,
        )

    def __enter__(self) -> BackupWriter:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()
        with contextlib.suppress(FileNotFoundError):
            self._partial.unlink()
