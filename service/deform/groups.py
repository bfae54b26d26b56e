"""Parts that are mirror images of each other: the legs of a chair, the wings of an airplane."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from service.template.affine import AffineTemplate

# How far rows may differ where a follower adds to them, and still move alike: a seat that is
# narrower at the rear takes the rear legs out by less when it is widened.
ALIKE = 0.3


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
    """The parts sorted into groups, each in the order of the template; most have one member.

    Only what users change counts: rear legs that lean more than those in front are legs like them.
    """
    frames, slack = offered_rows(template), slack_rows(template)
    groups: list[list[int]] = []
    for part, frame in enumerate(frames):
        for group in groups:
            room = np.maximum(slack[group[0]], slack[part])
            if any(_alike(s * frames[group[0]], frame, room) for s in _signs()):
                group.append(part)
                break
        else:
            groups.append([part])
    return [Group(tuple(g), _partners(frames[g], slack[g].max(axis=0))) for g in groups]


def offered_rows(template: AffineTemplate) -> NDArray[np.float64]:
    """``[P, 3, 4, 1 + p]`` affine rows of the frames in the parameters that users change."""
    rows = [template.frame_base[..., None], template.frame_jacobian[..., template.public]]
    return np.concatenate(rows, axis=-1)


def slack_rows(template: AffineTemplate) -> NDArray[np.float64]:
    """By how much `offered_rows` may differ between parts that move alike: 0 but for `ALIKE` where
    what follows a parameter may have been added to its column, and taken off the constant."""
    alone = np.zeros(len(template.parameters), bool)
    guides = [p.follows for p in template.parameters]
    leaders = np.array([alone if guide is None else guide.leaders for guide in guides])
    touched = (template.frame_jacobian != 0.0) @ leaders[:, template.public]
    return ALIKE * np.concatenate([touched.any(axis=-1, keepdims=True), touched], axis=-1)


def hub_parts(template: AffineTemplate) -> NDArray[np.bool_]:
    """``[P]`` parts whose centre is the template's origin, to which all others are attached."""
    centers = np.concatenate(
        [template.frame_base[:, :, 3, None], template.frame_jacobian[:, :, 3]], axis=-1
    )
    return np.array([not center.any() for center in centers])


def _signs() -> list[NDArray[np.float64]]:
    return [np.reshape(sign, (3, 1, 1)) for sign in product((1.0, -1.0), repeat=3)]


def _alike(one: NDArray[np.float64], other: NDArray[np.float64], room: NDArray[np.float64]) -> bool:
    """Whether two frames ``[3, 4, 1 + p]`` put a box in the same place, but for some room,
    whichever way its axes point."""

    def near(a: NDArray[np.float64], b: NDArray[np.float64], k: int) -> bool:
        return bool((np.abs(a[:, k] - b[:, k]) <= room[:, k]).all())

    same = all(near(one, other, k) or near(one, -other, k) for k in range(3))
    return same and near(one, other, 3)


def _partners(frames: NDArray[np.float64], room: NDArray[np.float64]) -> dict[int, tuple[int, ...]]:
    partners: dict[int, tuple[int, ...]] = {}
    for axis in range(3):
        sign = np.ones((3, 1, 1))
        sign[axis] = -1.0
        images = [
            next((j for j, f in enumerate(frames) if _alike(sign * frame, f, room)), -1)
            for frame in frames
        ]
        if len(frames) > 1 and all(j >= 0 and j != i for i, j in enumerate(images)):
            partners[axis] = tuple(images)
    return partners
