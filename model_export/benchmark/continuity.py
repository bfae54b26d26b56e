"""Whether a slider moves a mesh evenly, and the parameter is found again where it was put (B9)."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.stats import spearmanr

Array = NDArray[np.float64]
STEPS = 33


def evenness(meshes: Sequence[Array]) -> float:
    """The largest step over the mean one along a slider: 1 for an even motion.

    Args:
        meshes: ``[V, 3]`` each, at equal steps of a parameter.
    """
    steps = np.array([np.linalg.norm(b - a, axis=1).mean() for a, b in pairwise(meshes)])
    return float(steps.max() / steps.mean())


def monotone(put: Sequence[float], found: Sequence[float]) -> float:
    """Spearman's rank correlation of a parameter's values with those inferred again."""
    return float(spearmanr(put, found).statistic)
