"""Unlabelled real shapes: any folder of meshes, sampled once and cached (section 4.1)."""

from __future__ import annotations

import hashlib
import json
import zlib
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from service.errors import ShapeError
from service.mesh.formats import read_mesh
from service.mesh.surface import RADIUS, sample_surface

SUFFIXES = (".glb", ".gltf", ".obj", ".ply", ".stl", ".off")
CLOUD_SIZE = 8192
GROUPS = ("near_dup_group", "family", "group", "character")
"""Entries of a manifest that shapes too much alike to be on both sides of the split share."""


@dataclass(frozen=True)
class RealisticShape:
    """A mesh file and what the manifest says of it."""

    name: str
    path: Path
    held_out: bool
    info: dict[str, object]


def find_shapes(folder: Path) -> list[RealisticShape]:
    """The meshes of a folder, canonically oriented (+Y up, +Z front).

    With a ``manifest.jsonl`` (one object a line; ``file`` is required, `GROUPS` and ``id`` are
    used) these files; without one every mesh file below the folder.
    A fifth is held out, chosen by a hash of the group: near duplicates fall on the same side.
    """
    manifest = folder / "manifest.jsonl"
    if manifest.is_file():
        lines = manifest.read_text("utf-8").splitlines()
        rows = [json.loads(line) for line in lines if line.strip()]
    else:
        paths = sorted(path for path in folder.rglob("*") if path.suffix.lower() in SUFFIXES)
        rows = [{"id": path.stem, "file": str(path.relative_to(folder))} for path in paths]
    groups = [_group(row) for row in rows]
    test = _held_out(groups)
    return [
        RealisticShape(
            name=str(row.get("id", Path(row["file"]).stem)),
            path=folder / row["file"],
            held_out=group in test,
            info=row,
        )
        for row, group in zip(rows, groups, strict=True)
    ]


def _group(row: dict[str, object]) -> str:
    """What tells near duplicates of a shape."""
    entries = (row.get(name) for name in (*GROUPS, "id", "file"))
    return str(next(entry for entry in entries if entry))


def _held_out(groups: list[str]) -> set[str]:
    """Groups that together hold a fifth of the shapes."""
    sizes = Counter(groups)
    held_out: set[str] = set()
    count = 0
    for group in sorted(sizes, key=lambda name: zlib.crc32(name.encode())):
        if count + sizes[group] > len(groups) / 5:
            break
        held_out.add(group)
        count += sizes[group]
    return held_out


def load_cloud(shape: RealisticShape, cache: Path) -> np.ndarray:
    """``[8192, 3]`` float32 area-weighted samples about their mean, cached by content.

    Raises:
        ShapeError: when the file can't be read.
    """
    data = shape.path.read_bytes()
    key = hashlib.sha256(data).hexdigest()[:20]
    cached = cache / f"{key}-{CLOUD_SIZE}.npy"
    if cached.is_file():
        return np.load(cached)
    mesh = read_mesh(data, shape.path.name)
    rng = np.random.default_rng(int(key[:8], 16))
    points = sample_surface(mesh.vertices, mesh.faces, CLOUD_SIZE, rng).points
    cloud = (points - points.mean(axis=0)).astype(np.float32)
    cache.mkdir(parents=True, exist_ok=True)
    np.save(cached, cloud)
    return cloud


class RealisticShapes:
    """Sampled clouds of one side of the 4:1 split, cycled through in random order."""

    def __init__(
        self,
        folder: Path,
        cache: Path,
        seed: int,
        held_out: bool = False,
        noise: float = 0.005,
        device: torch.device | str = "cpu",
    ) -> None:
        """
        Args:
            folder: of meshes; see `find_shapes`.
            cache: folder for sampled clouds.
            seed: of the order and of the points drawn.
            held_out: the test fifth instead of the training part.
            noise: largest standard deviation of point noise, as a share of the radius.
            device: where the clouds live.
        """
        self.device = torch.device(device)
        self.noise = noise
        self.rng = np.random.default_rng(seed)
        self.names: list[str] = []
        self.skipped: list[str] = []
        clouds: list[np.ndarray] = []
        for shape in find_shapes(folder):
            if shape.held_out is not held_out:
                continue
            try:
                cloud = load_cloud(shape, cache)
            except (ShapeError, OSError) as error:
                self.skipped.append(f"{shape.name}: {error}")
                continue
            clouds.append((cloud - cloud.mean(0)) / np.abs(cloud).max())
            self.names.append(shape.name)
        if not clouds:
            raise ValueError(f"no readable mesh on this side of the split in {folder}")
        self.clouds = torch.as_tensor(np.stack(clouds), dtype=torch.float32, device=device)
        self.order: list[int] = []  # of the shapes still to come in this round

    def __len__(self) -> int:
        return len(self.names)

    def batch(self, count: int, points: int) -> Tensor:
        """``[count, points, 3]`` normalised clouds: another draw of points each time.

        Half of them are mirrored left to right, which an object of these categories survives.
        """
        while len(self.order) < count:
            self.order.extend(self.rng.permutation(len(self)).tolist())
        chosen, self.order = self.order[:count], self.order[count:]
        pick = torch.as_tensor(self.rng.integers(0, CLOUD_SIZE, (count, points)))
        clouds = self.clouds[torch.as_tensor(chosen)[:, None], pick]
        flip = torch.as_tensor(self.rng.choice([-1.0, 1.0], (count, 1)), dtype=torch.float32)
        clouds[..., 0] *= flip.to(self.device)
        sigma = self.noise * self.rng.random((count, 1, 1)) ** 2
        jitter = sigma * self.rng.standard_normal(clouds.shape)
        extent = clouds.norm(dim=2).amax(1)[:, None, None]
        jitter = torch.as_tensor(jitter, dtype=torch.float32, device=self.device)
        return normalise(clouds + jitter * extent)


def normalise(clouds: Tensor) -> Tensor:
    """Zero mean, farthest point at radius 0.6, for ``[B, n, 3]``."""
    centred = clouds - clouds.mean(dim=1, keepdim=True)
    return centred * (RADIUS / centred.norm(dim=2).amax(dim=1))[:, None, None]
