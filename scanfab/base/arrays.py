"""Arrays are cast and checked here, once, when they enter the package."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields
from typing import Any

import numpy as np
import numpy.typing as npt

from scanfab.base.errors import PackingError
from scanfab.base.typing import AnyArray, BoolArray, FloatArray, IntArray

# limits for lengths: the cube of any length between them is finite and above 0
LEAST, MOST = 1e-100, 1e100
# rows at a time, whose temporary arrays take some tens of megabytes
ROWS = 1 << 18


def doubles(values: AnyArray) -> FloatArray:
    """Convert numbers to 8-byte floats; a signalling 4-byte NaN raises no warning."""
    with np.errstate(invalid="ignore"):
        return values.astype(np.float64, copy=False)


def cast(name: str, values: npt.ArrayLike, dtype: type | None, shape: tuple[Any, ...]) -> AnyArray:
    """
    Return a read-only array of the given type and shape.

    In ``shape``, None allows any length, and a final ``...`` allows any further dimensions.
    """
    spelt = ", ".join("N" if n is None else "..." if n is ... else str(n) for n in shape)
    try:
        array = np.asarray(values)
        if array.size == 0 and shape[0] is None:
            array = np.zeros((0, *shape[1:]))  # an empty list
        # A read-only array that owns its memory never changes, so it is shared, not copied.
        shared = array.flags.owndata and not array.flags.writeable
        numbers = array.astype(array.dtype if dtype is None else dtype, copy=not shared)
    except (TypeError, ValueError) as error:
        raise PackingError(f"{name}: expected numbers of shape ({spelt}): {error}") from None
    wanted, found = shape, numbers.shape
    if shape[-1] is ...:
        wanted, found = shape[:-1], found[: len(shape) - 1]
    if len(found) != len(wanted) or any(
        want not in (None, have) for have, want in zip(found, wanted, strict=True)
    ):
        raise PackingError(f"{name}: expected shape ({spelt}), found {numbers.shape}")
    if dtype is np.int64 and array.dtype.kind == "f" and not np.array_equal(array, numbers):
        raise PackingError(f"{name}: expected whole numbers")
    numbers.flags.writeable = False
    return numbers


def all_within(values: FloatArray, least: float, most: float) -> bool:
    """Return whether all values lie between two limits, without making a temporary array."""
    return values.size == 0 or bool(values.min() >= least and values.max() <= most)


def compressed(chosen: BoolArray, values: AnyArray) -> AnyArray:
    """The chosen rows; not a copy if that is all of them."""
    # several times as fast as to index with a mask
    return values if chosen.all() else np.compress(chosen, values, axis=0)


def in_parts(function: Callable[..., AnyArray], *arrays: AnyArray) -> AnyArray:
    """What a function makes of arrays, row by row; of many rows some at a time, to save memory."""
    starts = range(0, max(len(arrays[0]), 1), ROWS)
    parts = [function(*(one[start : start + ROWS] for one in arrays)) for start in starts]
    return parts[0] if len(parts) == 1 else np.concatenate(parts)


def grains_named(id: IntArray, wrong: BoolArray) -> str:
    """Name the wrong grains in a message: 'grain 7' or '3 grains, the first is 7'."""
    first = id[np.argmax(wrong)]
    number = np.count_nonzero(wrong)
    return f"grain {first}" if number == 1 else f"{number} grains, the first is {first}"


def concatenated(parts: Sequence[Any]) -> Any:
    """Join arrays end to end; in dicts and dataclasses, join the arrays of the same name."""
    first = parts[0]
    if isinstance(first, np.ndarray):
        return np.concatenate(parts)
    if isinstance(first, dict):
        return {key: concatenated([part[key] for part in parts]) for key in first}
    names = [field.name for field in fields(first)]
    whole = {name: concatenated([getattr(part, name) for part in parts]) for name in names}
    return type(first)(**whole)
