"""The benefit of a tolerance: time against the share of undecided answers.

    python trade_plot.py [PICTURE]

Pairs of balls of radius 1 are near contact, like parts resting on each other: apart or overlapping
by 1e-17 to 1e-3, equally many in each decade. With tolerance 0 every relation is exact. With a
larger one, pairs closer than the tolerance may be WITHIN_TOLERANCE, which is never wrong. Draws
PICTURE if matplotlib is installed, and always prints a table. The times depend on the load of the
machine.
"""

from __future__ import annotations

import importlib
import sys
import time

import numpy as np

import hulld

PAIRS = 2000
TOLERANCES = [0.0, 1e-15, 1e-12, 1e-9, 1e-6, 1e-3]


def measure(client: hulld.Client) -> list[tuple[float, float, int]]:
    """Tolerance, microseconds for each pair, and pairs WITHIN_TOLERANCE."""
    rng = np.random.default_rng(7)
    points = rng.normal(size=(300, 3))
    client.append_points(
        "ball", points / np.linalg.norm(points, axis=1)[:, np.newaxis], create=True
    )

    # Rotated at random, then moved along the shortest direction until only the gap remains.
    poses = np.concatenate([rng.normal(size=(2 * PAIRS, 4)), np.zeros((2 * PAIRS, 3))], axis=1)
    poses[1::2, 4] = 3
    pairs = np.arange(2 * PAIRS).reshape(-1, 2)
    apart = client.check_collisions(hulld.Placements("ball", poses), pairs, witness=True).answers
    assert apart.witness_points is not None
    gaps = apart.witness_points[:, 1] - apart.witness_points[:, 0]
    lengths = np.linalg.norm(gaps, axis=1, keepdims=True)
    left = 10 ** rng.uniform(-17, -3, (PAIRS, 1)) * rng.choice([-1, 1], (PAIRS, 1))
    poses[1::2, 4:] -= gaps * (1 - left / lengths)
    placements = hulld.Placements("ball", poses)

    rows = []
    for tolerance in TOLERANCES:
        best = float("inf")
        for _ in range(5):
            start = time.perf_counter()
            answers = client.check_collisions(placements, pairs, tolerance=tolerance).answers
            best = min(best, time.perf_counter() - start)
        open_pairs = int((answers.relations == hulld.Relation.WITHIN_TOLERANCE).sum())
        rows.append((tolerance, 1e6 * best / PAIRS, open_pairs))
    return rows


def draw(rows: list[tuple[float, float, int]], path: str) -> None:
    """ImportError: matplotlib is not installed."""
    importlib.import_module("matplotlib").use("Agg")
    pyplot = importlib.import_module("matplotlib.pyplot")
    figure, time_axis = pyplot.subplots()
    names = [f"{tolerance:g}" for tolerance, _, _ in rows]
    time_axis.bar(names, [microseconds for _, microseconds, _ in rows], color="tab:blue")
    time_axis.set_xlabel("tolerance")
    time_axis.set_ylabel("microseconds a pair")
    open_axis = time_axis.twinx()
    open_axis.plot(names, [100 * count / PAIRS for _, _, count in rows], "o-", color="tab:orange")
    open_axis.set_ylabel("% of pairs left open")
    figure.savefig(path)


def main() -> None:
    with hulld.local() as client:
        rows = measure(client)
    print(f"{'tolerance':>10}  {'us a pair':>10}  {'gain':>6}  {'open':>6}")
    for tolerance, microseconds, open_pairs in rows:
        gain, left_open = rows[0][1] / microseconds, 100 * open_pairs / PAIRS
        print(f"{tolerance:>10g}  {microseconds:>10.2f}  {gain:>5.1f}x  {left_open:>5.1f}%")
    if len(sys.argv) > 1:
        try:
            draw(rows, sys.argv[1])
            print(f"{sys.argv[1]} drawn")
        except ImportError:
            print("no picture: matplotlib is not installed")


if __name__ == "__main__":
    main()
