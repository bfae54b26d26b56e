from __future__ import annotations

import numpy as np
import pytest

from model_export.metrics import THRESHOLDS, recovery
from service.template.affine import AffineTemplate

ONLY = np.zeros(130, np.int64)
"""The only variant, of each shape."""


@pytest.fixture(scope="module")
def true(chair: AffineTemplate) -> np.ndarray:
    """``[130, 11]``: more than one block of a hundred."""
    rng = np.random.default_rng(0)
    f = rng.uniform(chair.low, chair.high, (130, 8))
    return np.hstack([f, rng.normal(0, 0.1, (130, 3))])


def test_perfect_answers_are_within_every_threshold(
    chair: AffineTemplate, true: np.ndarray
) -> None:
    result = recovery(chair, true, true, ONLY)
    assert result.within == result.edited == (1.0, 1.0, 1.0)
    assert not result.error.any()
    assert result.row() == "100.0 / 100.0 / 100.0"


def test_a_shift_moves_every_vertex_alike(chair: AffineTemplate, true: np.ndarray) -> None:
    assert THRESHOLDS == (0.01, 0.02, 0.03)
    shifted = true + np.array([0] * 8 + [0.009, 0.012, 0.0])
    result = recovery(chair, shifted, true, ONLY)
    assert result.within == result.edited == (0.0, 1.0, 1.0)
    assert not result.error.any()
    assert result.row() == "0.0 / 100.0 / 100.0"


def test_shares_are_those_of_the_vertices_counted_one_by_one(
    chair: AffineTemplate, true: np.ndarray
) -> None:
    predicted = true + np.random.default_rng(1).normal(0, 0.02, true.shape)
    result = recovery(chair, predicted, true, ONLY, seed=3)
    factors = np.exp(np.random.default_rng(3).uniform(np.log(0.6), np.log(1.67), (len(true), 8)))
    for edit, shares in ((np.ones_like(factors), result.within), (factors, result.edited)):
        gaps = np.concatenate([
            np.linalg.norm(chair.jacobian @ ((p - t)[:8] * e) + (p - t)[8:], axis=1)
            for p, t, e in zip(predicted, true, edit, strict=True)
        ])  # fmt: skip
        assert shares == pytest.approx([(gaps < limit).mean() for limit in THRESHOLDS], abs=1e-4)
    assert result.within != result.edited


def test_errors_are_shares_of_each_parameters_range(
    chair: AffineTemplate, true: np.ndarray
) -> None:
    error = np.zeros(11)
    error[2], error[5], error[9] = 0.05, -0.1, 3.0
    result = recovery(chair, true + error, true, ONLY)
    expected = np.zeros(8)
    expected[2] = 0.05 / np.ptp(true[:, 2])
    expected[5] = 0.10 / np.ptp(true[:, 5])
    np.testing.assert_allclose(result.error, expected, atol=1e-12)
