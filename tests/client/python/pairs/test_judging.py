"""Other programs' answers against exact ones."""

from __future__ import annotations

import pathlib
from typing import Any

import numpy as np
import pytest

import hulld
from conftest import CUBE

HULLS = {"cube": CUBE}


def columns(places: list[float], **said: Any) -> dict[str, Any]:
    count = len(places)
    poses = [(place, 0, 0) for place in places]
    return {"a": ["cube"] * count, "b": ["cube"] * count, "poses_b": poses, **said}


def faults(judged: hulld.Judged) -> dict[int, list[str]]:
    return {wrong.row: [fault.name for fault in wrong.faults] for wrong in judged.wrong}


def test_right_answers_pass(client: hulld.Client) -> None:
    said = columns(
        [3, 1, 0.5, 0.5],
        relation=["SEPARATED", "touching", hulld.Relation.OVERLAPPING, ""],
        distance=[2, 0, 0, -0.5],
        depth=[0, 0, 0.5, np.nan],
    )
    judged = hulld.judge(said, hulls=HULLS, client=client, max_error=1e-12)
    assert not judged.wrong and not judged.failed
    assert "4 answers, 0 wrong" in repr(judged)


def test_wrong_answers_come_worst_first_with_their_proof(client: hulld.Client, name: str) -> None:
    client.append_points(f"{name}/cube", CUBE, create=True)
    said = columns(
        [3, 2, 1, 0.25, 0.5],
        relation=["SEPARATED", "OVERLAPPING", "SEPARATED", "SEPARATED", "TOUCHING"],
        distance=[2.25, np.nan, 0, 0, 0],
    )
    said["a"] = [f"{name}/cube"] * 5
    judged = hulld.judge(said, hulls=HULLS, client=client)
    assert [wrong.row for wrong in judged.wrong] == [1, 3, 4, 0, 2]
    assert faults(judged) == {
        0: ["DISTANCE"],
        1: ["FALSE_CONTACT"],
        2: ["TOUCHING_MISTAKEN"],
        3: ["MISS"],
        4: ["TOUCHING_MISTAKEN"],
    }
    assert [wrong.error for wrong in judged.wrong] == pytest.approx([1, 0.75, 0.5, 0.25, 0])
    assert all(wrong.answer.certificate is not None for wrong in judged.wrong)
    assert judged.counts[hulld.Fault.TOUCHING_MISTAKEN] == 2
    assert judged.distance_errors[0] == pytest.approx(0.25) and np.isnan(judged.distance_errors[1])


def test_files_hold_the_same_table(tmp_path: pathlib.Path, client: hulld.Client) -> None:
    said = columns([2.0, 1.0, 0.5], colliding=[1, 0, 1], distance=[0.0, 0.0, np.nan])
    expected = faults(hulld.judge(said, hulls=HULLS, client=client))
    assert expected == {0: ["FALSE_CONTACT", "DISTANCE"], 1: ["TOUCHING_MISTAKEN"]}
    np.savez(tmp_path / "said.npz", **{key: np.array(value) for key, value in said.items()})
    assert faults(hulld.judge(tmp_path / "said.npz", hulls=HULLS, client=client)) == expected
    (tmp_path / "said.csv").write_text(
        "a,b,b_qw,b_qx,b_qy,b_qz,b_x,colliding,distance,solver\n# a comment\n"
        "cube,cube,2,0,0,0,2,1,0,fast\ncube,cube,1,0,0,0,1,0,0,fast\ncube,cube,1,0,0,0,0.5,1,,fast\n"
    )
    assert faults(hulld.judge(str(tmp_path / "said.csv"), hulls=HULLS, client=client)) == expected


def test_a_recorded_float_program_is_judged(client: hulld.Client, rng: np.random.Generator) -> None:
    """A box test in float32 that grows its boxes by a margin, as physics engines do."""
    places = rng.integers(-48, 49, (500, 3)) / 32
    gaps = np.maximum(np.abs(places) - 1, 0)
    margin = np.maximum(gaps.astype(np.float32) - np.float32(0.04), np.float32(0))
    said = {
        "a": ["cube"] * 500,
        "b": ["cube"] * 500,
        "poses_b": places,
        "colliding": (margin == 0).all(axis=1),
        "distance": np.linalg.norm(margin, axis=1),
    }
    judged = hulld.judge(said, hulls=HULLS, client=client, max_error=0.1)
    false = said["colliding"] & (gaps > 0).any(axis=1)
    assert false.sum() > 5
    assert sorted(wrong.row for wrong in judged.wrong) == np.flatnonzero(false).tolist()
    assert judged.counts[hulld.Fault.FALSE_CONTACT] == false.sum()
    errors = np.abs(said["distance"] - np.linalg.norm(gaps, axis=1))
    assert judged.distance_errors == pytest.approx(errors, abs=1e-9)


def test_rows_without_an_exact_answer_fail_alone(client: hulld.Client) -> None:
    said = columns([0, 0], colliding=[1, 1])
    said["b"] = ["absent", "cube"]
    judged = hulld.judge(said, hulls=HULLS, client=client)
    assert not judged.wrong
    assert judged.failed[0].code == "NOT_FOUND"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"colliding": None}, "needs an answer"),
        ({"b": None}, "needs the column 'b'"),
        ({"solver": ["x"]}, "no column 'solver'"),
        ({"colliding": ["maybe"]}, r"colliding\[0\] is 'maybe'"),
        ({"relation": ["NEAR"]}, r"relation\[0\] is 'NEAR'"),
        ({"depth": [-1]}, r"depth\[0\] is -1.0; it must be at least 0"),
        ({"distance": ["far"]}, r"distance\[0\] is 'far', not a number"),
        ({"distance": [1, 2]}, "distance has 2 rows, a 1"),
    ],
)
def test_malformed_tables_are_named(change: dict[str, Any], message: str) -> None:
    said = {**columns([0], colliding=[True]), **change}
    said = {name: column for name, column in said.items() if column is not None}
    with pytest.raises(ValueError, match=message):
        hulld.judge(said, hulls=HULLS)
