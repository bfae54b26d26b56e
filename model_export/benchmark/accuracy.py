"""How near an edited mesh comes to the true edit (B3), and what it leaves alone (B4)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

Array = NDArray[np.float64]

STILL = 1e-9
"""A vertex that the truth moves by less is left alone."""
EXTREME = 0.99
"""Vertices that move by this share of the most are at the ends of what an edit makes longer."""


def diagonal(x: Array) -> float:
    """Of the bounding box of ``x [V, 3]``."""
    return float(np.linalg.norm(np.ptp(x, axis=0)))


def edit_accuracy(x: Array, y: Array, truth: Array) -> tuple[float, float]:
    """Mean and 99th percentile of the distance to the truth, over the mean distance before.

    Args:
        x, y, truth: ``[V, 3]`` the input, the edited mesh and the true edit.
    """
    error = np.linalg.norm(y - truth, axis=1)
    moved = np.linalg.norm(truth - x, axis=1).mean()
    return float(error.mean() / moved), float(np.quantile(error, 0.99) / moved)


def locality(x: Array, y: Array, truth: Array) -> float:
    """Mean distance, over the diagonal, by which vertices moved that the truth leaves alone."""
    still = np.linalg.norm(truth - x, axis=1) < STILL
    if not still.any():
        return 0.0
    return float(np.linalg.norm(y - x, axis=1)[still].mean() / diagonal(x))


def dimension_error(x: Array, y: Array, truth: Array, factor: float) -> float:
    """By how many per cent the edited dimension, measured on the mesh, is not what was asked for.

    A dimension is the distance between those vertices that the true edit moves to either side the
    farthest.

    Args:
        x, y, truth: ``[V, 3]``.
        factor: that the dimension was to be multiplied by.
    """
    moved = truth - x
    along = moved[:, int(np.abs(moved).max(axis=0).argmax())]
    axis = int(np.abs(moved).max(axis=0).argmax())
    high, low = max(along.max(), 0.0), min(along.min(), 0.0)
    ends = along >= high - (1 - EXTREME) * (high - low), along <= low + (1 - EXTREME) * (high - low)
    done, due = (
        (v[ends[0], axis] - x[ends[0], axis]).mean() - (v[ends[1], axis] - x[ends[1], axis]).mean()
        for v in (y, truth)
    )
    # What was asked for is a share (factor - 1) / factor of the dimension after the edit.
    return float(abs(done / due - 1.0) * abs(factor - 1.0) / factor * 100.0)


def surface_accuracy(x: Array, truth: Array, made: Array) -> tuple[float, float, float]:
    """The same as `edit_accuracy` and `locality` for a mesh made anew: each true vertex against the
    nearest of many points ``made [n, 3]`` on it, which is the kindest reading."""
    error, _ = cKDTree(made).query(truth)
    distance = np.linalg.norm(truth - x, axis=1)
    still, moved = distance < STILL, distance.mean()
    local = error[still].mean() / diagonal(x) if still.any() else 0.0
    return float(error.mean() / moved), float(np.quantile(error, 0.99) / moved), float(local)
