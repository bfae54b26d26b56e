"""The shortest vector that keeps linear inequalities, or the proof that none does.

Lawson and Hanson's least distance programming ("Solving Least Squares Problems", chapter 23): its
dual is a non-negative least squares fit, whose residual is the answer.  Without a residual there
is none, and the fit's weights are Farkas' proof: a sum of the inequalities, with weights that are
not negative, that says 0 >= 1.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

Array = NDArray[np.float64]

FARTHEST = 1e-10
"""Least square of the residual, whose inverse is about that of the distance in units of the largest
inequality: what lies farther than some 1e5 of them does not exist for any practical purpose."""
TAKES_PART = 1e-9
"""Least weight in a proof, beside its largest, of an inequality that takes part in it."""


class Contradiction(Exception):
    """No vector keeps all inequalities.

    Attributes:
        weights: ``[n]``, not negative, with ``weights @ rows = 0`` and ``weights @ least > 0``.
            Without any one of those that are positive the rest can be kept: they are linearly
            independent but for this one relation.
    """

    def __init__(self, weights: Array) -> None:
        super().__init__("the inequalities contradict each other")
        self.weights = weights


def least_distance(rows: Array, least: Array) -> Array:
    """The shortest ``z [d]`` with ``rows [n, d] @ z >= least [n]``.

    Raises:
        Contradiction: when there is none.
    """
    size = np.linalg.norm(rows, axis=1)
    still = np.flatnonzero((size == 0.0) & (least > 0.0))
    if len(still):
        raise Contradiction(np.where(np.arange(len(least)) == still[0], 1.0, 0.0))
    reached = np.flatnonzero(size > 0.0)
    rows, sides = rows[reached] / size[reached, None], least[reached] / size[reached]
    largest = sides.max(initial=0.0)
    if largest <= 0.0:
        return np.zeros(rows.shape[1])
    stacked = np.vstack([rows.T, sides / largest])
    target = np.zeros(len(stacked))
    target[-1] = 1.0
    dual, _ = nnls(stacked, target, maxiter=30 * len(sides) + 100)
    residual = stacked @ dual - target
    if -residual[-1] < FARTHEST:
        weights = np.zeros(len(least))
        weights[reached] = np.where(dual > TAKES_PART * dual.max(), dual, 0.0) / size[reached]
        raise Contradiction(weights)
    shortest: Array = -largest * residual[:-1] / residual[-1]
    return shortest
