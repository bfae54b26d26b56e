"""A cage around the mesh, moved so as to come as near to the true edit as it can.

The bound for whatever learns to move such a cage (Yifan et al., Neural Cages, 2020): the sphere of
42 vertices that it starts from, mean value coordinates, and least squares in place of a network.
Where no true edit is known, as between two shapes, it is drawn to the target's nearest points.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import trimesh
from scipy.spatial import cKDTree

from model_export.rivals.subject import Array, Edit, Editor, Faces, Outcome, Subject
from service.mesh.surface import sample_surface

ROOM = 1.15
"""How much larger than the ellipsoid about the bounding box's corners the cage is."""
BLOCK = 4096
CALM = 1e-4
"""Least singular value, as a share of the largest, that the pull of nearest points follows."""
ROUNDS, SAMPLES = 30, 3000


@dataclass(frozen=True)
class Cage:
    """42 points about a mesh.

    Attributes:
        corners: ``[42, 3]``.
        weights: ``[V, 42]`` of the mesh's vertices: ``weights @ corners`` is where they are.
    """

    corners: Array
    weights: Array

    @classmethod
    def about(cls, vertices: Array) -> Cage:
        """A sphere stretched about the bounding box of ``vertices [V, 3]``."""
        sphere = trimesh.creation.icosphere(subdivisions=1)
        low, high = vertices.min(axis=0), vertices.max(axis=0)
        half = np.sqrt(3) * ROOM * np.maximum((high - low) / 2, 1e-3 * (high - low).max())
        corners = (low + high) / 2 + sphere.vertices * half
        return cls(corners, mean_value_coordinates(vertices, corners, np.asarray(sphere.faces)))

    def drawn_to(self, faces: Faces, start: Array, target: Array) -> list[Array]:
        """``[V, 3]`` the mesh after each round of pulling its surface to another, both ways.

        In each round points of the surface are to go to the nearest ones of the target, and the
        target's nearest ones to the target; the corners move so in least squares.

        Args:
            faces: ``[F, 3]`` of the mesh.
            start: ``[3]`` and ``[3]`` as rows: factors of the axes and a shift after them, to
                begin with.
            target: ``[n, 3]`` points of the other surface.
        """
        corners = self.corners * start[0] + start[1]
        tree, rounds = cKDTree(target), [self.weights @ corners]
        drawn = sample_surface(rounds[0], faces, SAMPLES, np.random.default_rng(0))
        share, ends = drawn.barycentric[:, :, None], faces[drawn.faces]
        weights = (share * self.weights[ends]).sum(axis=1)
        for _ in range(ROUNDS):
            points = weights @ corners
            _, there = tree.query(points)
            _, back = cKDTree(points).query(target)
            rows = np.concatenate([weights / len(points), weights[back] / len(target)])
            off = np.concatenate([
                (target[there] - points) / len(points), (target - points[back]) / len(target)
            ])  # fmt: skip
            corners = corners + _least(rows, off, CALM)
            rounds.append(self.weights @ corners)
        return rounds


def _least(rows: Array, values: Array, calm: float) -> Array:
    """Least squares by the normal equations, a fraction of the time of a decomposition of all
    rows."""
    size, axes = np.linalg.eigh(rows.T @ rows)
    kept = axes[:, size > calm**2 * size[-1]]
    solved: Array = kept @ ((kept.T @ (rows.T @ values)) / size[size > calm**2 * size[-1], None])
    return solved


def caged(subject: Subject) -> Editor:
    """The best that a cage of 42 vertices does."""
    weights = Cage.about(subject.vertices).weights

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
