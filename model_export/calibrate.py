"""What is usual for a category: distances of fits that scores go by, and how far values are off."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from model_export.realistic import RealisticShape
from model_export.truth import Judged
from service.encode.model import SIGMA_FLOOR, BodyModel, Model
from service.mesh.formats import read_mesh
from service.mesh.frame import CANONICAL
from service.mesh.surface import Samples, sample_surface

LIMIT = 95
"""Percentage of ordinary shapes that score at least a half by each measure."""
DRAWN_FARTHER, DRAWN_ODDS = 3.0, 3.0
"""How much farther real shapes lie than noise-free template shapes, and how much lower their odds
are, where there are none to see."""
DRESSED = 1.5
"""How much farther people in coats and skirts are from the fitted body than the real ones at hand,
who mostly come in close-fitting clothes."""

FEWEST = 15
"""Measured shapes from which on errors are counted."""
WITHIN = 0.68
"""Share of errors that a standard deviation covers."""
LEAST_SCALE = 0.05
"""A fit that leaves a parameter open says so, however good fits are for the most part."""


def calibrate(
    model: Model, shapes: Sequence[RealisticShape], drawn: Sequence[Samples]
) -> dict[str, float]:
    """The card's ``calibration``.

    Args:
        model: the category; its card need not have a calibration yet.
        shapes: ordinary real shapes, canonically oriented; may be none.  Odds are taken from those
            held out, since a discriminator is too sure of what it has learned.
        drawn: samples of template shapes, for a category without real ones.  Those of bodies, who
            come in more poses than real ones at hand, tell what their odds are in any case.
    """
    samples = [_samples(model, shape) for shape in shapes] or list(drawn)
    unseen = [s for s, shape in zip(samples, shapes, strict=False) if shape.held_out] or samples
    farther, lower = (1.0, 0.0) if shapes else (DRAWN_FARTHER, DRAWN_ODDS)
    if isinstance(model, BodyModel) and shapes:
        farther, unseen = DRESSED, [*unseen, *drawn]
    distances = [model.estimate(s, refined=True).distance for s in samples]
    odds = [model.discriminator.odds(s.points, [CANONICAL])[0] for s in unseen]
    return {
        "shapes": len(shapes),
        "limit_distance": round(farther * float(np.percentile(distances, LIMIT)), 5),
        "limit_odds": round(float(np.percentile(odds, 100 - LIMIT)) - lower, 3),
    }


def _samples(model: Model, shape: RealisticShape) -> Samples:
    mesh = read_mesh(shape.path.read_bytes(), shape.path.name)
    return sample_surface(mesh.vertices, mesh.faces, model.points, np.random.default_rng(0))


def sigma_scales(judged: Sequence[Judged]) -> dict[str, float]:
    """What to multiply a fit's standard deviations by, so that `WITHIN` of the measured errors lie
    within sigma.

    Above 1 it stands for what a fit can't know: which of several readings of a dimension is meant,
    or that the template lacks something.

    Args:
        judged: answers with claims of any scale.
    """
    scales = {}
    for name in dict.fromkeys(name for entry in judged for name in entry.sigma):
        rows = [entry for entry in judged if name in entry.refined]
        if len(rows) < FEWEST:
            continue
        error = np.array([entry.refined[name] * entry.unit for entry in rows])
        fit = np.array([entry.fitted_sigma[name] for entry in rows])
        beyond = np.sqrt(np.maximum(error**2 - SIGMA_FLOOR**2, 0.0))
        scale = np.quantile(beyond / np.maximum(fit, 1e-9), WITHIN)
        scales[name] = round(max(float(scale), LEAST_SCALE), 3)
    return scales
