"""The lean of a scan: a few degrees by which an upload stands off its axes.

Two signs of it, neither of which needs a template: what stands rests on a plane below its centre
of mass, and what is symmetric left to right has its mirror plane at x = 0.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError, cKDTree
from scipy.spatial.transform import Rotation

from service.mesh.surface import RADIUS

Array = NDArray[np.float64]

LEAST, MOST = np.radians(2.5), np.radians(30.0)
"""Smaller leans, about each axis, are within what the signs are off by; larger ones are no slight
lean."""
RESTING = 0.02 * RADIUS
"""Points this near to the resting plane settle where it is."""
PROBES = 600
"""Points that are mirrored."""
LOPSIDED = 1.35
"""A cloud is symmetric when its mirror image lies no farther from it than this many times as far
as some of its points lie from its others."""


def leans(points: Array, stands: bool) -> Iterator[Array]:
    """Rotation vectors ``[3]``, likely ones, that would straighten a cloud.

    Args:
        points: ``[n, 3]`` normalised and nearly in the canonical orientation.
        stands: shapes of the category stand on a floor.
    """
    level = resting_lean(points) if stands else np.zeros(3)
    levelled = points @ Rotation.from_rotvec(level).as_matrix().T
    turn = mirror_lean(levelled)
    if stands:
        turn = np.array([0.0, turn[1], 0.0])
    both = (Rotation.from_rotvec(turn) * Rotation.from_rotvec(level)).as_rotvec()
    tried: list[Array] = []
    for whole in (both, level, turn):
        lean = np.where(np.abs(whole) > LEAST, whole, 0.0)
        new = all(np.linalg.norm(lean - other) > LEAST / 2 for other in tried)
        if 0.0 < np.linalg.norm(lean) < MOST and new:
            tried.append(lean)
            yield lean


def resting_lean(points: Array) -> Array:
    """The rotation ``[3]`` that lays the plane that a cloud rests on level."""
    try:
        hull = ConvexHull(points)
    except QhullError:
        return np.zeros(3)
    normal, offset = hull.equations[:, :3], hull.equations[:, 3]
    center = points.mean(axis=0)
    below = normal[:, 1] < -np.cos(MOST)
    if not below.any():
        return np.zeros(3)
    # Straight below the centre the lower hull's face is the one whose plane is highest there.
    depth = (normal[below] @ center + offset[below]) / normal[below, 1]
    face = normal[below][depth.argmin()], offset[below][depth.argmin()]
    near = points[np.abs(points @ face[0] + face[1]) < RESTING]
    if np.ptp(near[:, 0]) < 5 * RESTING or np.ptp(near[:, 2]) < 5 * RESTING:
        return _to_vertical(-face[0])
    columns = np.stack([near[:, 0], near[:, 2], np.ones(len(near))], axis=1)
    slope_x, slope_z, _ = np.linalg.lstsq(columns, near[:, 1], rcond=None)[0]
    return _to_vertical(np.array([-float(slope_x), 1.0, -float(slope_z)]))


def _to_vertical(normal: Array) -> Array:
    up = normal / np.linalg.norm(normal)
    axis = np.cross(up, [0.0, 1.0, 0.0])
    length = np.linalg.norm(axis)
    lean: Array = axis * (np.arcsin(np.minimum(length, 1.0)) / np.maximum(length, 1e-300))
    return lean


def mirror_lean(points: Array) -> Array:
    """The rotation ``[3]`` that turns a cloud's mirror plane to x = 0; none without such a plane.

    The mirrored cloud is laid over the cloud itself by iterated closest points.
    """
    chosen = np.arange(0, len(points), max(2, len(points) // PROBES))
    probes, rest = points[chosen], np.delete(points, chosen, axis=0)
    tree = cKDTree(rest)
    usual = float(tree.query(probes)[0].mean())
    mirror = np.diag([-1.0, 1.0, 1.0])
    gaps, _ = tree.query(probes @ mirror)
    first = float(gaps.mean())
    if first < LOPSIDED * usual:
        return np.zeros(3)
    turn, shift = np.eye(3), np.zeros(3)
    for step in range(20):
        moved = probes @ mirror @ turn.T + shift
        gaps, index = tree.query(moved)
        kept = gaps <= np.quantile(gaps, 0.8)
        more, offset = _rigid(moved[kept], rest[index[kept]])
        turn, shift = more @ turn, more @ shift + offset
        if step > 4 and np.abs(more - np.eye(3)).max() < 1e-4:
            break
    last = float(tree.query(probes @ mirror @ turn.T + shift)[0].mean())
    if last > 0.75 * first:
        return np.zeros(3)
    # `turn @ mirror` reflects about the plane whose normal it turns round.
    values, vectors = np.linalg.eigh((turn @ mirror + (turn @ mirror).T) / 2)
    normal = vectors[:, values.argmin()]
    normal = normal * np.sign(normal[0] or 1.0)
    axis = np.cross(normal, [1.0, 0.0, 0.0])
    length = np.linalg.norm(axis)
    lean: Array = axis * (np.arcsin(np.minimum(length, 1.0)) / np.maximum(length, 1e-300))
    return lean


def _rigid(source: Array, target: Array) -> tuple[Array, Array]:
    """Rotation and shift that take points ``[n, 3]`` nearest to others (Kabsch)."""
    a, b = source.mean(axis=0), target.mean(axis=0)
    u, _, vt = np.linalg.svd((source - a).T @ (target - b))
    flip = np.diag([1.0, 1.0, np.sign(np.linalg.det(vt.T @ u.T))])
    turn = vt.T @ flip @ u.T
    return turn, b - turn @ a
