"""Scaling along the axes: the whole mesh, and slices of it."""

from __future__ import annotations

import numpy as np
from scipy.optimize import lsq_linear
from scipy.sparse import csr_array

from model_export.rivals.subject import Array, Editor, Subject, linear

APART = 1e-3
"""Knots nearer to each other than this are one."""


def axes(subject: Subject) -> np.ndarray:
    """``[d]`` the axis that each parameter moves the template along most."""
    moved: np.ndarray = np.abs(subject.template.jacobian).sum(axis=0).argmax(axis=0)
    return moved


def global_scale(subject: Subject) -> Editor:
    """What viewers offer: a thickness, height, width or depth scales all of the mesh along its
    axis, by as much as the parameter changes."""
    x = subject.vertices - subject.t
    jacobian = np.zeros((*x.shape, len(subject.f)))
    for parameter, axis in enumerate(axes(subject)):
        if subject.f[parameter]:
            jacobian[:, axis, parameter] = x[:, axis] / subject.f[parameter]
    return linear(subject, jacobian)


def nine_slice(subject: Subject) -> Editor:
    """Slices along each axis that stretch or keep their length, as of a window's frame.

    They are cut where the template's parts begin and end, and each parameter moves the cuts as is
    nearest, in least squares, to how it moves the template's vertices.
    """
    template, fitted = subject.template, subject.fitted
    jacobian = np.zeros((*subject.vertices.shape, len(subject.f)))
    for axis in range(3):
        knots = _knots(fitted[:, axis], template.part)
        if len(knots) < 2:
            continue
        hats = csr_array(_hats(fitted[:, axis], knots))
        at = _hats(subject.vertices[:, axis], knots)
        for parameter in np.flatnonzero(template.jacobian[:, axis].any(axis=0)):
            found = lsq_linear(hats, template.jacobian[:, axis, parameter], tol=1e-8)
            jacobian[:, axis, parameter] = at @ found.x
    return linear(subject, jacobian)


def _knots(x: Array, part: np.ndarray) -> Array:
    """Ascending places where parts begin and end."""
    ends = [extreme(x[part == index]) for index in np.unique(part) for extreme in (np.min, np.max)]
    ends = np.sort(ends)
    return ends[np.insert(np.diff(ends) > APART, 0, True)]


def _hats(x: Array, knots: Array) -> Array:
    """``[n, knots]`` weights of linear interpolation, constant beyond the ends."""
    return np.stack([np.interp(x, knots, row) for row in np.eye(len(knots))], axis=1)
