"""Edits of bodies: angles turn what hangs on the joints, coefficients change the shape."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from service.bodyconstraints import STATURE, TALLER, constrain
from service.bodyinference import PARAMETER_UNITS, BodyInference
from service.constraints import NONE, Interval
from service.edited import Measured, Moved, Shift
from service.edits import Change
from service.encode.bodymodel import SPREAD, stature
from service.errors import InvalidRequest
from service.namedentries import require_known
from service.requests import EditOptions
from service.stages import stage
from service.template.anatomy import JOINTS, limits
from service.template.skinned import NAMES, SHAPES, Body, SkinnedTemplate

Array = NDArray[np.float64]

ANGLES = 3 * len(JOINTS)
"""Parameters that are angles; the shape coefficients come behind them."""


def move(
    found: BodyInference,
    edits: Mapping[str, Change],
    options: EditOptions,
    keep: str,
    constraints: Mapping[str, Interval] = NONE,
) -> Moved:
    """Carry out an edit.

    Args:
        found: the upload.
        edits: by parameter or derived dimension.
        options: how.
        keep: what stays in place when the shape changes: the ``pelvis``, or the ``floor`` that the
            body stands on.  A change of the pose alone leaves the pelvis where it is.
        constraints: likewise by name; what edits name stays as they have it.

    Raises:
        InvalidRequest: for an unknown name, a stature that can't be had, or constraints that
            conflict.
    """
    template, before = found.model.template, found.fit.body
    require_known(found.model.name, (*edits, *constraints), (*NAMES, STATURE))
    binding = found.skin if options.mode == "blend" else found.paper
    with stage("transfer"):
        values = _values(found, edits)
        if constraints:
            values = constrain(found, values, edits, constraints)
        after = standing(template, before, edited(before, values), keep)
        turn, scale = found.best.orientation, found.fit.normalization.scale
        moved, linear = binding.carry(before, after)
        rows = zip(NAMES, found.parameters.tolist(), values.tolist(), PARAMETER_UNITS, strict=True)
        statures = found.stature(before), found.stature(after)
        return Moved(
            found,
            [Shift(*row) for row in rows],
            [Shift(STATURE, *statures, found.unit)],
            [Measured(STATURE, *statures, found.unit, _asked(found, edits, constraints))],
            found.mesh.vertices + turn.to_own(moved / scale),
            turn.maps_to_own(linear),
            len(found.turning.flipped(moved, linear)),
            _warnings(found.parameters, values),
        )


def _values(found: BodyInference, edits: Mapping[str, Change]) -> Array:
    """``[75]`` parameters after the changes; the stature comes last."""
    values = found.parameters.copy()
    for index, name in enumerate(NAMES):
        if name in edits:
            values[index] = edits[name].apply(values[index])
    if STATURE in edits:
        if TALLER in edits:
            raise _fixed(f"{TALLER} is to be changed too", f"Leave out {TALLER} or {STATURE}.")
        now = found.stature(found.fit.body)
        target = edits[STATURE].apply(now)
        if target == now and np.array_equal(values[ANGLES:], found.parameters[ANGLES:]):
            return values
        if target <= 0.0:
            raise InvalidRequest(
                "size_not_positive",
                f"{STATURE} would be {target:.4g}",
                "Sizes must stay positive: choose a larger value.",
            )
        metres = target * found.scale / found.fit.body.scale
        values[ANGLES:] = of_stature(found.model.template, values[ANGLES:], metres)
    return values


def of_stature(template: SkinnedTemplate, shape: Array, metres: float) -> Array:
    """``[S]`` the shape with the first coefficient such that the body is so tall.

    The height is convex and piecewise linear in it, so that Newton's steps end.

    Raises:
        InvalidRequest: when the coefficient does not lead there.
    """
    shape = shape.copy()
    for _ in range(50):
        height = template.shaped(shape)[0][:, 1]
        gap = metres - np.ptp(height)
        if abs(gap) <= 1e-12 * metres:
            return shape
        rise = template.shapedirs[[height.argmax(), height.argmin()], 1, 0]
        slope = float(rise[0] - rise[1])
        if abs(slope) < 1e-6:
            break
        shape[0] += gap / slope
    if abs(stature(template, shape) - metres) <= 1e-6 * metres:
        return shape
    raise _fixed(f"{TALLER} does not lead to that height", "Choose one nearer to the present one.")


def _asked(
    found: BodyInference, edits: Mapping[str, Change], constraints: Mapping[str, Interval]
) -> Interval | None:
    """Where the stature was to lie."""
    if STATURE in constraints or STATURE not in edits:
        return constraints.get(STATURE)
    target = edits[STATURE].apply(found.stature(found.fit.body))
    return Interval(target, target)


def _fixed(fault: str, suggestion: str) -> InvalidRequest:
    return InvalidRequest("dimension_fixed", f"{STATURE} can't be changed: {fault}", suggestion)


def edited(before: Body, values: Array) -> Body:
    """The body with other parameters ``[75]``; joints whose angles stay keep their rotations."""
    old = before.parameters
    changed = (values != old)[:ANGLES].reshape(-1, 3).any(axis=1)
    rotations = before.rotations.copy()
    if changed.any():
        vectors = values[:ANGLES].reshape(-1, 3)[changed]
        rotations[changed] = Rotation.from_rotvec(vectors).as_matrix()
    return replace(before, rotations=rotations, shape=values[ANGLES:])


def standing(template: SkinnedTemplate, before: Body, after: Body, keep: str) -> Body:
    """A body of another shape, put where the one before was.

    Args:
        template: of both.
        before, after: the bodies; without a change of shape the second is answered as it is.
        keep: ``pelvis`` leaves that joint where it was; ``floor`` then raises or lowers the body so
            that the lowest point, in the pose before, is as high as it was.
    """
    if np.array_equal(before.shape, after.shape):
        return after
    hips = before.scale * (template.joint_dirs[0] @ (before.shape - after.shape))
    if keep == "floor":
        posed = replace(before, shape=after.shape, translation=before.translation + hips)
        lowest = (template.decode(body)[:, 1].min() for body in (before, posed))
        hips[1] += next(lowest) - next(lowest)
    return replace(after, translation=before.translation + hips)


def _warnings(before: Array, after: Array) -> list[str]:
    """What the edit has brought beyond where bodies are."""
    low, high = (np.append(ends.ravel(), np.full(SHAPES, sign * SPREAD))
                 for ends, sign in zip(limits(), (-1.0, 1.0), strict=True))  # fmt: skip
    inside = (before >= low) & (before <= high)
    beyond = inside & ((after < low) | (after > high))
    beyond[:3] = False  # the root turns freely
    return [
        f"{NAMES[index]} is outside of what joints can reach"
        if index < ANGLES
        else f"{NAMES[index]} is outside of what the model was trained on"
        for index in np.flatnonzero(beyond)
    ]
