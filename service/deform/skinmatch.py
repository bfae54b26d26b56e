"""Which place of a fitted, posed body each point of a mesh is matched with."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from service.deform.normals import face_crosses, vertex_normals
from service.template.anatomy import JOINTS
from service.template.skinned import Body, SkinnedTemplate

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

# Opposite normals count as twice this far apart, in metres.
NORMAL = 0.1
NEIGHBOURS = 6
# Of the tree, in six dimensions: fastest so.
LEAF = 32
# Places of the resting body farther from each other than this, in metres, are different ones.
APART = 0.1
# Farther from the body than this, in metres, or turned from it by more than 60 degrees, a match
# says little.
FAR = 0.07
AGREE = 0.5
# The inner side of a sleeve faces as the far side of the other arm does: so many times as far as
# the nearest place, and this much more, in metres, is too far.
BEYOND = (1.5, 0.02)

LIMBS = tuple(
    tuple(JOINTS.index(f"{side}_{joint}") for joint in chain)
    for side in ("left", "right")
    for chain in (("elbow", "wrist", "hand"), ("hip", "knee", "ankle", "foot"))
)
"""Joints of forearms and legs; all others make up the trunk."""

LEGS = (1, 3)
LEG_JOINTS = [*LIMBS[1], *LIMBS[3]]
# What is farther from the body than this, in metres, and from the one leg no more than so many
# times as far as from the other, hangs between them.
LOOSE, BETWEEN = 0.025, 2.5


@dataclass(frozen=True)
class Match:
    """What a fitted body says of points.

    Attributes:
        values: ``[n, 24 + 3 S]`` skinning weights and shape directions at rest, in metres.
        rest: ``[n, 3]`` where the matches are on the body at rest.
        distance: ``[n]`` to the match, in metres.
        agreement: ``[n]`` cosine of the angle between the normals.
        spread: ``[n]`` distance in metres with the angle between the normals counted in.
    """

    values: Array
    rest: Array
    distance: Array
    agreement: Array
    spread: Array

    def taken(self, rows: Mask) -> Match:
        """Some of its rows."""
        return Match(*(array[rows] for array in self.arrays()))

    def replaced(self, rows: NDArray[np.int64], other: Match) -> Match:
        """With some rows replaced by those of another match."""
        copies = [array.copy() for array in self.arrays()]
        for copy, new in zip(copies, other.arrays(), strict=True):
            copy[rows] = new
        return Match(*copies)

    def arrays(self) -> tuple[Array, ...]:
        """All that it holds, in order."""
        return self.values, self.rest, self.distance, self.agreement, self.spread


@dataclass(frozen=True)
class BodySurface:
    """Places on a posed body: its vertices and the middles of its faces.

    Attributes:
        points: ``[p, 3]`` in metres from the body's translation.
        facing: ``[p, 3]`` unit normals.
        fields: ``[p, 24 + 3 S + 3]`` skinning weights, shape directions and place at rest.
        limb: ``[p]`` index into `LIMBS`, and one more for the trunk.
    """

    points: Array
    facing: Array
    fields: Array
    limb: NDArray[np.int64]

    @classmethod
    def of(cls, template: SkinnedTemplate, body: Body) -> BodySurface:
        """The surface of a fitted body."""
        vertices = (template.decode(body) - body.translation) / body.scale
        faces = template.faces
        rest = template.rest + template.shapedirs @ body.shape
        fields = np.concatenate(
            [template.weights, template.shapedirs.reshape(len(rest), -1), rest], axis=1
        )
        fields = np.concatenate([fields, fields[faces].mean(axis=1)])
        return cls(
            points=np.concatenate([vertices, vertices[faces].mean(axis=1)]),
            facing=np.concatenate([vertex_normals(vertices, faces), face_normals(vertices, faces)]),
            fields=fields,
            limb=limbs_of(fields),
        )

    def match(self, x: Array, normals: Array, within: Mask | None = None) -> Match:
        """Match points with the nearest places that face the same way.

        Args:
            x: ``[n, 3]`` points in the frame of `points`.
            normals: ``[n, 3]`` theirs, zero where there is none.
            within: ``[p]`` places to choose from; by default all.
        """
        chosen = slice(None) if within is None else within
        points, facing, fields = self.points[chosen], self.facing[chosen], self.fields[chosen]
        tree = cKDTree(np.concatenate([points, NORMAL * facing], axis=1), leafsize=LEAF)
        spread, index = tree.query(
            np.concatenate([x, NORMAL * normals], axis=1),
            k=range(1, min(NEIGHBOURS, len(points)) + 1),
        )
        # The farthest counts nothing: matches pass over into each other without a jump.
        share = 1.0 / (spread**2 + 1e-5)
        share -= 0.999 * share[:, -1:]
        # Nor does what is near only in this pose.
        apart = np.linalg.norm(fields[index, -3:] - fields[index[:, :1], -3:], axis=2)
        share = np.where(apart < APART, share, 0.0)
        share /= share.sum(axis=1, keepdims=True)
        rows = np.arange(0, index.size + 1, index.shape[1])
        mean = csr_array((share.ravel(), index.ravel(), rows), shape=(len(x), len(points)))
        means = mean @ fields
        return Match(
            values=means[:, :-3],
            rest=means[:, -3:],
            distance=np.linalg.norm(mean @ points - x, axis=1),
            agreement=np.einsum("nc,nc->n", mean @ facing, normals),
            spread=spread[:, 0],
        )

    def sound(self, x: Array, match: Match) -> Mask:
        """``[n]`` which matches of ``x [n, 3]`` are near and face the same way."""
        sound: Mask = (match.distance < FAR) & (match.agreement > AGREE)
        doubtful = np.flatnonzero(sound & (match.distance > BEYOND[1]))
        nearest = cKDTree(self.points).query(x[doubtful])[0]
        sound[doubtful] = match.distance[doubtful] < BEYOND[0] * nearest + BEYOND[1]
        return sound

    def between_legs(self, x: Array, match: Match) -> Mask:
        """``[n]`` which of ``x [n, 3]`` are clear of the body and not much nearer to one leg than
        to the other."""
        between = match.distance > LOOSE
        rows = np.flatnonzero(between & (match.values[:, LEG_JOINTS].sum(axis=1) > 0.2))
        between[:] = False
        left, right = (cKDTree(self.points[self.limb == limb]).query(x[rows])[0] for limb in LEGS)
        other = np.maximum(left, right)
        between[rows] = other < BETWEEN * np.maximum(np.minimum(left, right), match.distance[rows])
        return between

    def outward(self, x: Array, normals: Array) -> Array:
        """The normals ``[n, 3]`` of a mesh, turned if its faces turn the other way than the body's.

        Where they turn both ways, each is turned to agree with the nearest place of the body.
        """
        tree = cKDTree(self.points)
        pick = slice(None, None, max(1, len(x) // 2000))
        nearest = tree.query(x[pick])[1]
        cosine = np.einsum("nc,nc->n", self.facing[nearest], normals[pick])
        against = np.mean(cosine < -AGREE)
        if against > 0.7:
            return -normals
        if against < 0.25:
            return normals
        cosine = np.einsum("nc,nc->n", self.facing[tree.query(x)[1]], normals)
        return np.where(cosine[:, None] < 0.0, -normals, normals)


def limbs_of(values: Array) -> NDArray[np.int64]:
    """``[n]`` index into `LIMBS`, and one more for the trunk, of whose rows begin with weights."""
    joint = values[:, : len(JOINTS)].argmax(axis=1)
    limb = np.full(len(values), len(LIMBS))
    for index, joints in enumerate(LIMBS):
        limb[np.isin(joint, joints)] = index
    return limb


def face_normals(x: Array, faces: NDArray[np.int64]) -> Array:
    """``[m, 3]`` unit normals of faces."""
    crosses = face_crosses(x, faces)
    length = np.linalg.norm(crosses, axis=1, keepdims=True)
    return crosses / np.where(length > 0.0, length, 1.0)
