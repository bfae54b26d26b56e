"""Variants of a generated set: how long they take, and what memory.

.venv/bin/python -m tests.load.augmentation --sources 200 --count 20
"""

from __future__ import annotations

import argparse
import resource
import tempfile
import time
from pathlib import Path

import trimesh

from model_export.detailed import detailed_chair
from service.augment.driver import augment
from service.requests import InferOptions

WANTED = (4_000, 7_000)
"""Vertices of a shape of the set."""


def write_set(folder: Path, sources: int) -> int:
    """Detailed chairs of some 5,000 vertices as GLB; how many vertices they have together."""
    seed = total = 0
    for index in range(sources):
        while True:
            shape = detailed_chair(seed, 2 + seed % 2)
            seed += 1
            vertices = shape.mesh(shape.parameters)
            if WANTED[0] <= len(vertices) <= WANTED[1]:
                break
        mesh = trimesh.Trimesh(vertices, shape.faces, process=False)
        (folder / f"chair-{index:04d}.glb").write_bytes(mesh.export(file_type="glb"))
        total += len(vertices)
    return total


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sources", type=int, default=200)
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--category", default="auto")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        meshes, out = Path(folder, "meshes"), Path(folder, "out")
        meshes.mkdir()
        vertices = write_set(meshes, arguments.sources)
        print(f"{arguments.sources} shapes of {vertices // arguments.sources} vertices")
        before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
        summary = augment(
            meshes,
            out,
            arguments.count,
            infer=InferOptions(category=arguments.category),
            workers=arguments.workers,
        )
        took, after = time.monotonic() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
        cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        print(summary)
        print(
            f"{took:.1f} s, {cpu:.1f} CPU-s, a worker's peak {after.ru_maxrss / 1024:.0f} MiB, "
            f"{sum(1 for _ in out.rglob('*.glb'))} files"
        )


if __name__ == "__main__":
    main()
