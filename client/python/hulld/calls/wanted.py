"""The parts of an answer beyond the relation."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

from hulld import arguments
from hulld.v1 import collision_pb2


@dataclass(frozen=True)
class Wanted:
    """Like the keyword arguments of Client.check_collision. max_error requests the separation."""

    axis: bool = False
    analysis: bool = False
    certificate: bool = False
    separation: bool = False
    max_error: float | None = None
    witness: bool = False
    clearance: float | None = None
    normal: bool = False
    max_time_error: float | None = None
    resolution: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "separation", self.separation or self.max_error is not None)

    def for_limit(self, limit: int | None) -> Wanted:
        """Adds the separation and the clearance that the limit of a scene requires."""
        if limit is None:
            return self
        clearance = math.inf if self.clearance is None else self.clearance
        return replace(self, separation=True, clearance=clearance)

    def message(self) -> Any:
        return collision_pb2.Wanted(
            axis=self.axis,
            analysis=self.analysis,
            certificate=self.certificate,
            separation=self.separation,
            max_error=arguments.optional_length(self.max_error, "max_error"),
            witness=self.witness,
            clearance=arguments.optional_length(self.clearance, "clearance"),
            normal=self.normal,
            max_time_error=arguments.optional_length(self.max_time_error, "max_time_error"),
            resolution=arguments.optional_length(self.resolution, "resolution"),
        )
