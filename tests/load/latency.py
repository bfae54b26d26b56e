"""How long edits of a mesh take that the service knows: ``python -m tests.load.latency``.

One client, one request at a time, from the first byte that it sends to the last that comes; each
edit is another one.
"""

from __future__ import annotations

import argparse
import asyncio
import io
import json
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from typing import Any

import trimesh

from service.mesh.formats import read_mesh

from .__main__ import percentile
from .client import Call, Client, by_id, upload
from .meshes import CATEGORIES, Mesh, generated, read
from .service import Service, started

TICKS = os.sysconf("SC_CLK_TCK")


@dataclass
class Seen:
    """What was measured of one mesh, in seconds.

    Attributes:
        first: the first edit, with the file itself.
        edits: by id.
        cpu: of the service's processor, for each of them.
        infer, sliders: these calls by id.
    """

    name: str
    vertices: int
    size: int
    first: float
    edits: list[float] = field(default_factory=list)
    cpu: float = 0.0
    infer: float = 0.0
    sliders: float = 0.0

    def row(self) -> str:
        """A line of the table, in ms."""
        shares = " / ".join(f"{percentile(self.edits, share):.0f}" for share in (0.5, 0.95, 0.99))
        others = (f"{1e3 * t:.0f}" for t in (self.cpu, self.infer, self.sliders))
        return (
            f"| {self.name} | {self.vertices / 1e3:.0f}k | {self.size / 1e6:.1f} MB "
            f"| {1e3 * self.first:.0f} | {shares} | {' | '.join(others)} |"
        )


HEAD = """| mesh | vertices | file | first edit | p50 / p95 / p99 by id | CPU | infer | sliders |
|---|---|---|---|---|---|---|---|"""


def dressed(mesh: Mesh) -> Mesh:
    """The mesh with normals and texture coordinates."""
    bare: Any = trimesh.load(io.BytesIO(mesh.data), file_type="glb", process=False, force="mesh")
    material = trimesh.visual.material.PBRMaterial(baseColorFactor=[180, 120, 60, 255])
    bare.visual = trimesh.visual.TextureVisuals(uv=bare.vertices[:, :2], material=material)
    data = trimesh.exchange.gltf.export_glb(trimesh.Scene(bare), include_normals=True)
    return Mesh(mesh.category, mesh.name, bytes(data), mesh.parameter)


def edit(parameters: Mapping[str, Mapping[str, Any]], random: Random) -> str:
    """A change of one or two parameters: of lengths by a fifth at most, of others by 0.4."""
    changes = {}
    for name in random.sample(sorted(parameters), random.choice([1, 2])):
        if parameters[name]["unit"] in ("rad", "1"):
            changes[name] = {"add": random.uniform(-0.4, 0.4)}
        else:
            changes[name] = {"scale": random.uniform(0.85, 1.2)}
    return json.dumps(changes)


async def measured(service: Service, mesh: Mesh, count: int) -> Seen:
    """So many edits of a mesh by its id, and the other calls."""
    client, random = Client(service.port), Random(1)

    async def send(call: Call) -> tuple[float, bytes]:
        answer = await client.send(call)
        if answer.status != 200:
            raise RuntimeError(f"{call.name}: {answer.status} {answer.body[:500]!r}")
        return answer.seconds, answer.body

    wider = json.dumps({mesh.parameter: {"add": 0.01}})
    first, _ = await send(upload("/edit", mesh.name, mesh.data, edits=wider))
    report = json.loads((await send(upload("/infer", mesh.name, mesh.data)))[1])
    mesh_id, parameters = report["mesh_id"], report["parameters"]
    seen = Seen(mesh.name, len(read_mesh(mesh.data, mesh.name).vertices), len(mesh.data), first)
    before = _cpu(service)
    for _ in range(count):
        call = by_id("/edit", mesh_id, edits=edit(parameters, random))
        seen.edits.append((await send(call))[0])
    seen.cpu = (_cpu(service) - before) / count
    seen.infer = min([(await send(by_id("/infer", mesh_id)))[0] for _ in range(5)])
    seen.sliders = min([(await send(by_id("/sliders", mesh_id)))[0] for _ in range(5)])
    client.close()
    return seen


def _cpu(service: Service) -> float:
    """Seconds of processor time that the service has taken."""
    fields = Path(f"/proc/{service.process.pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / TICKS


def _peak(service: Service) -> float:
    """The most memory that it has held, in MiB."""
    status = Path(f"/proc/{service.process.pid}/status").read_text()
    match = re.search(r"VmHWM:\s+(\d+) kB", status)
    return int(match[1]) / 1024 if match else 0.0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--vertices", type=int, default=100_000, help="of each mesh, at least")
    parser.add_argument("--edits", type=int, default=100, help="of each mesh")
    parser.add_argument(
        "--file",
        action="append",
        default=[],
        metavar="CATEGORY,PARAMETER,PATH",
        help="a mesh of your own in place of those that are made; may be repeated",
    )
    arguments = parser.parse_args()
    meshes = [dressed(generated(category, arguments.vertices)) for category in CATEGORIES]
    if arguments.file:
        told = [entry.split(",", 2) for entry in arguments.file]
        meshes = [read(Path(path), category, parameter) for category, parameter, path in told]
    with started({}) as service:
        print(HEAD)
        for mesh in meshes:
            print(asyncio.run(measured(service, mesh, arguments.edits)).row(), flush=True)
        print(f"\nRSS {service.rss:.0f} MiB, at most {_peak(service):.0f}")


if __name__ == "__main__":
    main()
