"""Argument checks. Each raises a ValueError or TypeError that names the argument, before anything
is sent."""

from __future__ import annotations

import math
import numbers
import operator
import re
import threading
from typing import Any

import numpy as np
import numpy.typing as npt

_ID = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]*(/[A-Za-z0-9][A-Za-z0-9._-]*)*")
_MAX_ID_CHARACTERS = 256
_MAX_UINT32 = 2**32 - 1
_MAX_UINT64 = 2**64 - 1
#: The power of two beyond which doubles cannot represent all integers.
_EXACT_INTEGERS = 2.0**53


def number(value: Any, name: str, *, minimum: float = -math.inf, finite: bool = True) -> float:
    """The double equal to `value`, at least `minimum`; never NaN."""
    if isinstance(value, np.ndarray) and value.ndim == 0 and not _holds_masked(value):
        value = value[()]
    if not _is_real(value):
        raise TypeError(f"{name} is {value!r}; it must be a number")
    if isinstance(value, np.integer):
        value = int(value)
    try:
        double = float(value)
    except OverflowError:
        double = math.inf
    if math.isnan(double) or (finite and math.isinf(double) and double == value):
        raise ValueError(f"{name} is {value}; it must be finite")
    if double != value:
        raise ValueError(
            f"{name} is {value}, which no double represents exactly; convert it explicitly, as "
            "with float()"
        )
    if double < minimum:
        raise ValueError(f"{name} is {value}; it must be at least {minimum:g}")
    return double


def _is_real(value: Any) -> bool:
    return isinstance(value, numbers.Real) and not isinstance(value, (bool, np.timedelta64))


def length(value: Any, name: str) -> float:
    """A length of at least 0, possibly infinite."""
    return number(value, name, minimum=0, finite=False)


def optional_length(value: Any, name: str) -> float | None:
    return None if value is None else length(value, name)


def seconds(value: Any, name: str = "timeout") -> float | None:
    """A duration of at least 0; None: unbounded."""
    if value is None:
        return None
    duration = number(value, name, minimum=0)
    if duration > threading.TIMEOUT_MAX:
        raise ValueError(f"{name} is {value} s; pass None to wait without a limit")
    return duration


def count(value: Any, name: str, *, minimum: int = 0, maximum: int = _MAX_UINT32) -> int:
    """An integer from `minimum` to `maximum`."""
    if isinstance(value, (bool, np.bool_)):
        raise TypeError(f"{name} is {value!r}; it must be an integer")
    try:
        integer = operator.index(value)
    except TypeError:
        raise TypeError(f"{name} is {value!r}; it must be an integer") from None
    if not minimum <= integer <= maximum:
        raise ValueError(f"{name} is {integer}; it must be from {minimum} to {maximum}")
    return integer


def optional_count(value: Any, name: str, *, minimum: int = 0) -> int | None:
    return None if value is None else count(value, name, minimum=minimum)


def revision(value: Any, name: str = "if_revision") -> int | None:
    """A revision of the store; None: no condition."""
    return None if value is None else count(value, name, maximum=_MAX_UINT64)


def text(value: Any, name: str, *, minimum: int = 0) -> str:
    """A string of at least `minimum` characters, and no longer than an ID."""
    if not isinstance(value, str):
        raise TypeError(f"{name} is {value!r}; it must be a string")
    if len(value) < minimum:
        raise ValueError(f"{name} is empty")
    if len(value) > _MAX_ID_CHARACTERS:
        raise ValueError(
            f"{name} has {len(value)} characters; at most {_MAX_ID_CHARACTERS} are allowed"
        )
    try:
        value.encode()
    except UnicodeEncodeError:
        raise ValueError(f"{name} is {value!r}, which is not Unicode text") from None
    return value


def header(value: Any, name: str) -> Any:
    """The header of an answer."""
    if not (hasattr(value, "store_id") and hasattr(value, "revision")):
        raise TypeError(f"{name} is {value!r}; it must be the header of an answer")
    text(value.store_id, f"{name}.store_id")
    count(value.revision, f"{name}.revision", maximum=_MAX_UINT64)
    return value


def hull_id(value: Any, name: str = "hull_id") -> str:
    """An ID of a hull or body, by the server's rule."""
    if not _ID.fullmatch(text(value, name)):
        raise ValueError(
            f"{name} is {value!r}; IDs are segments of [A-Za-z0-9][A-Za-z0-9._-]* " 'joined by "/"'
        )
    return str(value)


def as_array(values: Any, name: str) -> npt.NDArray[Any]:
    """`values` as an array of the same numbers.

    ValueError: masked elements; rows of different lengths; a list of numbers that no array type
    represents exactly. TypeError: an array of objects that are not numbers.
    """
    if _holds_masked(values):
        raise ValueError(
            f"{name} has masked elements{_first_masked(values)}; leave their rows out, as in "
            f"np.ma.compress_rows({name}), or give them values with {name}.filled(...)"
        )
    try:
        array = np.asarray(values)
    except OverflowError:
        array = np.asarray(values, object)
    except ValueError as error:
        if "inhomogeneous" not in str(error):
            raise
        raise ValueError(f"{name} has rows of different lengths") from None
    if array.dtype.kind == "O":
        return _doubles_of(array, name)
    # numpy converts lists that mix integers and floats to doubles, and rounds the integers.
    mixed = array.dtype.kind == "f" and not isinstance(values, np.ndarray)
    if mixed and (np.abs(array) >= _EXACT_INTEGERS).any() and not hasattr(values, "__array__"):
        return _doubles_of(np.asarray(values, object), name)
    return array


def _holds_masked(values: Any) -> bool:
    if isinstance(values, np.ma.MaskedArray):
        return bool(np.ma.is_masked(values))  # type: ignore[no-untyped-call]
    return isinstance(values, (list, tuple)) and any(
        _holds_masked(part) for part in values if isinstance(part, (list, tuple, np.ma.MaskedArray))
    )


def _first_masked(values: Any) -> str:
    if not isinstance(values, np.ma.MaskedArray) or values.ndim == 0:
        return ""
    mask: npt.NDArray[np.bool_] = np.ma.getmaskarray(values)  # type: ignore[no-untyped-call]
    rows = mask.reshape(len(mask), -1).any(axis=1)
    return f" in {int(rows.sum())} of {len(rows)} rows, the first at [{int(np.argmax(rows))}]"


def _doubles_of(array: npt.NDArray[Any], name: str) -> npt.NDArray[np.float64]:
    doubles = np.empty(array.shape)
    for at, value in np.ndenumerate(array):
        if not _is_real(value):
            raise TypeError(
                f"{name}{place(at)} is {value!r}, not a number; pass an array of floats"
            )
        # The caller checks for infinities and NaN.
        finite = not isinstance(value, (float, np.floating)) or math.isfinite(value)
        doubles[at] = number(value, name + place(at)) if finite else value
    return doubles


def as_floats(array: npt.NDArray[Any], name: str) -> npt.NDArray[Any]:
    """Converts to float64 or float32. ValueError names a number that is not exactly a double.
    TypeError: not numbers."""
    kind, size = array.dtype.kind, array.dtype.itemsize
    if kind == "f" and size in (4, 8):
        # The wire is little-endian.
        return array.astype(array.dtype.newbyteorder("<"), copy=False)
    if kind == "f" and size == 2:
        return array.astype(np.float32)
    if kind not in "iuf":
        raise TypeError(f"{name} has {array.dtype}, not numbers")
    doubles = array.astype(np.float64)
    # Compares in the original type: a comparison as doubles would round both sides.
    with np.errstate(invalid="ignore"):
        same = doubles.astype(array.dtype) == array
    if kind in "iu":
        # Beyond the type's range, the conversion back is meaningless.
        same &= doubles < 2.0 ** (8 * size - (kind == "i"))
    if kind == "f":
        same |= np.isnan(array)
    if not same.all():
        at = tuple(int(index) for index in np.argwhere(~same)[0])
        raise ValueError(
            f"{name}{place(at)} is {array[at]}, which no double represents exactly; convert it "
            f"explicitly, as with {name}.astype(float)"
        )
    return doubles


def place(at: tuple[int, ...]) -> str:
    """An index in the form that follows a name, as in [3][1]."""
    return "".join(f"[{index}]" for index in at)
