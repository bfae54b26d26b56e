"""Radial basis functions from the template's points (scipy)."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import RBFInterpolator

from model_export.rivals.subject import Editor, Subject, linear

POINTS = 800
"""Of the template's, at most: solving takes their third power."""
SMOOTHING = 1e-6
"""Parts that touch move apart at one place, which no exact interpolation does."""


def radial(subject: Subject) -> Editor:
    """Thin-plate splines through the displacements of the template's points."""
    points, first = np.unique(subject.fitted.round(6), axis=0, return_index=True)
    rng = np.random.default_rng(0)
    chosen = np.sort(rng.permutation(len(points))[:POINTS])
    columns = subject.template.jacobian.reshape(len(subject.fitted), -1)[first[chosen]]
    spline = RBFInterpolator(
        points[chosen], columns, smoothing=SMOOTHING, kernel="thin_plate_spline"
    )
    moved = spline(subject.vertices)
    return linear(subject, moved.reshape(len(subject.vertices), 3, -1))
