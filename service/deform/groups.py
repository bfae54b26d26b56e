"""Parts that are mirror images of each other: the legs of a chair, the wings of an airplane."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from service.template.affine import AffineTemplate


@dataclass(frozen=True)
class Group:
    """Parts that one description mirrors into another.

    Attributes:
        members: indices of the parts.
        partners: for each axis with mirrored members, the index into `members` of each member's
            image across that axis.
    """

    members: tuple[int, ...]
    partners: dict[int, tuple[int, ...]]


def mirror_groups(template: AffineTemplate) -> list[Group]:
    """The parts sorted into groups, each in the order of the template; most have one member."""
    frames = np.concatenate([template.frame_base[..., None], template.frame_jacobian], axis=-1)
    groups: list[list[int]] = []
    for part, frame in enumerate(frames):
        for group in groups:
            if any(np.array_equal(s * frames[group[0]], frame) for s in _signs()):
                group.append(part)
                break
        else:
            groups.append([part])
    return [Group(tuple(g), _partners(frames[g])) for g in groups]


def hub_parts(template: AffineTemplate) -> NDArray[np.bool_]:
    """``[P]`` parts whose centre is the template's origin, to which all others are attached."""
    centers = np.concatenate(
        [template.frame_base[:, :, 3, None], template.frame_jacobian[:, :, 3]], axis=-1
    )
    return np.array([not center.any() for center in centers])


def _signs() -> list[NDArray[np.float64]]:
    return [np.reshape(sign, (3, 1, 1)) for sign in product((1.0, -1.0), repeat=3)]


def _partners(frames: NDArray[np.float64]) -> dict[int, tuple[int, ...]]:
    partners: dict[int, tuple[int, ...]] = {}
    for axis in range(3):
        sign = np.ones((3, 1, 1))
        sign[axis] = -1.0
        images = [
            next((j for j, f in enumerate(frames) if np.array_equal(sign * frame, f)), -1)
            for frame in frames
        ]
        if len(frames) > 1 and all(j >= 0 and j != i for i, j in enumerate(images)):
            partners[axis] = tuple(images)
    return partners
