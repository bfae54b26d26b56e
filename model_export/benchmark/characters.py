"""Dressed bodies with rigs of their own: the inputs H whose every edit is known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray

from model_export.benchmark.decimation import decimated
from model_export.poses import Poses
from model_export.rigs import Rig
from service.deform.normals import vertex_normals
from service.template.anatomy import JOINTS, PARENTS
from service.template.skinned import SHAPES, SkinnedTemplate
from service.template.skinning import pose_joints, rotation_matrices

Array = NDArray[np.float64]

CLOTH = 0.03
"""Metres that clothes stand off at most, without their folds."""
BARE = ("hand", "wrist", "head", "foot")
SEED = 10_000_019
SWAY = (0.06, 0.2, 0.06)
"""Standard deviations in radians of which way a body faces."""
COARSE = 2500
"""Vertices of every other body."""


@dataclass(frozen=True)
class Character:
    """A posed body.

    Attributes:
        name: tells it among these.
        rig: in its pose, in metres.
        turned: ``[24, 3, 3]`` rotations of its joints in space.
        stature: its height when upright.
    """

    name: str
    rig: Rig
    turned: Array
    stature: float


def characters(template: SkinnedTemplate, count: int) -> list[Character]:
    """Bodies of random pose, shape and clothes; the second of each two has few vertices."""
    poses = Poses(torch.Generator().manual_seed(SEED)).draw(count).numpy().astype(np.float64)
    return [_character(template, index, pose) for index, pose in enumerate(poses)]


def _character(template: SkinnedTemplate, index: int, rotations: Array) -> Character:
    rng = np.random.default_rng([SEED, index])
    rotations = rotations.copy()
    rotations[0] = rotation_matrices(rng.normal(size=3) * SWAY)
    naked, joints = template.shaped(rng.normal(size=SHAPES))
    points = naked + vertex_normals(naked, template.faces) * clothes(template, rng)[:, None]
    faces, weights, kind = template.faces, template.weights, "dressed"
    if index % 2:
        kept, corners = decimated(points, faces, COARSE)
        # Edges collapse into their ends: what is left are some of the vertices.
        rows = {place.tobytes(): row for row, place in enumerate(points)}
        own = np.array([rows[place.tobytes()] for place in kept])
        points, faces, weights, kind = kept, corners, weights[own], "dressed, coarse"
    turned, placed = pose_joints(rotations, joints, PARENTS)
    stature = float(np.ptp(naked[:, 1]))
    return Character(
        f"{kind} {index}", rigged(points, faces, weights, joints, turned, placed), turned, stature
    )


def clothes(template: SkinnedTemplate, rng: np.random.Generator) -> Array:
    """``[V]`` metres that clothes stand off the skin: looser here and tighter there, in folds."""
    loose = CLOTH * rng.random(len(JOINTS)) ** 2
    loose[[index for index, name in enumerate(JOINTS) if name.endswith(BARE)]] *= 0.15
    waves, phase = 12.0 * rng.normal(size=(6, 3)), rng.uniform(0.0, 2.0 * np.pi, 6)
    folds = np.sin(template.rest @ waves.T + phase).mean(axis=1)
    offset: Array = (template.weights @ loose) * (1.0 + 1.2 * folds)
    return offset


def rigged(
    points: Array, faces: NDArray[np.int64], weights: Array, joints: Array, turned: Array,
    placed: Array,
) -> Rig:  # fmt: skip
    """A mesh at rest with a rig, posed.

    Args:
        points, faces: ``[n, 3]`` and ``[m, 3]``.
        weights: ``[n, 24]``, at most four a row.
        joints: ``[24, 3]`` at rest.
        turned, placed: ``[24, 3, 3]`` and ``[24, 3]`` the same in the pose.
    """
    order = np.argsort(-weights, axis=1, kind="stable")[:, :4]
    rest, worlds = np.tile(np.eye(4), (2, len(joints), 1, 1))
    rest[:, :3, 3], worlds[:, :3, 3], worlds[:, :3, :3] = joints, placed, turned
    return Rig(
        points=points,
        faces=faces,
        bones=order,
        weights=np.take_along_axis(weights, order, axis=1),
        binds=np.linalg.inv(rest),
        node=np.arange(len(joints)),
        worlds=worlds,
        parents=np.array(PARENTS),
        joints=np.arange(len(joints)),
        convention="synthetic",
    )
