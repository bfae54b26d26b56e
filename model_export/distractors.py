"""Shapes that are not of a category, for a discriminator to tell from it.

Two kinds: heaps of boxes, ellipsoids and cylinders, which are made up; and the meshes of any
folder, where there is one.
"""

from __future__ import annotations

import re
import zlib
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray

from model_export.realistic import SUFFIXES
from service.errors import ShapeError
from service.mesh.formats import read_mesh
from service.mesh.surface import Samples, sample_surface

HEAP = 6
"""Most bodies in a heap."""
LARGEST_FILE = 12_000_000
"""Bytes; larger files would only take long."""


def heaps(count: int, points: int, seed: int) -> list[Samples]:
    """Samples of ``count`` random heaps of simple bodies."""
    rng = np.random.default_rng([seed, 77])
    return [sample_surface(*_heap(rng), points, rng) for _ in range(count)]


def _heap(rng: np.random.Generator) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    bodies = [_body(rng) for _ in range(rng.integers(1, HEAP + 1))]
    for body in bodies:
        body.apply_translation(0.4 * (len(bodies) > 1) * rng.standard_normal(3))
    heap = trimesh.util.concatenate(bodies)
    return np.asarray(heap.vertices, np.float64), np.asarray(heap.faces, np.int64)


def _body(rng: np.random.Generator) -> trimesh.Trimesh:
    kind = rng.integers(3)
    if kind == 0:
        body = trimesh.creation.icosphere(subdivisions=2)
    elif kind == 1:
        body = trimesh.creation.box()
    else:
        body = trimesh.creation.cylinder(radius=0.5, height=1.0, sections=24)
    body.apply_scale(0.4 * np.exp(0.7 * rng.standard_normal(3)))
    if rng.random() < 0.4:
        body.apply_transform(trimesh.transformations.random_rotation_matrix(rng.random(3)))
    return body


def other_shapes(
    folders: Sequence[Path], but: str | None, points: int, held_out: bool
) -> list[Samples]:
    """Samples of the meshes below some folders.

    Args:
        folders: of meshes in any orientation; files that can't be read are left out.
        but: regular expression; files whose path it is found in are of the category itself.
        points: samples a shape.
        held_out: the fifth kept for measuring (by a hash of the file's name), or the rest.
    """
    found = []
    for folder in folders:
        for path in sorted(folder.rglob("*")):
            name = str(path.relative_to(folder))
            wanted = path.suffix.lower() in SUFFIXES and not (but and re.search(but, name, re.I))
            if not wanted or (zlib.crc32(name.encode()) % 5 == 0) is not held_out:
                continue
            if path.stat().st_size > LARGEST_FILE:
                continue
            try:
                mesh = read_mesh(path.read_bytes(), path.name)
            except ShapeError:
                continue
            rng = np.random.default_rng(zlib.crc32(name.encode()))
            found.append(sample_surface(mesh.vertices, mesh.faces, points, rng))
    return found
