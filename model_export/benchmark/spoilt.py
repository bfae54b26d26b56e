"""Meshes as they come from scanners, converters and other hands: the disturbances of B12."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import trimesh
from numpy.typing import NDArray

from model_export.benchmark.accuracy import diagonal
from model_export.benchmark.decimation import decimated
from service.deform.normals import face_crosses
from service.mesh.convert import convert
from service.mesh.frame import CANONICAL, Orientation, orientations
from service.requests import Upload

Array = NDArray[np.float64]
Faces = NDArray[np.int64]
Mesh = tuple[Array, Faces]
Spoiler = Callable[[Array, Faces, np.random.Generator], Mesh]

SCALES = (1e-3, 1e-2, 1e-1, 1e1, 1e2, 1e3)
HOLES, HOLE = 10, 0.05
"""How many holes, and their radius over the diagonal."""
FLIPPED, STRAY, STRAY_SIZE = 0.3, 50, 0.01
"""Share of faces that are turned over; how many faces float about, and how large over the
diagonal."""
CROPPED = 0.3
NOISE = 0.01
"""Standard deviation of each coordinate over the diagonal."""
FEW, MANY = 500, 2_000_000


@dataclass(frozen=True)
class Spoilt:
    """A disturbed mesh.

    Attributes:
        kind: of disturbance.
        upload: as it is sent.
        orientation: that its own is, in the upload's axes.
        scale: its lengths over those of the clean mesh.
    """

    kind: str
    upload: Upload
    orientation: Orientation = CANONICAL
    scale: float = 1.0


def holes(vertices: Array, faces: Faces, rng: np.random.Generator) -> Mesh:
    """Without the faces near some of them."""
    centres = vertices[faces].mean(axis=1)
    kept = np.ones(len(faces), bool)
    for at in rng.choice(len(faces), HOLES):
        kept &= np.linalg.norm(centres - centres[at], axis=1) > HOLE * diagonal(vertices)
    return vertices, faces[kept] if kept.any() else faces


def flipped_and_stray(vertices: Array, faces: Faces, rng: np.random.Generator) -> Mesh:
    """Some faces inside out, and small ones afloat in the bounding box."""
    turned = np.where(rng.random(len(faces))[:, None] < FLIPPED, faces[:, ::-1], faces)
    places = rng.uniform(vertices.min(axis=0), vertices.max(axis=0), (STRAY, 1, 3))
    corners = places + STRAY_SIZE * diagonal(vertices) * rng.normal(size=(STRAY, 3, 3))
    stray = len(vertices) + np.arange(3 * STRAY).reshape(-1, 3)
    return np.concatenate([vertices, corners.reshape(-1, 3)]), np.concatenate([turned, stray])


def soup(vertices: Array, faces: Faces, rng: np.random.Generator) -> Mesh:
    """Triangles that share nothing, in any order."""
    corners = vertices[rng.permutation(faces)].reshape(-1, 3)
    return corners, np.arange(len(corners)).reshape(-1, 3)


def cropped(vertices: Array, faces: Faces, rng: np.random.Generator) -> Mesh:
    """Without the faces beyond a plane, which have that share of the area."""
    direction = rng.normal(size=3)
    height = vertices[faces].mean(axis=1) @ direction
    order = np.argsort(height)
    area = areas(vertices, faces[order])
    kept = order[np.cumsum(area) <= (1.0 - CROPPED) * area.sum()]
    used, corners = np.unique(faces[kept], return_inverse=True)
    return vertices[used], corners.reshape(-1, 3)


def areas(vertices: Array, faces: Faces) -> Array:
    """``[F]`` doubled."""
    doubled: Array = np.linalg.norm(face_crosses(vertices, faces), axis=1)
    return doubled


def noisy(vertices: Array, faces: Faces, rng: np.random.Generator) -> Mesh:
    """Every vertex a little off."""
    return vertices + NOISE * diagonal(vertices) * rng.normal(size=vertices.shape), faces


def coarse(vertices: Array, faces: Faces, rng: np.random.Generator) -> Mesh:
    """Of `FEW` vertices at most."""
    return decimated(vertices, faces, FEW)


def huge(vertices: Array, faces: Faces) -> Mesh:
    """The same surface with `MANY` vertices, or a few less: the largest faces are cut in four,
    again and again."""
    while True:
        # A face in four has three new vertices, and shares them with its neighbours at best.
        count = min(len(faces), (MANY - len(vertices)) // 3)
        if count < MANY // 1000:
            return vertices, faces
        area = areas(vertices, faces)
        largest = np.argpartition(-area, count - 1)[:count]
        vertices, faces = trimesh.remesh.subdivide(vertices, faces, face_index=largest)


SPOILERS: dict[str, Spoiler] = {
    "holes": holes,
    "flipped and stray faces": flipped_and_stray,
    "triangle soup": soup,
    "30 % cropped": cropped,
    "1 % noise": noisy,
    "500 vertices": coarse,
}


def spoilt(vertices: Array, faces: Faces, turns: int, many: bool) -> Iterator[Spoilt]:
    """Every disturbance of an upright mesh.

    Args:
        vertices: ``[V, 3]``, +Y up and +Z front.
        faces: ``[F, 3]``.
        turns: how many of the 24 orientations.
        many: whether it is also sent with `MANY` vertices.
    """
    for way in orientations()[:turns]:
        yield Spoilt("24 rotations", _upload(way.to_own(vertices), faces), way)
    for scale in SCALES:
        yield Spoilt("scale 1e-3 to 1e3", _upload(vertices * scale, faces), scale=scale)
    for kind, spoil in SPOILERS.items():
        yield Spoilt(kind, _upload(*spoil(vertices, faces, np.random.default_rng(0))))
    if many:
        yield Spoilt("2M vertices", _upload(*huge(vertices, faces)))


def _upload(vertices: Array, faces: Faces) -> Upload:
    return Upload(convert(vertices, faces, "ply"), "mesh.ply")
