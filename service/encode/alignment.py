"""The closest fit of corresponding points, once for numpy and torch."""

from __future__ import annotations

from typing import Any

from service.template.skinning import library


def align(points: Any, targets: Any, weights: Any) -> tuple[Any, Any, Any]:
    """The rotation, scale and place that take points nearest to others (Umeyama 1991).

    Args:
        points: ``[..., n, 3]``.
        targets: ``[n, 3]``.
        weights: ``[n]`` of the pairs.

    Returns:
        ``[..., 3, 3]`` rotation, ``[...]`` scale and ``[..., 3]`` shift, so that
        ``scale * (rotation @ point) + shift`` is near the target.
    """
    xp = library(points)
    share = (weights / weights.sum())[:, None]
    center, target = (share * points).sum(-2), (share * targets).sum(-2)
    away, there = points - center[..., None, :], targets - target
    covariance = (share * there).swapaxes(-1, -2) @ away
    left, values, right = xp.linalg.svd(covariance)
    # No mirroring: the least axis is turned back where it would be.
    sign = xp.sign(xp.linalg.det(left) * xp.linalg.det(right))
    last = left[..., :, 2:] * sign[..., None, None]
    rotation = left[..., :, :2] @ right[..., :2, :] + last @ right[..., 2:, :]
    spread = (share * away * away).sum((-1, -2))
    total = values[..., 0] + values[..., 1] + sign * values[..., 2]
    scale = total / spread
    shift = target - scale[..., None] * (rotation @ center[..., None])[..., 0]
    return rotation, scale, shift
