"""The answers about configurations of a robot."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from hulld.answers.collisions import Answers, Relation, Separation

# Relations from weakest to strongest, and the rank of each.
_BY_STRENGTH = np.array(
    [
        Relation.UNSPECIFIED,
        Relation.SEPARATED,
        Relation.WITHIN_TOLERANCE,
        Relation.TOUCHING,
        Relation.OVERLAPPING,
    ],
    np.uint8,
)
_STRENGTH = np.argsort(_BY_STRENGTH).astype(np.uint8)


@dataclass(frozen=True, repr=False, eq=False)
class RobotCheck:
    """The answers about n configurations of a robot with m pairs. check[i] is the answer about one.

    relations (n): the strongest relation of any pair, in the order SEPARATED, WITHIN_TOLERANCE,
    TOUCHING, OVERLAPPING. deciding (n): the row in `pairs` of the deciding pair: the pair of least
    separation if separations were requested, otherwise the first pair with this relation; -1 if
    SEPARATED without separations. separations, separation_bounds (n): of the deciding pair.
    within_clearance (n): True if any pair is. pairs (m x 2): indices into `names`, of the robot's
    parts and then the scene. pair_relations, pair_separations (n x m): of each pair. None if not
    requested.

    relation, separation, and pair summarize all configurations: they belong to the configuration
    with the strongest relation.
    """

    names: Sequence[str]
    pairs: npt.NDArray[np.uint32]
    relations: npt.NDArray[np.uint8]
    deciding: npt.NDArray[np.intp]
    separations: npt.NDArray[np.float64] | None
    separation_bounds: npt.NDArray[np.float64] | None
    within_clearance: npt.NDArray[np.bool_] | None
    pair_relations: npt.NDArray[np.uint8]
    pair_separations: npt.NDArray[np.float64] | None

    @property
    def colliding(self) -> npt.NDArray[np.bool_]:
        """n: TOUCHING or OVERLAPPING."""
        found: npt.NDArray[np.bool_] = _STRENGTH[self.relations] >= _STRENGTH[Relation.TOUCHING]
        return found

    @property
    def first_contact(self) -> int | None:
        """The first colliding configuration; None if there is none. Of a trajectory, the first
        waypoint."""
        return int(np.argmax(self.colliding)) if self.colliding.any() else None

    @property
    def relation(self) -> Relation:
        """The strongest relation of any configuration."""
        return Relation(int(self.relations[self._strongest()]))

    @property
    def separation(self) -> Separation | None:
        """The smallest separation of any configuration; None if not requested."""
        if self.separations is None or self.separation_bounds is None:
            return None
        at = self._strongest()
        return Separation(float(self.separations[at]), float(self.separation_bounds[at]))

    @property
    def pair(self) -> tuple[str, str] | None:
        """The names of the pair that decides `relation` and `separation`; None if `deciding` has no
        pair."""
        row = int(self.deciding[self._strongest()])
        return None if row < 0 else self.names_of(row)

    def names_of(self, row: int) -> tuple[str, str]:
        """The names of the pair in a row of `pairs`."""
        a, b = self.pairs[row].tolist()
        return (self.names[a], self.names[b])

    def _strongest(self) -> int:
        if not len(self):
            raise ValueError("no configuration was checked")
        strength = _STRENGTH[self.relations]
        if self.separations is None:
            return int(np.argmax(strength))
        strongest = strength == strength.max()
        return int(np.argmin(np.where(strongest, self.separations, np.inf)))

    def __len__(self) -> int:
        return len(self.relations)

    def __getitem__(self, index: int) -> RobotCheck:
        """The answer for one configuration; -1 is the last one. IndexError: no such
        configuration."""
        at = range(len(self))[index]
        some = slice(at, at + 1)
        return RobotCheck(
            self.names,
            self.pairs,
            self.relations[some],
            self.deciding[some],
            None if self.separations is None else self.separations[some],
            None if self.separation_bounds is None else self.separation_bounds[some],
            None if self.within_clearance is None else self.within_clearance[some],
            self.pair_relations[some],
            None if self.pair_separations is None else self.pair_separations[some],
        )

    def __iter__(self) -> Iterator[RobotCheck]:
        return (self[index] for index in range(len(self)))

    def __bool__(self) -> bool:
        raise TypeError("an answer is neither true nor false; use .colliding.any() or .relation")

    def __repr__(self) -> str:
        if not len(self):
            return "RobotCheck(0 configurations)"
        parts = [self.relation.name]
        if self.separation is not None:
            parts.append(f"separation={self.separation.value!r}")
        if self.pair is not None:
            parts.append(" with ".join(self.pair))
        if len(self) > 1:
            parts.append(f"{int(self.colliding.sum())} of {len(self)} configurations colliding")
        return f"RobotCheck({', '.join(parts)})"


def collect(
    names: Sequence[str], pairs: npt.NDArray[np.uint32], batches: Sequence[Answers]
) -> RobotCheck:
    """Collects the answers of batches; each batch has all pairs of some configurations."""

    def column(name: str) -> Any:
        parts = [getattr(batch, name) for batch in batches]
        return None if parts[0] is None else np.concatenate(parts).reshape(-1, len(pairs))

    relations = column("relations")
    separations, bounds = column("separations"), column("separation_bounds")
    within = column("within_clearance")
    strength = _STRENGTH[relations]
    strongest = strength.max(axis=1)
    rows = np.arange(len(relations))
    if separations is None:
        deciding = np.argmax(strength, axis=1)
        deciding[strongest == _STRENGTH[Relation.SEPARATED]] = -1
    else:
        decides = strength == strongest[:, np.newaxis]
        deciding = np.argmin(np.where(decides, separations, np.inf), axis=1)
        # An empty hull has an infinite separation, and is never the minimum.
        deciding = np.where(decides[rows, deciding], deciding, np.argmax(decides, axis=1))
    return RobotCheck(
        tuple(names),
        pairs,
        _BY_STRENGTH[strongest],
        deciding,
        None if separations is None else separations[rows, deciding],
        None if bounds is None else bounds[rows, deciding],
        None if within is None else within.any(axis=1),
        relations,
        separations,
    )
