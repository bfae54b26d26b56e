"""From what parts say of a mesh's vertices to its binding."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from service.deform.binding import Binding, part_stretches
from service.deform.loft import Loft
from service.deform.proximity import Array32, Boxes
from service.template.affine import AffineTemplate


def compile_binding(
    template: AffineTemplate,
    boxes: Boxes,
    weights: Array32,
    local: Array32,
    gains: Array32,
) -> Binding:
    """Compile weights and local coordinates to a Jacobian.

    Args:
        template: whose parts the mesh follows.
        boxes: the parts at the bound parameters.
        weights: ``[V, P]`` that sum to one over the parts.
        local: ``[V, P, 3]`` where each part carries the vertex, in the part's unit frame.
        gains: ``[V, P, 3]`` derivative of `local` along the part's axes; 1 inside, 0 far outside.
    """
    count = len(weights)
    coefficients = carried(template, local)
    coefficients *= weights[:, :, None]
    moves = part_moves(template)
    jacobian = coefficients.reshape(count, -1) @ moves.reshape(-1, moves.shape[2])
    tapered = {part: loft for part, loft in boxes.lofts.items() if loft.tapered}
    straight = np.setdiff1d(np.arange(weights.shape[1]), list(tapered))
    following = gains * weights[:, :, None]
    stretches = part_stretches(template, boxes.inverses)
    stretches = stretches.reshape(-1, 3, *stretches.shape[1:])[straight]
    more = [_taper_gains(loft, local[:, p], following[:, p]) for p, loft in tapered.items()]
    ways = [_taper_stretches(template, part, loft) for part, loft in tapered.items()]
    return Binding(
        jacobian=jacobian.reshape(count, 3, -1),
        gains=np.concatenate([following[:, straight].reshape(count, -1), *more], axis=1),
        stretches=np.concatenate([stretches.reshape(-1, *stretches.shape[2:]), *ways]),
    )


def carried(template: AffineTemplate, local: Array32) -> Array32:
    """``[V, P, k]`` what the coefficients of the parts' maps stand by at ``local [V, P, 3]``.

    ``[u, 1]`` for a frame, and ``u[run] u`` for a taper where any part has one.
    """
    columns = [local, np.ones_like(local[:, :, :1])]
    if _tapers(template):
        along = local[:, np.arange(local.shape[1]), template.run]
        columns.append(np.clip(along, -0.5, 0.5)[:, :, None] * local)
    return np.concatenate(columns, axis=2)


def part_moves(template: AffineTemplate) -> Array32:
    """``[P, k, 3 d]`` the same coefficients' changes a unit of each parameter; see `carried`."""
    moves = template.frame_jacobian
    if _tapers(template):
        moves = np.concatenate([moves, template.taper_jacobian], axis=2)
    turned = moves.transpose(0, 2, 1, 3).astype(np.float32)
    return turned.reshape(*turned.shape[:2], -1)


def _tapers(template: AffineTemplate) -> bool:
    return bool(template.taper_base.any() or template.taper_jacobian.any())


def _taper_gains(loft: Loft, local: Array32, gains: Array32) -> Array32:
    """``[V, 9]`` how far vertices follow a tapering part; the ways are `_taper_stretches`'s.

    With ``s`` along the run of length L, a size z across it and its taper t, the unit coordinate
    is ``u = (x - s lean) / (z + s t)``, so that its slope has a component along the run too.
    """
    gained = np.zeros((len(local), 9), np.float32)
    rows = np.flatnonzero(gains.any(axis=1))
    local, gains = local[rows], gains[rows]
    run, across = loft.run, loft.across
    s = np.clip(local[:, run], -0.5, 0.5)
    inside = np.abs(local[:, run]) <= 0.5
    beside = local[:, across]
    length, taper = np.float32(loft.length), loft.taper[across].astype(np.float32)
    leaning = (loft.lean + inside[:, None] * taper * beside) / length
    upright = gains[:, across] / loft.section(s)
    along = gains[:, run] / length
    widening = (inside * along)[:, None] * beside
    columns = [
        along[:, None],
        upright,
        -leaning * upright,
        s[:, None] * upright,
        widening - s[:, None] * leaning * upright,
    ]
    gained[rows] = np.concatenate(columns, axis=1)
    return gained


def _taper_stretches(template: AffineTemplate, part: int, loft: Loft) -> NDArray[np.float32]:
    """``[9, 9, d]`` changes of a tapering part's map: along its run, then of both sizes and of both
    tapers across it, each along its own axis and along the run."""
    run, across = loft.run, loft.across
    frame, taper = template.frame_jacobian[part], template.taper_jacobian[part]
    ways = [(frame[:, run], run)]
    for change in (frame, taper):
        ways += [(change[:, axis], axis) for axis in across]
        ways += [(change[:, axis], run) for axis in across]
    axes = np.eye(3)
    maps = [np.einsum("id,j->ijd", change, axes[axis]) for change, axis in ways]
    return np.stack(maps).reshape(len(maps), 9, -1).astype(np.float32)
