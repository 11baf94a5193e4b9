"""Judges another program's answers against exact ones."""

from __future__ import annotations

import csv
import math
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any, Union

import numpy as np
import numpy.typing as npt

from hulld import arguments
from hulld.answers.collisions import AnswerRow, Batch, Problem, Relation
from hulld.answers.equality import ArrayFields
from hulld.client import Client
from hulld.geometry.placements import Placements
from hulld.geometry.points import PointsLike
from hulld.geometry.poses import ORTHOGONALITY_TOLERANCE, pack_poses
from hulld.local_server import shared_client
from hulld.verification import Verifier

#: The columns of a table by name, the path of a CSV file, or that of an NPZ file.
TableLike = Union[Mapping[str, Any], str, "os.PathLike[str]"]

_ROWS_PER_CALL = 1 << 16
_CELLS = ("qw", "qx", "qy", "qz", "x", "y", "z")
_ANSWERS = ("relation", "colliding", "distance", "depth", "contact_time")
_COLUMNS = ("a", "b", "poses_a", "poses_b", "end_poses_a", "end_poses_b", *_ANSWERS)


class Fault(IntEnum):
    """A defect of an answer."""

    #: Separated hulls are reported as colliding.
    FALSE_CONTACT = 0
    #: Overlapping hulls are reported as separated.
    MISS = 1
    #: Touching hulls are reported with another relation, or overlapping hulls as touching.
    TOUCHING_MISTAKEN = 2
    DISTANCE = 3
    DEPTH = 4
    #: The time of the first contact is outside the proven bracket.
    TIME = 5


@dataclass(frozen=True)
class WrongAnswer:
    """A wrong answer. row: of the table, from 0. error: the largest length by which it is wrong, or
    for a motion the time; 0 if only touching hulls were misjudged. answer: the exact answer; its
    certificate was verified."""

    row: int
    faults: tuple[Fault, ...]
    error: float
    answer: AnswerRow

    def __repr__(self) -> str:
        faults = ", ".join(fault.name for fault in self.faults)
        separation = self.answer.separation
        value = "" if separation is None else f", separation={separation.value!r}"
        return (
            f"WrongAnswer(row {self.row}: {faults}, off by {self.error!r}, "
            f"{self.answer.relation.name}{value})"
        )


@dataclass(frozen=True, repr=False, eq=False)
class Judged(ArrayFields):
    """The result of judge. wrong: worst first. counts: wrong answers by fault; an answer may have
    several. failed: by row, the reason for a missing exact answer. distance_errors, depth_errors:
    n, the absolute errors; NaN where the table has no value. time_errors: n, the distances of
    contact times from the proven brackets."""

    answers: int
    wrong: Sequence[WrongAnswer]
    counts: Mapping[Fault, int]
    failed: Mapping[int, Problem]
    distance_errors: npt.NDArray[np.float64]
    depth_errors: npt.NDArray[np.float64]
    time_errors: npt.NDArray[np.float64]

    def __bool__(self) -> bool:
        raise TypeError("a judgement is neither true nor false; use len(judged.wrong)")

    def __repr__(self) -> str:
        counts = "".join(f", {fault.name} {count}" for fault, count in self.counts.items() if count)
        distance, depth, time = (
            float(np.nanmax(errors, initial=0.0))
            for errors in (self.distance_errors, self.depth_errors, self.time_errors)
        )
        return (
            f"Judged({self.answers} answers, {len(self.wrong)} wrong{counts}; largest error of a "
            f"distance {distance:.3g}, of a depth {depth:.3g}, of a time {time:.3g})"
        )


@dataclass(frozen=True)
class _Table:
    """A table with one entry per row in each column. NaN, and UNSPECIFIED: no answer."""

    names: tuple[Sequence[str], Sequence[str]]
    poses: tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]
    end_poses: tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]
    #: True for rows that are motions.
    moves: npt.NDArray[np.bool_]
    relations: npt.NDArray[np.uint8]
    #: 1, 0, or NaN.
    colliding: npt.NDArray[np.float64]
    distances: npt.NDArray[np.float64]
    depths: npt.NDArray[np.float64]
    contact_times: npt.NDArray[np.float64]

    def parts(self, rows: npt.NDArray[np.int64]) -> Iterator[npt.NDArray[np.int64]]:
        """Splits rows into groups for one call each, all at rest or all in motion."""
        for moves in (False, True):
            kind = rows[self.moves[rows] == moves]
            for first in range(0, len(kind), _ROWS_PER_CALL):
                yield kind[first : first + _ROWS_PER_CALL]

    def __len__(self) -> int:
        return len(self.relations)


def judge(
    table: TableLike,
    *,
    hulls: Mapping[str, PointsLike] | None = None,
    max_error: float = 0.0,
    max_time_error: float = 0.0,
    client: Client | None = None,
    orthogonality_tolerance: float = ORTHOGONALITY_TOLERANCE,
    timeout: float | None = None,
) -> Judged:
    """Finds the wrong answers of another program, and proves that they are wrong.

    table: columns by name, one entry per row: a, b (IDs of hulls or bodies, or names in `hulls`),
    poses_a, poses_b (as in pack_poses; default: identity), end_poses_a, end_poses_b (of motions;
    default: the poses), and at least one of relation (SEPARATED, TOUCHING, OVERLAPPING, or
    hulld.Relation), colliding (boolean), distance (negative: minus a depth), depth, and
    contact_time (0 to 1, for a motion), with NaN or an empty entry for a missing answer.
    Alternatively, the path of an .npz file with these arrays, or of a CSV file in the format of
    `hullctl judge`. hulls: points, n x 3, by name. max_error: a distance or depth is wrong if its
    error certainly exceeds this, given the proven bound; 0: only the bound is allowed.
    max_time_error: how far a contact time may be outside the proven bracket. client: None: a
    private server, which has no hulls. timeout: of each call.

    ValueError: the table is malformed. VerificationError: a certificate does not prove the server's
    answer.
    """
    limits = (
        arguments.length(max_error, "max_error"),
        arguments.length(max_time_error, "max_time_error"),
    )
    columns = _read(table) if isinstance(table, (str, os.PathLike)) else dict(table)
    rows = _as_table(columns, orthogonality_tolerance)
    asking = _Asking(client or shared_client(), rows, hulls or {}, timeout)
    found = [
        _judge_rows(rows, part, asking.ask(part), limits)
        for part in rows.parts(np.arange(len(rows)))
    ]
    return _collect(asking, rows, found, limits)


# --- Tables ---


def _read(path: str | os.PathLike[str]) -> dict[str, Any]:
    if os.fspath(path).endswith(".npz"):
        with np.load(path, allow_pickle=False) as arrays:
            return {name: arrays[name] for name in arrays.files}
    with open(path, newline="", encoding="utf-8") as file:
        lines = [line for line in file if line.strip() and not line.lstrip().startswith("#")]
    if not lines:
        raise ValueError(f"{os.fspath(path)}: the table contains no answers")
    dialect = next((mark for mark in ";\t," if mark in lines[0]), ",")
    rows = [[cell.strip() for cell in row] for row in csv.reader(lines, delimiter=dialect)]
    header = [name.lower() for name in rows[0]]
    for number, row in enumerate(rows[1:]):
        if len(row) != len(header):
            raise ValueError(
                f"{os.fspath(path)}: row {number} has {len(row)} cells, but the header has "
                f"{len(header)}"
            )
    cells = {name: [row[index] for row in rows[1:]] for index, name in enumerate(header)}
    columns: dict[str, Any] = {name: cells[name] for name in ("a", "b", *_ANSWERS) if name in cells}
    for side in "ab":
        pose = np.zeros((len(rows) - 1, 7))
        pose[:, 0] = f"{side}_qw" not in cells
        columns[f"poses_{side}"] = _read_poses(os.fspath(path), cells, side, pose, empty=0.0)
        end = _read_poses(os.fspath(path), cells, f"{side}_to", pose.copy(), empty=math.nan)
        # A missing cell is the same as at the start.
        columns[f"end_poses_{side}"] = np.where(np.isnan(end), pose, end)
    return columns


def _read_poses(
    path: str,
    cells: Mapping[str, list[str]],
    prefix: str,
    poses: npt.NDArray[np.float64],
    empty: float,
) -> npt.NDArray[np.float64]:
    """Sets the numbers of poses that have a column."""
    given = [cell for cell in _CELLS[:4] if f"{prefix}_{cell}" in cells]
    if len(given) not in (0, 4):
        raise ValueError(f"{path}: a quaternion has four columns, starting with {prefix}_qw")
    for index, cell in enumerate(_CELLS):
        name = f"{prefix}_{cell}"
        if name in cells:
            poses[:, index] = _numbers(cells[name], name, empty=empty)
    return poses


def _as_table(columns: Mapping[str, Any], orthogonality_tolerance: float) -> _Table:
    for name in columns:
        if name not in _COLUMNS:
            raise ValueError(f"the table has no column {name!r}; columns: {', '.join(_COLUMNS)}")
    for name in ("a", "b"):
        if name not in columns:
            raise ValueError(f"the table needs the column {name!r}, the IDs or names of hulls")
    if not any(name in columns for name in _ANSWERS):
        raise ValueError(
            f"the table needs a column of answers: {', '.join(_ANSWERS[:-1])}, or {_ANSWERS[-1]}"
        )
    count = len(columns["a"])
    for name, column in columns.items():
        if column is not None and len(column) != count:
            raise ValueError(f"{name} has {len(column)} rows, but a has {count}")
    identities = np.tile([1.0, 0, 0, 0, 0, 0, 0], (count, 1))

    def poses(name: str, default: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        given = columns.get(name)
        if given is None:
            return default
        return pack_poses(given, orthogonality_tolerance=orthogonality_tolerance)

    starts = (poses("poses_a", identities), poses("poses_b", identities))
    ends = (poses("end_poses_a", starts[0]), poses("end_poses_b", starts[1]))
    moves = ((starts[0] != ends[0]) | (starts[1] != ends[1])).any(axis=1)
    times = _lengths(columns.get("contact_time"), count, "contact_time", 0.0)
    _refuse(times > 1, "contact_time[{}] is above 1, the end of the motion")
    _refuse(~np.isnan(times) & ~moves, "contact_time[{}] requires a motion; pass an end pose")
    for name in ("distance", "depth"):
        given = ~np.isnan(_lengths(columns.get(name), count, name, -math.inf))
        _refuse(given & moves, name + "[{}] is set for a motion; only pairs at rest have one")
    return _Table(
        ([str(name) for name in columns["a"]], [str(name) for name in columns["b"]]),
        starts,
        ends,
        moves,
        _relations(columns.get("relation"), count),
        _booleans(columns.get("colliding"), count),
        _lengths(columns.get("distance"), count, "distance", -math.inf),
        _lengths(columns.get("depth"), count, "depth", 0.0),
        times,
    )


def _refuse(wrong: npt.NDArray[np.bool_], message: str) -> None:
    if wrong.any():
        raise ValueError(message.format(int(np.argmax(wrong))))


def _numbers(values: Any, name: str, empty: float) -> npt.NDArray[np.float64]:
    numbers = np.empty(len(values))
    for row, value in enumerate(values):
        if isinstance(value, str) and not value:
            numbers[row] = empty
            continue
        try:
            numbers[row] = float(value)
        except (TypeError, ValueError):
            raise ValueError(f"{name}[{row}] is {value!r}, not a number") from None
    return numbers


def _lengths(values: Any, count: int, name: str, least: float) -> npt.NDArray[np.float64]:
    if values is None:
        return np.full(count, np.nan)
    lengths = _numbers(values, name, empty=math.nan)
    if (lengths < least).any():
        row = int(np.argmax(lengths < least))
        raise ValueError(f"{name}[{row}] is {lengths[row]}; it must be at least {least:g}, or NaN")
    return lengths


def _relations(values: Any, count: int) -> npt.NDArray[np.uint8]:
    relations = np.zeros(count, np.uint8)
    for row, value in enumerate([] if values is None else values):
        if isinstance(value, str):
            known = {"": 0, "SEPARATED": 1, "TOUCHING": 2, "OVERLAPPING": 3}.get(value.upper())
        else:
            known = int(value) if value in (0, 1, 2, 3) else None
        if known is None:
            raise ValueError(
                f"relation[{row}] is {value!r}; it must be SEPARATED, TOUCHING, or OVERLAPPING"
            )
        relations[row] = known
    return relations


def _booleans(values: Any, count: int) -> npt.NDArray[np.float64]:
    booleans = np.full(count, np.nan)
    for row, value in enumerate([] if values is None else values):
        word = str(value).lower()
        if word in ("1", "true", "1.0", "0", "false", "0.0"):
            booleans[row] = word[0] in "1t"
        elif word not in ("", "nan", "none"):
            raise ValueError(f"colliding[{row}] is {value!r}; it must be 0, 1, true, or false")
    return booleans


# --- Queries ---


class _Asking:
    """Queries the rows of a table."""

    def __init__(
        self, client: Client, table: _Table, hulls: Mapping[str, PointsLike], timeout: float | None
    ) -> None:
        self.client = client
        self._table = table
        self._timeout = timeout
        used = dict.fromkeys([*table.names[0], *table.names[1]])
        self._ids = [name for name in used if name not in hulls]
        self._shapes = [hulls[name] for name in used if name in hulls]
        order = [*self._ids, *(name for name in used if name in hulls)]
        places = {name: index for index, name in enumerate(order)}
        self._indices = [np.array([places[name] for name in side], int) for side in table.names]

    def placements(self, rows: npt.NDArray[np.int64]) -> Placements:
        """A of each row, then B of each row. The rows are all at rest or all in motion."""
        ends = np.concatenate([poses[rows] for poses in self._table.end_poses])
        return Placements(
            self._ids,
            np.concatenate([poses[rows] for poses in self._table.poses]),
            np.concatenate([indices[rows] for indices in self._indices]),
            shapes=self._shapes,
            end_poses=ends if self._table.moves[rows].any() else None,
        )

    def ask(self, rows: npt.NDArray[np.int64], prove: bool = False) -> Batch:
        """prove: requests certificates, and separations rounded to the nearest double."""
        first = np.arange(len(rows))
        rests = not self._table.moves[rows].any()
        return self.client.check_collisions(
            self.placements(rows),
            np.stack([first, first + len(rows)], axis=1),
            separation=rests,
            max_error=0 if prove and rests else None,
            certificate=prove,
            timeout=self._timeout,
        )


# --- Judgement ---


@dataclass
class _Findings:
    """Faults and errors of rows. faults: rows x Fault."""

    rows: npt.NDArray[np.int64]
    faults: npt.NDArray[np.bool_]
    errors: npt.NDArray[np.float64]
    distance_errors: npt.NDArray[np.float64]
    depth_errors: npt.NDArray[np.float64]
    time_errors: npt.NDArray[np.float64]
    failed: dict[int, Problem] = field(default_factory=dict)


def _difference(
    said: npt.NDArray[np.float64], truth: npt.NDArray[np.float64]
) -> npt.NDArray[np.float64]:
    with np.errstate(invalid="ignore"):
        return np.where(said == truth, 0.0, np.abs(said - truth))


def _judge_rows(
    table: _Table, rows: npt.NDArray[np.int64], batch: Batch, limits: tuple[float, float]
) -> _Findings:
    if table.moves[rows].any():
        return _judge_motions(table, rows, batch, limits[1])
    max_error = limits[0]
    count = len(rows)
    truth = batch.answers.relations
    values, bounds = batch.answers.separations, batch.answers.separation_bounds
    assert values is not None and bounds is not None
    answered = truth != Relation.UNSPECIFIED
    said, colliding = table.relations[rows], table.colliding[rows]
    is_said = said != Relation.UNSPECIFIED
    contact = truth != Relation.SEPARATED
    said_contact = np.where(is_said, said != Relation.SEPARATED, colliding == 1)
    mistaken = (is_said & (said != truth)) | (~np.isnan(colliding) & ((colliding == 1) != contact))
    said_distance, said_depth = table.distances[rows], table.depths[rows]
    distance_errors = _difference(
        said_distance, np.where(said_distance < 0, values, np.maximum(values, 0.0))
    )
    depth_errors = _difference(said_depth, np.maximum(-values, 0.0))
    faults = np.zeros((count, len(Fault)), bool)
    touching = (truth == Relation.TOUCHING) | (contact & said_contact)
    faults[:, Fault.FALSE_CONTACT] = mistaken & ~contact
    faults[:, Fault.TOUCHING_MISTAKEN] = mistaken & touching
    faults[:, Fault.MISS] = mistaken & contact & ~touching
    faults[:, Fault.DISTANCE] = distance_errors > max_error + bounds
    faults[:, Fault.DEPTH] = depth_errors > max_error + bounds
    faults[~answered] = False
    errors = np.max(
        [
            np.where(mistaken, np.abs(values), 0.0),
            np.where(faults[:, Fault.DISTANCE], distance_errors, 0.0),
            np.where(faults[:, Fault.DEPTH], depth_errors, 0.0),
        ],
        axis=0,
    )
    none = np.full(count, np.nan)
    return _Findings(
        rows, faults, errors, distance_errors, depth_errors, none, _failed(rows, batch, ~answered)
    )


def _failed(
    rows: npt.NDArray[np.int64], batch: Batch, which: npt.NDArray[np.bool_]
) -> dict[int, Problem]:
    unknown = Problem("INTERNAL", "the server gave no reason", None)
    return {int(rows[row]): batch.problem(int(row)) or unknown for row in np.flatnonzero(which)}


def _judge_motions(
    table: _Table, rows: npt.NDArray[np.int64], batch: Batch, max_error: float
) -> _Findings:
    """TOUCHING and OVERLAPPING count as the same; no contact counts as a contact at the end."""
    truth = batch.answers.relations
    until, contact = batch.answers.separated_until, batch.answers.contact_times
    assert until is not None and contact is not None
    failed = _failed(rows, batch, truth == Relation.UNSPECIFIED)
    graze = Problem("FAILED_PRECONDITION", "neither contact nor separation is proven", None)
    is_open = truth == Relation.WITHIN_TOLERANCE
    failed.update({int(rows[row]): graze for row in np.flatnonzero(is_open)})
    answered = (truth != Relation.UNSPECIFIED) & ~is_open
    touches = answered & ~np.isnan(contact)
    said, colliding = table.relations[rows], table.colliding[rows]
    times = table.contact_times[rows]
    claims_contact = ~np.isnan(times) | (colliding == 1) | (said > Relation.SEPARATED)
    claims_no_contact = (colliding == 0) | (said == Relation.SEPARATED)
    ends = np.where(touches, contact, 1.0)
    with np.errstate(invalid="ignore"):
        outside = np.maximum(np.maximum(until - times, times - ends), 0.0)
    time_errors = np.where(touches, outside, np.nan)
    faults = np.zeros((len(rows), len(Fault)), bool)
    faults[:, Fault.MISS] = touches & claims_no_contact
    faults[:, Fault.FALSE_CONTACT] = answered & ~touches & claims_contact
    faults[:, Fault.TIME] = time_errors > max_error
    errors = np.max(
        [
            np.where(faults[:, Fault.MISS], 1 - ends, 0.0),
            np.where(faults[:, Fault.FALSE_CONTACT] & ~np.isnan(times), 1 - times, 0.0),
            np.where(faults[:, Fault.TIME], time_errors, 0.0),
        ],
        axis=0,
    )
    none = np.full(len(rows), np.nan)
    return _Findings(rows, faults, errors, none, none, time_errors, failed)


def _collect(
    asking: _Asking, table: _Table, found: Sequence[_Findings], limits: tuple[float, float]
) -> Judged:
    """Requests the certificates of the wrong answers, and verifies them."""
    order = np.argsort(np.concatenate([np.empty(0, np.int64), *(part.rows for part in found)]))

    def all_of(values: Sequence[npt.NDArray[Any]], none: npt.NDArray[Any]) -> npt.NDArray[Any]:
        joined: npt.NDArray[Any] = np.concatenate([none, *values])[order]
        return joined

    faults = all_of([part.faults for part in found], np.zeros((0, len(Fault)), bool))
    errors = all_of([part.errors for part in found], np.empty(0))
    wrong = np.flatnonzero(faults.any(axis=1))
    wrong = wrong[np.argsort(-errors[wrong], kind="stable")]
    verifier = Verifier(asking.client)
    proven: dict[int, WrongAnswer] = {}
    for rows in table.parts(wrong):
        batch = asking.ask(rows, prove=True)
        exact = _judge_rows(table, rows, batch, limits)
        placements = asking.placements(rows)
        for index, row in enumerate(rows.tolist()):
            verifier.check_row(placements, batch, index)
            named = tuple(Fault(fault) for fault in np.flatnonzero(faults[row]).tolist())
            proven[row] = WrongAnswer(row, named, float(exact.errors[index]), batch[index])
    return Judged(
        len(table),
        [proven[row] for row in wrong.tolist()],
        {fault: int(faults[:, fault].sum()) for fault in Fault},
        {row: problem for part in found for row, problem in part.failed.items()},
        all_of([part.distance_errors for part in found], np.empty(0)),
        all_of([part.depth_errors for part in found], np.empty(0)),
        all_of([part.time_errors for part in found], np.empty(0)),
    )
