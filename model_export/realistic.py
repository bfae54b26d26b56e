"""Unlabelled real shapes: any folder of meshes, sampled once and cached (section 4.1).

``python -m model_export.realistic DIR --out FILE`` writes those to train on to a file, for a
machine that lacks the meshes.
"""

from __future__ import annotations

import argparse
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
CLOUDS_SUFFIX = ".npz"
STEPS = 32767
"""Of a coordinate from 0 to 1 in a file of clouds."""
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
        source: Path,
        cache: Path,
        seed: int,
        held_out: bool = False,
        noise: float = 0.005,
        device: torch.device | str = "cpu",
    ) -> None:
        """
        Args:
            source: folder of meshes, see `find_shapes`; or a file that `write_clouds` wrote.
            cache: folder for sampled clouds.
            seed: of the order and of the points drawn.
            held_out: the test fifth instead of the training part.
            noise: largest standard deviation of point noise, as a share of the radius.
            device: where the clouds live.
        """
        self.device = torch.device(device)
        self.noise = noise
        self.seed, self.drawn = seed, 0
        self.generator = torch.Generator(self.device).manual_seed(seed)
        self.names: list[str] = []
        self.skipped: list[str] = []
        if source.suffix == CLOUDS_SUFFIX:
            self.names, clouds = read_clouds(source)
        else:
            clouds = self._sample(source, cache, held_out)
        if not len(clouds):
            raise ValueError(f"no readable mesh on this side of the split in {source}")
        self.clouds = torch.as_tensor(clouds, device=device)

    def _sample(self, folder: Path, cache: Path, held_out: bool) -> np.ndarray:
        """``[k, 8192, 3]`` float32 clouds of one side, within -1 and 1."""
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
        return np.array(clouds, dtype=np.float32)

    def __len__(self) -> int:
        return len(self.names)

    def reseed(self, seed: int, drawn: int) -> None:
        """Draw from a seed on, as one goes on that has drawn so many clouds."""
        self.drawn = drawn
        self.generator.manual_seed(seed)

    def _next(self, count: int) -> np.ndarray:
        """``[count]`` shapes that come next: each once in a round, each round in another order."""
        size = len(self)
        rounds = range(self.drawn // size, (self.drawn + count - 1) // size + 1)
        orders = [np.random.default_rng([self.seed, index]).permutation(size) for index in rounds]
        first = self.drawn % size
        self.drawn += count
        return np.concatenate(orders)[first : first + count]

    def batch(self, count: int, points: int) -> Tensor:
        """``[count, points, 3]`` normalised clouds: another draw of points each time.

        Half of them are mirrored left to right, which an object of these categories survives.
        """
        chosen = torch.as_tensor(self._next(count), device=self.device)
        settings = {"generator": self.generator, "device": self.device}
        pick = torch.randint(CLOUD_SIZE, (count, points), **settings)
        clouds = self.clouds[chosen[:, None], pick]
        mirrored = torch.rand(count, 1, **settings) < 0.5
        clouds[..., 0] *= torch.where(mirrored, -1.0, 1.0)
        sigma = self.noise * torch.rand(count, 1, 1, **settings) ** 2
        extent = clouds.norm(dim=2).amax(1)[:, None, None]
        jitter = sigma * extent * torch.randn(clouds.shape, **settings)
        return normalise(clouds + jitter)


def normalise(clouds: Tensor) -> Tensor:
    """Zero mean, farthest point at radius 0.6, for ``[B, n, 3]``."""
    centred = clouds - clouds.mean(dim=1, keepdim=True)
    return centred * (RADIUS / centred.norm(dim=2).amax(dim=1))[:, None, None]


def write_clouds(shapes: RealisticShapes, path: Path) -> None:
    """Write the clouds to a file, to a 32767th of each's extent."""
    numbers = np.rint(shapes.clouds.cpu().numpy() * STEPS).astype(np.int16)
    np.savez_compressed(path, names=np.array(shapes.names), clouds=numbers)


def read_clouds(path: Path) -> tuple[list[str], np.ndarray]:
    """Names and ``[k, 8192, 3]`` float32 clouds of a file that `write_clouds` wrote."""
    with np.load(path) as file:
        return file["names"].tolist(), file["clouds"].astype(np.float32) / STEPS


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m model_export.realistic", description=__doc__)
    parser.add_argument("realistic", type=Path, help="folder of unlabelled real meshes")
    parser.add_argument("--out", type=Path, required=True, help=f"the file, {CLOUDS_SUFFIX}")
    parser.add_argument("--cache", type=Path, default=Path("cache"), help="for sampled clouds")
    arguments = parser.parse_args()
    shapes = RealisticShapes(arguments.realistic, arguments.cache, 0)
    write_clouds(shapes, arguments.out)
    print(f"wrote {len(shapes)} shapes to train on, {len(shapes.skipped)} unreadable")


if __name__ == "__main__":
    main()
