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
        ({"colliding": None}, "needs a column of answers"),
        ({"b": None}, "needs the column 'b'"),
        ({"solver": ["x"]}, "no column 'solver'"),
        ({"colliding": ["maybe"]}, r"colliding\[0\] is 'maybe'"),
        ({"relation": ["NEAR"]}, r"relation\[0\] is 'NEAR'"),
        ({"depth": [-1]}, r"depth\[0\] is -1.0; it must be at least 0"),
        ({"distance": ["far"]}, r"distance\[0\] is 'far', not a number"),
        ({"distance": [1, 2]}, "distance has 2 rows, but a has 1"),
    ],
)
def test_malformed_tables_are_named(change: dict[str, Any], message: str) -> None:
    said = {**columns([0], colliding=[True]), **change}
    said = {name: column for name, column in said.items() if column is not None}
    with pytest.raises(ValueError, match=message):
        hulld.judge(said, hulls=HULLS)


def slide(gaps: list[float], travel: float, **said: Any) -> dict[str, Any]:
    """Cubes that approach along x from a gap, by `travel`."""
    ends = [(1 + gap - travel, 0, 0) for gap in gaps]
    return {**columns([1 + gap for gap in gaps], **said), "end_poses_b": ends}


def test_times_of_contact_are_judged_against_the_proven_bracket(client: hulld.Client) -> None:
    said = slide(
        [1, 1, 1, 1, 3, 3, 1],
        2.0,
        colliding=[1, 1, 1, 0, 0, 1, 1],
        contact_time=[0.5, 0.5625, 0.25, np.nan, np.nan, 0.75, 0.5078125],
    )
    judged = hulld.judge(said, hulls=HULLS, client=client, max_time_error=1e-2)
    assert faults(judged) == {
        1: ["TIME"],
        2: ["TIME"],
        3: ["MISS"],
        5: ["FALSE_CONTACT"],
    }
    assert [(wrong.row, wrong.error) for wrong in judged.wrong] == [
        (3, 0.5),
        (2, 0.25),
        (5, 0.25),
        (1, 0.0625),
    ]
    assert judged.time_errors[6] == 0.0078125 and np.isnan(judged.time_errors[4])
    assert "of a time 0.25" in repr(judged)
    contact = judged.wrong[0].answer.first_contact
    assert contact is not None and contact.contact_time == 0.5


def test_motions_and_pairs_at_rest_share_a_table(
    tmp_path: pathlib.Path, client: hulld.Client
) -> None:
    (tmp_path / "said.csv").write_text(
        "a,b,b_x,b_to_x,b_to_y,distance,contact_time\n"
        "cube,cube,3,,,2.5,\ncube,cube,3,0,,,0.75\ncube,cube,3,,2,,\n"
    )
    judged = hulld.judge(tmp_path / "said.csv", hulls=HULLS, client=client, max_time_error=1e-3)
    assert faults(judged) == {0: ["DISTANCE"], 1: ["TIME"]}
    assert judged.distance_errors[0] == pytest.approx(0.5)
    assert judged.time_errors[1] == pytest.approx(1 / 12)


def test_a_rotation_takes_the_shorter_path(client: hulld.Client) -> None:
    # A quarter turn brings the bar into the cube; the quaternion is given with the other sign.
    bar = np.array([[-3, -0.1, -0.1], [3, -0.1, -0.1], [-3, 0.1, 0.1], [3, 0.1, 0.1]])
    said = {
        "a": ["bar"],
        "b": ["cube"],
        "poses_b": [(0, 1.5, 0)],
        "end_poses_a": [(-np.cos(np.pi / 4), 0, 0, -np.sin(np.pi / 4), 0, 0, 0)],
        "end_poses_b": [(0, 1.5, 0)],
        "colliding": [False],
    }
    judged = hulld.judge(said, hulls={**HULLS, "bar": bar}, client=client)
    assert faults(judged) == {0: ["MISS"]}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"contact_time": [1.5]}, r"contact_time\[0\] is above 1"),
        ({"contact_time": [-0.5]}, r"contact_time\[0\] is -0.5; it must be at least 0"),
        ({"distance": [1]}, r"distance\[0\] is set for a motion"),
        ({"contact_time": [0.5], "end_poses_b": [(1, 0, 0)]}, r"contact_time\[0\] requires a motion"),
    ],
)
def test_malformed_motions_are_named(change: dict[str, Any], message: str) -> None:
    said = {**slide([0.0], 1.0, colliding=[True]), **change}
    with pytest.raises(ValueError, match=message):
        hulld.judge(said, hulls=HULLS)
