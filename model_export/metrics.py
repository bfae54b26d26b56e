"""How well parameters are recovered on labelled shapes (the paper's Table 2, and per parameter)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from service.template.affine import AffineTemplate

THRESHOLDS = (0.01, 0.02, 0.03)


@dataclass(frozen=True)
class Recovery:
    """Parameter recovery over a set of shapes.

    Attributes:
        within: share of template vertices closer to their true place than each threshold, in the
            normalised frame of radius 0.6.
        edited: the same after a random edit of true and recovered parameters alike.
        error: ``[d]`` mean absolute error over the range, both in the normalised frame's units.
    """

    within: tuple[float, ...]
    edited: tuple[float, ...]
    error: np.ndarray

    def row(self) -> str:
        """``within`` in percent, as the paper prints it."""
        return " / ".join(f"{100 * share:.1f}" for share in self.within)


def recovery(
    template: AffineTemplate, predicted: np.ndarray, true: np.ndarray, seed: int = 0
) -> Recovery:
    """Compare outputs with labels.

    Args:
        template: decodes both.
        predicted, true: ``[n, d + 3]`` parameters and translation, normalised.
        seed: of the edits: each parameter times exp U(ln 0.6, ln 1.67).
    """
    size = len(template.parameters)
    rng = np.random.default_rng(seed)
    factors = np.exp(rng.uniform(np.log(0.6), np.log(1.67), (len(true), size)))
    spread = true[:, :size].max(axis=0) - true[:, :size].min(axis=0)
    return Recovery(
        within=_within(template, predicted, true, np.ones_like(factors)),
        edited=_within(template, predicted, true, factors),
        error=np.abs(predicted[:, :size] - true[:, :size]).mean(axis=0) / spread,
    )


def _within(
    template: AffineTemplate, predicted: np.ndarray, true: np.ndarray, factors: np.ndarray
) -> tuple[float, ...]:
    size = factors.shape[1]
    counts = np.zeros(len(THRESHOLDS))
    for start in range(0, len(true), 100):
        rows = slice(start, start + 100)
        change = (predicted[rows, :size] - true[rows, :size]) * factors[rows]
        shift = predicted[rows, size:] - true[rows, size:]
        gap = np.einsum("vcd,nd->nvc", template.jacobian, change) + shift[:, None]
        distance = np.linalg.norm(gap, axis=2).ravel()
        counts += [(distance < threshold).sum() for threshold in THRESHOLDS]
    return tuple(float(share) for share in counts / (len(true) * len(template.jacobian)))
