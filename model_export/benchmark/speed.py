"""B10: how long each stage takes by size, and how near that is to copying the file.

``python -m model_export.benchmark.speed --out speed.md``.  Every size is measured in a process
of its own, with one thread and with two; a run on a machine that does other work says little.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from model_export.benchmark.speedtable import speed_table
from model_export.config import SHIPPED
from model_export.detailed import DetailedShape, detailed_airplane, detailed_chair
from model_export.primitives import Mesh
from service.edited import write_edited
from service.edits import Change
from service.encode.model import load_models
from service.mesh.formats import read_mesh
from service.pipeline import edit, editable, move
from service.requests import EditOptions, InferOptions, Upload
from service.stages import Record, recording

SIZES = (1_000, 10_000, 100_000, 1_000_000)
QUICK = (1_000, 10_000)
MAKERS: dict[str, Callable[..., DetailedShape]] = {
    "chair": detailed_chair,
    "airplane": detailed_airplane,
}
SEED = 0
DENSITIES = range(1, 11)
"""How finely a detailed shape may be cut before its faces are divided."""
EDITS = {1_000: 60, 10_000: 60, 100_000: 40, 1_000_000: 12}
FIRSTS = {1_000: 8, 10_000: 8, 100_000: 5, 1_000_000: 2}
"""How often each is measured, by size: edits of a bound mesh, and whole ones of a new file."""
BOUND = "edit of a bound mesh"
WHOLE = "edit of a new file"
FLOOR = "copying the file"


@dataclass(frozen=True)
class Timing:
    """Times of one stage of one size, in seconds: what half and 95 % of the runs keep to."""

    p50: float
    p95: float

    @classmethod
    def of(cls, seconds: Sequence[float]) -> Timing:
        """Of several runs."""
        return cls(float(np.median(seconds)), float(np.quantile(seconds, 0.95)))


def detailed(category: str, density: int) -> Mesh:
    """A detailed shape of a category."""
    shape = MAKERS[category](SEED, density)
    return shape.mesh(shape.parameters), shape.faces


def sized(category: str, size: int) -> Mesh:
    """A detailed shape of about so many vertices, cut more finely and then divided."""
    best = (np.inf, 0, 0)
    for density in DENSITIES:
        count = len(detailed(category, density)[0])
        divisions = max(round(np.log(size / count) / np.log(4.0)), 0)
        best = min(best, (abs(np.log(count * 4.0**divisions / size)), divisions, density))
    vertices, faces = detailed(category, best[2])
    for _ in range(best[1]):
        vertices, faces = trimesh.remesh.subdivide(vertices, faces)
    return vertices, faces


def as_glb(mesh: Mesh) -> bytes:
    """A GLB with normals and texture coordinates."""
    vertices, faces = mesh
    whole = trimesh.Trimesh(vertices, faces, process=False)
    material = trimesh.visual.material.PBRMaterial(baseColorFactor=[180, 120, 60, 255])
    whole.visual = trimesh.visual.TextureVisuals(uv=vertices[:, :2], material=material)
    return bytes(trimesh.exchange.gltf.export_glb(trimesh.Scene(whole), include_normals=True))


def copied(data: bytes) -> bytes:
    """The file read and written with nothing done: its JSON parsed, its numbers copied out and back
    in."""
    length = int.from_bytes(data[12:16], "little")
    json.loads(data[20 : 20 + length])
    start = 28 + length
    numbers = np.frombuffer(data, np.uint8, offset=start).copy()
    return data[:start] + numbers.tobytes()


def measured(category: str, size: int, threads: int) -> dict[str, Any]:
    """Times of every stage for a mesh of a size, in this process.

    Returns:
        The category, threads, vertices, bytes of the file, peak memory in bytes, and `Timing` by
        stage.
    """
    data = as_glb(sized(category, size))
    models = load_models(SHIPPED, threads)
    one = {category: models[category]}
    upload, told = Upload(data, f"{category}.glb"), InferOptions(category, "+y", "+z")
    public = [p.name for p in models[category].template.parameters if not p.nuisance]
    rng, options = np.random.default_rng(0), EditOptions()

    def change() -> dict[str, Change]:
        return {str(rng.choice(public)): Change("scale", float(rng.uniform(0.8, 1.25)))}

    seconds: dict[str, list[float]] = {}

    def run(name: str, work: Callable[[], object], stages: bool = False) -> None:
        record, began = Record(), time.perf_counter()
        with recording(record):
            work()
        seconds.setdefault(name, []).append(time.perf_counter() - began)
        for stage, took in record.seconds.items() if stages else ():
            seconds.setdefault(stage, []).append(took)

    for _ in range(FIRSTS[size]):
        run(FLOOR, lambda: copied(data))
        run(WHOLE, lambda: edit(upload, one, told, change(), options), stages=True)
    with editable(upload, one, told, options) as found:
        for name in public:
            # The first change of a parameter looks for folds, which is part of binding.
            move(found, {name: Change("scale", 1.1)}, options)
        for _ in range(EDITS[size]):
            run(BOUND, lambda: write_edited(move(found, change(), options), None))
    return {
        "category": category,
        "threads": threads,
        "vertices": len(read_mesh(data, upload.name).vertices),
        "bytes": len(data),
        "memory": 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss,
        "stages": {name: vars(Timing.of(times)) for name, times in seconds.items()},
    }


def apart(category: str, size: int, threads: int) -> dict[str, Any]:
    """The same in a process of its own, whose libraries all keep to so many threads."""
    command = [sys.executable, "-m", "model_export.benchmark.speed", "--one", category]
    command += ["--size", str(size), "--threads", str(threads)]
    names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
    own = os.environ | dict.fromkeys(names, str(threads))
    done = subprocess.run(command, env=own, check=True, capture_output=True, text=True)
    return dict(json.loads(done.stdout.splitlines()[-1]))


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(
        prog="python -m model_export.benchmark.speed", description=__doc__
    )
    parser.add_argument("--out", type=Path, default=Path("runs/speed.md"), help="page to write")
    parser.add_argument("--quick", action="store_true", help="up to 10,000 vertices")
    parser.add_argument("--one", choices=MAKERS, help="measure this category in this process")
    parser.add_argument("--size", type=int, choices=SIZES, help="with --one: vertices, about")
    parser.add_argument("--threads", type=int, default=1, help="with --one")
    options = parser.parse_args()
    if options.one:
        if options.size is None:
            parser.error("--one needs --size")
        print(json.dumps(measured(options.one, options.size, options.threads)))
        return
    rows = []
    for category in MAKERS:
        for size in QUICK if options.quick else SIZES:
            for threads in (1, 2):
                print(f"{category}, {size:,} vertices, threads: {threads}", file=sys.stderr)
                rows.append(apart(category, size, threads))
    options.out.parent.mkdir(parents=True, exist_ok=True)
    options.out.write_text(speed_table(rows), encoding="utf-8")
    print(f"wrote {options.out}", file=sys.stderr)


if __name__ == "__main__":
    main()
