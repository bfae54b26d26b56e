"""Parts that go back as they grow: a mesh's fin does so by its own sweep, not by the template's."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from service.deform.proximity import Boxes
from service.deform.sections import cut
from service.template.affine import AffineTemplate

Array = NDArray[np.float64]
Index = NDArray[np.int64]

LEVELS = np.linspace(-0.3, 0.45, 12)
"""Where along a part it is looked at: not at the root, where fillets are."""
FEWEST = 4
"""Levels that have to show the part for its sweep to be told."""
LEAST, MOST = 0.2, 2.2
"""A curve is of the part when it is so thick, in the part's own thickness,"""
BESIDE = 0.4
"""and no farther beside it than this share of its width on either side."""
STEEPEST = 1.5
"""Back per length; what looks steeper is something else."""


def swept(
    template: AffineTemplate, f: Array, boxes: Boxes, u: NDArray[np.float32], faces: Index
) -> AffineTemplate:
    """The template with the parts that lean as they grow leaning as the mesh does.

    What the same parameter carries along that way, such as a T-tail, goes with them.

    Args:
        template: at ``f [d]`` it stays what it is.
        boxes: of its parts there.
        u: ``[n, P, 3]`` unit coordinates of the mesh.
        faces: ``[F, 3]``.
    """
    for part, run in enumerate(template.run.tolist()):
        rows = template.frame_jacobian[part]
        for index in np.flatnonzero(rows[run, run] * template.public).tolist():
            for axis in np.flatnonzero(rows[:, run, index]).tolist():
                if axis == run:
                    continue
                slope = _slope(boxes, part, run, axis, u[:, part], faces)
                if slope is not None:
                    template = _leaning(template, f, part, axis, index, slope)
    return template


def _leaning(
    template: AffineTemplate, f: Array, part: int, axis: int, index: int, slope: float
) -> AffineTemplate:
    """With a part that goes along `axis` by ``slope`` times what a parameter makes it longer, from
    its root on; all else that the parameter moves along that axis goes with it in proportion."""
    run = int(template.run[part])
    jacobian, base = template.frame_jacobian.copy(), template.frame_base.copy()
    tip = jacobian[part, :, 3, index] + 0.5 * jacobian[part, :, run, index]
    jacobian[:, axis, :, index] *= slope * tip[run] / tip[axis]
    jacobian[part, axis, [run, 3], index] = slope * jacobian[part, run, [run, 3], index]
    base[:, axis] += (template.frame_jacobian - jacobian)[:, axis, :, index] * f[index]
    return replace(template, frame_base=base, frame_jacobian=jacobian)


def _slope(
    boxes: Boxes, part: int, run: int, axis: int, u: NDArray[np.float32], faces: Index
) -> float | None:
    """How far the middle of a part lies along `axis`, per length along its run; None where the
    mesh doesn't show it."""
    (thick,) = (other for other in range(3) if other not in (run, axis))
    near = np.abs(u[:, run]) < 0.6
    near &= (np.abs(u[:, axis]) < 0.5 + 2 * BESIDE) & (np.abs(u[:, thick]) < MOST)
    some = faces[near[faces].all(axis=1)]
    if not len(some):
        return None
    own, of = np.unique(some, return_inverse=True)
    points = u[own].astype(np.float64)
    found = cut(points, of.reshape(-1, 3), run, LEVELS)
    low, high = np.full((found.curves, 3), np.inf), np.full((found.curves, 3), -np.inf)
    np.minimum.at(low, found.curve, found.points)
    np.maximum.at(high, found.curve, found.points)
    plane = np.zeros(found.curves, np.int64)
    plane[found.curve] = found.plane
    extent = high - low
    good = (extent[:, thick] > LEAST) & (extent[:, thick] < MOST)
    good &= (low[:, axis] > -0.5 - BESIDE) & (high[:, axis] < 0.5 + BESIDE)
    first, last = np.full(len(LEVELS), np.inf), np.full(len(LEVELS), -np.inf)
    np.minimum.at(first, plane[good], low[good, axis])
    np.maximum.at(last, plane[good], high[good, axis])
    seen = np.flatnonzero(first < last)
    if len(seen) < FEWEST:
        return None
    loft, at = boxes.lofts.get(part), LEVELS[seen]
    size = boxes.frames[part, axis, axis] + (loft.taper[axis] if loft else 0.0) * at
    middle = 0.5 * (first[seen] + last[seen]) * size + boxes.frames[part, axis, run] * at
    one, other = np.triu_indices(len(seen), 1)
    rises = (middle[other] - middle[one]) / (at[other] - at[one])
    slope = float(np.median(rises)) / float(boxes.frames[part, run, run])
    return slope if abs(slope) < STEEPEST else None
