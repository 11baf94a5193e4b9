"""Equality of answers that contain arrays."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np


class ArrayFields:
    """A base of dataclasses with arrays. == compares arrays element by element, and NaN equals NaN;
    the == that dataclass generates would raise a ValueError."""

    __dataclass_fields__: ClassVar[dict[str, Any]]

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return all(
            _are_equal(getattr(self, name), getattr(other, name))
            for name in self.__dataclass_fields__
        )


def _are_equal(a: Any, b: Any) -> bool:
    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        return np.array_equal(a, b, equal_nan=a.dtype.kind == "f")
    return type(a) is type(b) and bool(a == b)
