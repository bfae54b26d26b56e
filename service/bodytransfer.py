"""Transfers between bodies: the target's pose and shape, and its stature or the source's own."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from service.bodyconstraints import STATURE, TALLER
from service.bodyedit import ANGLES, of_stature
from service.bodyinference import PARAMETER_UNITS, BodyInference
from service.edited import Moved
from service.encode.bodymodel import SPREAD, stature
from service.errors import InvalidRequest
from service.requests import TransferOptions
from service.sliders import chosen
from service.template.skinned import NAMES
from service.transfer import Taken, canonical, of_target, set_to, shifted, unit_ratio

Array = NDArray[np.float64]

SHAPE = NAMES[ANGLES:]


def take(found: BodyInference, other: BodyInference, options: TransferOptions, keep: str) -> Taken:
    """What an edit of a body takes from another.

    Angles and coefficients are set to the target's.  Unless parameters are named, the stature takes
    the place of the coefficient that is for tallness: the metre of a fitted body is only nearly
    that of its file, so that the coefficient alone would miss the stature.  With ``size=source`` a
    change of the shape keeps the source's own stature.

    Args:
        found: the source.
        other: the target.
        options: what to take; parameters and the stature may be named.
        keep: what is put where the target's is, if so.

    Raises:
        InvalidRequest: for an unknown name.
    """
    ratio = unit_ratio(found, other)
    theirs, own = _values(other, ratio), _values(found)
    wanted = chosen((*NAMES, STATURE), options.parameters, found.model.name)
    scale, warnings = 1.0, of_target(other.warnings)
    if options.size == "source":
        scale = own[STATURE] / theirs[STATURE]
        if any(name in (*SHAPE, STATURE) for name in wanted):
            wanted = [name for name in wanted if name not in (TALLER, STATURE)] + [STATURE]
    elif options.parameters is None:
        left_out = TALLER if _reaches(found, other, theirs[STATURE]) else STATURE
        wanted = [name for name in wanted if name != left_out]
        if left_out == STATURE:
            warnings.append(_missed(found, other, theirs[STATURE]))
    values = {name: theirs[name] for name in wanted}
    lengths = {name: value * scale for name, value in values.items() if name == STATURE}
    units = {name: found.unit if name == STATURE else _UNITS[name] for name in wanted}
    goal = None
    if options.position == "target":
        goal = _foothold(other, other.mesh.vertices, keep) * ratio
    return Taken(set_to({**values, **lengths}, own), values, units, scale, goal, warnings)


_UNITS = dict(zip(NAMES, PARAMETER_UNITS, strict=True))


def _values(found: BodyInference, ratio: float = 1.0) -> dict[str, float]:
    """Parameters and the stature, which is multiplied by ``ratio``, by name."""
    own = dict(zip(NAMES, found.parameters.tolist(), strict=True))
    return own | {STATURE: found.stature(found.fit.body) * ratio}


def _reaches(found: BodyInference, other: BodyInference, height: float) -> bool:
    """Whether a body of the target's shape is so tall, in the reported unit, with a coefficient
    that bodies have: of the sizes that the model knows, or as far off as the target's own."""
    shape, body = other.fit.body.shape, found.fit.body
    try:
        reached = of_stature(found.model.template, shape, height * found.scale / body.scale)
    except InvalidRequest:
        return False
    return bool(abs(reached[0]) <= max(SPREAD, abs(shape[0])))


def _missed(found: BodyInference, other: BodyInference, height: float) -> str:
    """What to say of a stature that the shape does not lead to."""
    body, shape = found.fit.body, other.fit.body.shape
    comes = stature(found.model.template, shape) * body.scale / found.scale
    return (
        f"{STATURE} comes to {comes:.4g} {found.unit}, not to the target's {height:.4g} "
        f"{found.unit}: no usual body of the source's scale is of that height, so that {TALLER} is "
        "taken in its stead; are the units right?"
    )


def place(moved: Moved, goal: Array | None, keep: str) -> Moved:
    """The edited mesh with its kept point at a goal; without one where the source's was.

    An edit of the pose leaves the pelvis where it is.  A whole pose brings its own height of the
    pelvis above the floor, so that with ``keep=floor`` it is the floor that stays.
    """
    found = moved.found
    assert isinstance(found, BodyInference)
    if goal is None:
        goal = _foothold(found, found.mesh.vertices, keep)
    return shifted(moved, goal - _foothold(found, moved.vertices, keep))


def _foothold(found: BodyInference, vertices: Array, keep: str) -> Array:
    """``[3]`` the pelvis, or the floor below it, canonical and in the reported unit; an edit leaves
    the pelvis there, but for its height when it keeps the floor."""
    fit = found.fit
    pelvis = fit.normalization.invert(found.model.template.posed_joints(fit.body)[0])
    point = pelvis * found.unit_scale
    if keep == "floor":
        point[1] = canonical(found, vertices)[:, 1].min()
    return np.asarray(point)
