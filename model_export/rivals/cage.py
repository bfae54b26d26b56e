"""A cage around the mesh, moved so as to come as near to the true edit as it can.

The bound for whatever learns to move such a cage (Yifan et al., Neural Cages, 2020): the sphere of
42 vertices that it starts from, mean value coordinates, and least squares in place of a network.
"""

from __future__ import annotations

import numpy as np
import trimesh

from model_export.rivals.subject import Array, Edit, Editor, Faces, Outcome, Subject

ROOM = 1.15
"""How much larger than the ellipsoid about the bounding box's corners the cage is."""
BLOCK = 4096


def caged(subject: Subject) -> Editor:
    """The best that a cage of 42 vertices does."""
    sphere = trimesh.creation.icosphere(subdivisions=1)
    low, high = subject.vertices.min(axis=0), subject.vertices.max(axis=0)
    half = np.sqrt(3) * ROOM * np.maximum((high - low) / 2, 1e-3)
    cage = (low + high) / 2 + sphere.vertices * half
    weights = mean_value_coordinates(subject.vertices, cage, np.asarray(sphere.faces))

    def edit(change: Edit) -> Outcome:
        if change.truth is None:
            raise ValueError("a cage is fitted to the true edit")
        moved, *_ = np.linalg.lstsq(weights, change.truth - subject.vertices, rcond=1e-9)
        return Outcome(subject.vertices + weights @ moved)

    return edit


def mean_value_coordinates(points: Array, cage: Array, faces: Faces) -> Array:
    """``[n, m]`` weights of a closed cage's vertices at points within it, one in sum.

    Ju, Schaefer and Warren, Mean value coordinates for closed triangular meshes, 2005; points on
    the cage itself are not treated.
    """
    blocks = [
        _coordinates(points[start : start + BLOCK], cage, faces)
        for start in range(0, len(points), BLOCK)
    ]
    return np.concatenate(blocks)


def _coordinates(points: Array, cage: Array, faces: Faces) -> Array:
    offset = cage[None] - points[:, None]
    distance = np.linalg.norm(offset, axis=2)
    unit = (offset / distance[..., None])[:, faces]
    # Sides of the spherical triangles, and half their sum.
    chord = np.linalg.norm(np.roll(unit, -1, axis=2) - np.roll(unit, -2, axis=2), axis=3)
    theta = 2.0 * np.arcsin(np.clip(chord / 2.0, 0.0, 1.0))
    half = theta.sum(axis=2, keepdims=True) / 2.0
    following, before = np.roll(theta, -1, axis=2), np.roll(theta, -2, axis=2)
    sines = np.sin(following) * np.sin(before)
    cosine = np.clip(2.0 * np.sin(half) * np.sin(half - theta) / sines - 1.0, -1.0, 1.0)
    sign = np.sign(np.linalg.det(unit))[..., None]
    sine = sign * np.sqrt(1.0 - cosine**2)
    weight = theta - np.roll(cosine, -1, axis=2) * before - np.roll(cosine, -2, axis=2) * following
    below = 2.0 * distance[:, faces] * np.sin(following) * np.roll(sine, -2, axis=2)
    # A triangle seen edge on adds nothing.
    seen = np.abs(sine).min(axis=2, keepdims=True) > 1e-9
    weight = np.where(seen, weight / np.where(seen, below, 1.0), 0.0)
    summed = np.zeros((len(points), len(cage)))
    for corner in range(3):
        for face in range(len(faces)):
            summed[:, faces[face, corner]] += weight[:, face, corner]
    return summed / summed.sum(axis=1, keepdims=True)
