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
        variants: share of shapes whose variant is told; 1 where there are none.
    """

    within: tuple[float, ...]
    edited: tuple[float, ...]
    error: np.ndarray
    variants: float

    def row(self) -> str:
        """``within`` in percent, as the paper prints it."""
        return " / ".join(f"{100 * share:.1f}" for share in self.within)


def recovery(
    template: AffineTemplate,
    predicted: np.ndarray,
    true: np.ndarray,
    variant: np.ndarray,
    seed: int = 0,
) -> Recovery:
    """Compare outputs with labels, on the parts that each shape has.

    Args:
        template: decodes both.
        predicted: ``[n, d + 3 + K]`` parameters, translation and log odds of the variants.
        true: ``[n, d + 3]``, both normalised.
        variant: ``[n]`` of each shape.
        seed: of the edits: each parameter times exp U(ln 0.6, ln 1.67).
    """
    size = len(template.parameters)
    rng = np.random.default_rng(seed)
    factors = np.exp(rng.uniform(np.log(0.6), np.log(1.67), (len(true), size)))
    spread = true[:, :size].max(axis=0) - true[:, :size].min(axis=0)
    gap = predicted[:, : size + 3] - true
    active = np.stack([own.active for own in template.variants])[variant]
    odds = predicted[:, size + 3 :]
    counted = np.maximum(active.sum(axis=0), 1)
    return Recovery(
        within=_within(template, gap, variant, np.ones_like(factors)),
        edited=_within(template, gap, variant, factors),
        error=(active * np.abs(gap[:, :size])).sum(axis=0) / counted / spread,
        variants=float((odds.argmax(axis=1) == variant).mean()) if odds.size else 1.0,
    )


def _within(
    template: AffineTemplate, gap: np.ndarray, variant: np.ndarray, factors: np.ndarray
) -> tuple[float, ...]:
    size = factors.shape[1]
    counts, total = np.zeros(len(THRESHOLDS)), 0
    for index, own in enumerate(template.variants):
        shapes = np.flatnonzero(variant == index)
        for rows in np.array_split(shapes, -(-len(shapes) // 100) or 1):
            change, shift = gap[rows, :size] * factors[rows], gap[rows, size:]
            moved = np.einsum("vcd,nd->nvc", own.jacobian, change) + shift[:, None]
            distance = np.linalg.norm(moved, axis=2).ravel()
            counts += [(distance < threshold).sum() for threshold in THRESHOLDS]
            total += len(distance)
    return tuple(float(share) for share in counts / total)
