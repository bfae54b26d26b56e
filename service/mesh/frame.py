"""Orientations: from the upload's own axes to the canonical ones and back.

Canonical: right-handed, +Y up, +Z front (glTF's convention).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

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
    """Which of the upload's axes point up and to the front, or nearly so.

    Attributes:
        up, front: signed axes at right angles.
        lean: rotation vector in radians, about the canonical axes, that takes what leans off these
            axes upright; none for nearly every upload.
    """

    up: str
    front: str
    lean: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def rotation(self) -> NDArray[np.float64]:
        """``[3, 3]``; ``canonical = rotation @ own``, so ``points @ rotation.T`` for rows."""
        axes = self._axes
        return Rotation.from_rotvec(self.lean).as_matrix() @ axes if any(self.lean) else axes

    @property
    def degrees(self) -> float:
        """How far the upload leans off its axes."""
        return float(np.degrees(np.linalg.norm(self.lean)))

    def leaning(self, lean: NDArray[np.float64]) -> Orientation:
        """This orientation, and a further rotation ``[3]`` about the canonical axes after it."""
        both = Rotation.from_rotvec(lean) * Rotation.from_rotvec(self.lean)
        x, y, z = both.as_rotvec().tolist()
        return replace(self, lean=(x, y, z))

    def to_canonical(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Points ``[n, 3]`` of the upload's own axes in the canonical ones."""
        if self == CANONICAL:
            return points
        if any(self.lean):
            return points @ self.rotation.T
        axes, signs = _columns(self._axes)
        return points[:, axes] * signs

    def to_own(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Back from the canonical axes; zeros stay zeros."""
        if self == CANONICAL:
            return points
        if any(self.lean):
            return points @ self.rotation
        axes, signs = _columns(self._axes.T)
        return points[:, axes] * signs

    def maps_to_own(self, maps: NDArray[np.floating]) -> NDArray[np.floating]:
        """Linear maps ``[n, 3, 3]`` of canonical space in the upload's axes; identities stay."""
        if self == CANONICAL:
            return maps
        if any(self.lean):
            turn, identity = self.rotation.astype(maps.dtype), np.eye(3, dtype=maps.dtype)
            return np.asarray(turn.T @ (maps - identity) @ turn + identity)
        axes, signs = _columns(self._axes.T)
        return maps[:, axes][:, :, axes] * np.outer(signs, signs).astype(maps.dtype)

    @property
    def _axes(self) -> NDArray[np.float64]:
        up, front = np.array(AXES[self.up]), np.array(AXES[self.front])
        return np.stack([np.cross(up, front), up, front]).astype(np.float64)


def _columns(rotation: NDArray[np.float64]) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """For a signed permutation: which column each row picks, and its sign."""
    axes = np.abs(rotation).argmax(axis=1)
    return axes, rotation[np.arange(3), axes]


CANONICAL = Orientation("+y", "+z")


def orientations(up: str = AUTO, front: str = AUTO) -> list[Orientation]:
    """The axis-aligned orientations that agree with what is known, the canonical one first.

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
