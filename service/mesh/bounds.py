"""The axis-aligned box of points, and what glTF's JSON says of it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


def bounds(points: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    """Least and greatest value of each column of ``[N, C]``, N > 0, of the same dtype.

    Column by column: numpy's reduction along a long first axis takes twenty times as long.
    """
    columns = range(points.shape[1])
    low = np.array([points[:, column].min() for column in columns], points.dtype)
    high = np.array([points[:, column].max() for column in columns], points.dtype)
    return low, high


def same_bound(text: Any, bound: NDArray[Any]) -> bool:
    """Whether a bound in the JSON, of whatever type, says what the stored values are."""
    if not isinstance(text, list) or len(text) != len(bound):
        return False
    return all(
        isinstance(value, int | float) and _rounded(value, bound.dtype) == stored.item()
        for value, stored in zip(text, bound, strict=True)
    )


def _rounded(value: float, dtype: np.dtype[Any]) -> float:
    """A number of the JSON, which may be of any size, as it is stored."""
    if dtype.kind == "f" and abs(value) <= float(np.finfo(dtype).max):
        return float(dtype.type(value))
    return value
