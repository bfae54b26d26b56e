"""What is usual for a category: distances of fits that scores go by, and how far values are off."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from model_export.realistic import RealisticShape
from model_export.truth import Judged
from service.encode.estimate import estimate
from service.encode.model import Model
from service.mesh.formats import read_mesh
from service.mesh.frame import CANONICAL
from service.mesh.surface import Samples, sample_surface

LIMIT = 95
"""Percentage of ordinary shapes that score at least a half by each measure."""
DRAWN_FARTHER, DRAWN_ODDS = 3.0, 3.0
"""How much farther real shapes lie than noise-free template shapes, and how much lower their odds
are, where there are none to see."""

FEWEST = 15
"""Measured shapes from which on errors are counted."""
WITHIN = 0.68
"""Share of errors that a standard deviation covers."""


def calibrate(
    model: Model, shapes: Sequence[RealisticShape], drawn: Sequence[Samples]
) -> dict[str, float]:
    """The card's ``calibration``.

    Args:
        model: the category; its card need not have a calibration yet.
        shapes: ordinary real shapes, canonically oriented; may be none.  Odds are taken from those
            held out, since a discriminator is too sure of what it has learned.
        drawn: samples of template shapes, for a category without real ones.
    """
    samples = [_samples(model, shape) for shape in shapes] or list(drawn)
    unseen = [s for s, shape in zip(samples, shapes, strict=False) if shape.held_out] or samples
    distances = [estimate(model, s).distance for s in samples]
    odds = [model.discriminator.odds(s.points, [CANONICAL])[0] for s in unseen]
    farther, lower = (1.0, 0.0) if shapes else (DRAWN_FARTHER, DRAWN_ODDS)
    return {
        "shapes": len(shapes),
        "limit_distance": round(farther * float(np.percentile(distances, LIMIT)), 5),
        "limit_odds": round(float(np.percentile(odds, 100 - LIMIT)) - lower, 3),
    }


def _samples(model: Model, shape: RealisticShape) -> Samples:
    mesh = read_mesh(shape.path.read_bytes(), shape.path.name)
    return sample_surface(mesh.vertices, mesh.faces, model.points, np.random.default_rng(0))


def sigma_floors(judged: Sequence[Judged]) -> dict[str, float]:
    """Least standard deviations with which `WITHIN` of the measured errors lie within sigma.

    What the fit itself claims is added to in quadrature, for what it can't know: which of several
    readings of a dimension is meant, or that the template lacks something.

    Args:
        judged: answers with claims of any floor; normalised lengths come out.
    """
    floors = {}
    for name in dict.fromkeys(name for entry in judged for name in entry.sigma):
        rows = [entry for entry in judged if name in entry.refined]
        if len(rows) < FEWEST:
            continue
        error = np.array([entry.refined[name] * entry.unit for entry in rows])
        fit = np.array([entry.fitted_sigma[name] for entry in rows])
        missing = np.sqrt(np.maximum(error**2 - fit**2, 0.0))
        floors[name] = round(float(np.quantile(missing, WITHIN)), 5)
    return floors
