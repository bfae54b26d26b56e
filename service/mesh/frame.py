"""Axis-aligned orientations: from the upload's own axes to the canonical ones and back.

Canonical: right-handed, +Y up, +Z front (glTF's convention).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from service.errors import InvalidRequest

AXES: dict[str, tuple[int, int, int]] = {
    "+x": (1, 0, 0),
    "-x": (-1, 0, 0),
    "+y": (0, 1, 0),
    "-y": (0, -1, 0),
    "+z": (0, 0, 1),
    "-z": (0, 0, -1),
}
AUTO = "auto"


@dataclass(frozen=True)
class Orientation:
    """Which of the upload's axes point up and to the front."""

    up: str
    front: str

    @property
    def rotation(self) -> NDArray[np.float64]:
        """``[3, 3]``; ``canonical = rotation @ own``, so ``points @ rotation.T`` for rows."""
        up, front = np.array(AXES[self.up]), np.array(AXES[self.front])
        return np.stack([np.cross(up, front), up, front]).astype(np.float64)

    def to_canonical(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Points ``[n, 3]`` of the upload's own axes in the canonical ones."""
        axes, signs = _columns(self.rotation)
        return points if self == CANONICAL else points[:, axes] * signs

    def to_own(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Back from the canonical axes; zeros stay zeros."""
        axes, signs = _columns(self.rotation.T)
        return points if self == CANONICAL else points[:, axes] * signs

    def maps_to_own(self, maps: NDArray[np.floating]) -> NDArray[np.floating]:
        """Linear maps ``[n, 3, 3]`` of canonical space in the upload's own axes."""
        axes, signs = _columns(self.rotation.T)
        if self == CANONICAL:
            return maps
        return maps[:, axes][:, :, axes] * np.outer(signs, signs).astype(maps.dtype)


def _columns(rotation: NDArray[np.float64]) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """For a signed permutation: which column each row picks, and its sign."""
    axes = np.abs(rotation).argmax(axis=1)
    return axes, rotation[np.arange(3), axes]


CANONICAL = Orientation("+y", "+z")


def orientations(up: str = AUTO, front: str = AUTO) -> list[Orientation]:
    """The orientations that agree with what is known, the canonical one first.

    Args:
        up, front: an axis such as ``"+z"``, or ``"auto"``.

    Raises:
        InvalidRequest: for an unknown axis, or when both lie along the same line.
    """
    for option, axis in (("up", up), ("front", front)):
        if axis != AUTO and axis not in AXES:
            raise InvalidRequest(
                f"unknown_{option}",
                f"{option}={axis!r} is no axis",
                f"Use one of {', '.join(AXES)}, or auto.",
            )
    found = [
        Orientation(u, f)
        for u in (AXES if up == AUTO else [up])
        for f in (AXES if front == AUTO else [front])
        if u[1] != f[1]
    ]
    if not found:
        raise InvalidRequest(
            "parallel_axes",
            f"up={up} and front={front} lie along the same line",
            "Name two axes at right angles, or leave one on auto.",
        )
    return sorted(found, key=lambda orientation: orientation != CANONICAL)
