"""A body fitted to a rigged character whose joints are known, to compare transfers with."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.spatial import cKDTree

from service.deform.normals import vertex_normals
from service.encode.bodymodel import BodyModel
from service.mesh.surface import sample_surface
from service.template.anatomy import JOINTS
from service.template.skinned import Body, SkinnedTemplate, body_of

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Fit = Callable[[Array, Index, Array], Body]
"""From vertices, faces and joints ``[24, 3]``, not a number where unknown, to the fitted body."""

# Standard deviations of joints from the rig's, which are defined otherwise, and of surfaces, which
# wear clothes, in metres; points that are looked at, and rounds of matching them.
JOINT, SURFACE = 0.03, 0.01
POINTS, ROUNDS = 1500, 4
# Matches farther than this, in metres, don't count.
FAR = 0.07


def fit_joints(template: SkinnedTemplate) -> Fit:
    """A fit that is told the joints: first to them, then to the surface beside them."""
    return lambda vertices, faces, joints: _fit(template, vertices, faces, joints)


def served_fit(model: BodyModel) -> Fit:
    """The service's own fit, which sees the surface alone."""

    def fit(vertices: Array, faces: Index, joints: Array) -> Body:
        samples = sample_surface(vertices, faces, model.points, np.random.default_rng(0))
        found = model.estimate(samples, refined=True)
        frame = found.normalization
        # Back from the normalised frame: places are scaled by 1 / s about its centre.
        return replace(
            found.body,
            scale=found.body.scale / frame.scale,
            translation=found.body.translation / frame.scale + frame.center,
        )

    return fit


def _fit(template: SkinnedTemplate, vertices: Array, faces: Index, joints: Array) -> Body:
    unit = _metre(joints)
    known = np.isfinite(joints[:, 0])
    normals = vertex_normals(vertices, faces)
    pick = np.random.default_rng(0).permutation(len(vertices))[:POINTS]

    def body(x: Array) -> Body:
        return body_of(x[:72].reshape(24, 3), x[72:75], float(np.exp(x[75])), unit * x[76:])

    def priors(x: Array) -> Array:
        off = (template.posed_joints(body(x)) - joints)[known].ravel() / unit
        return np.concatenate([off / JOINT, 0.15 * x[3:72], x[72:75]])

    start = joints[0] / unit - template.joints[0]
    x = np.concatenate([np.zeros(75), [np.log(unit)], start])
    x = least_squares(priors, x, max_nfev=30).x
    for _ in range(ROUNDS):
        surface = template.decode(body(x))
        facing = vertex_normals(surface, template.faces)
        tree = cKDTree(np.hstack([surface, 0.1 * unit * facing]))
        nearest = tree.query(np.hstack([vertices[pick], 0.1 * unit * normals[pick]]))[1]
        off = np.linalg.norm(surface[nearest] - vertices[pick], axis=1)
        along = np.einsum("nc,nc->n", facing[nearest], normals[pick])
        sound = (off < FAR * unit) & (along > 0.5)
        index, points = nearest[sound], vertices[pick[sound]]
        part, direction = _part(template, index), facing[index]

        def residuals(
            x: Array,
            part: SkinnedTemplate = part,
            points: Array = points,
            direction: Array = direction,
        ) -> Array:
            off = np.einsum("nc,nc->n", part.decode(body(x)) - points, direction)
            off /= SURFACE * unit
            robust = np.sign(off) * np.sqrt(2.0 * (np.sqrt(1.0 + off**2) - 1.0))
            return np.concatenate([priors(x), 0.25 * robust])

        x = least_squares(residuals, x, max_nfev=6).x
    return body(x)


def _part(template: SkinnedTemplate, index: Index) -> SkinnedTemplate:
    """The template with some of its vertices only."""
    return replace(
        template,
        rest=template.rest[index],
        shapedirs=template.shapedirs[index],
        weights=template.weights[index],
        posedirs=template.posedirs[index],
    )


def _metre(joints: Array) -> float:
    """Length of a metre at a stature of about 1.7 m, by the bones of a leg."""
    chain = [JOINTS.index(name) for name in ("left_hip", "left_knee", "left_ankle")]
    return float(np.linalg.norm(np.diff(joints[chain], axis=0), axis=1).sum() / 0.82)
