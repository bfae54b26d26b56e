"""Ten thousand mixed requests, and the memory of the service meanwhile."""

from __future__ import annotations

import argparse
import asyncio
import json
import time
from collections import Counter
from pathlib import Path
from random import Random

from service.main import TRIM_EVERY_S

from .client import Answer, Call, Client, by_id, upload
from .meshes import CATEGORIES, Mesh, generated, read
from .service import Service, started

EVERY = 500
"""Requests between two looks at the memory, with none in work."""

# Caches that are full within the first requests: what grows later is none of theirs.
BUDGETS = {"MESH_CACHE_BYTES": str(16 << 20), "INFERENCE_CACHE_BYTES": str(16 << 20)}

TRANSIENT = (OSError, asyncio.IncompleteReadError)


class Mix:
    """Requests of all sorts, at random: the same for the same seed."""

    def __init__(self, meshes: list[Mesh], random: Random) -> None:
        self._meshes = meshes
        self._random = random
        self._number = 0
        self._kept: list[tuple[Mesh, str]] = []

    def keep(self, mesh: Mesh, answer: Answer) -> None:
        """Note the id under which the service keeps a mesh."""
        self._kept = [*self._kept[-7:], (mesh, answer.json()["mesh_id"])]

    def work(self) -> tuple[Call, Mesh]:
        """A request that is answered with 200, or a 404 for an id that is gone."""
        path = self._random.choice(["/infer", "/infer", "/edit", "/edit", "/sliders", "/template"])
        if self._kept and self._random.random() < 0.4:
            mesh, mesh_id = self._random.choice(self._kept)
            return by_id(path, mesh_id, **self._fields(path, mesh)), mesh
        mesh = self._random.choice(self._meshes)
        call = upload(path, mesh.name, mesh.data, **self._fields(path, mesh))
        self._number += 1
        # Half of them are meshes that the service has never seen.
        return call.numbered(self._number) if self._random.random() < 0.5 else call, mesh

    def mistake(self) -> Call:
        """A request that is answered with an error of the client's."""
        mesh = self._random.choice(self._meshes)
        data = mesh.data
        broken = data[: self._random.randrange(len(data))]
        edits = json.dumps({"no_such_parameter": 1})
        return self._random.choice([
            upload("/infer", mesh.name, broken),
            upload("/infer", "broken.obj", b"v 0 0 x\nf 1 2 3\n"),
            upload("/edit", mesh.name, data, edits=edits, category=mesh.category),
            upload("/edit", mesh.name, data),
            by_id("/sliders", "sha256-00"),
            Call("no form", "POST", "/infer", b"{}", "application/json"),
            Call("no path", "GET", "/no/such/path"),
            Call("no method", "DELETE", "/infer"),
        ])  # fmt: skip

    def look(self) -> Call:
        """A request that takes no worker."""
        paths = ["/livez", "/readyz", "/categories", "/categories/chair", "/openapi.json", "/"]
        return Call("look", "GET", self._random.choice([*paths, "/metrics"]))

    def _fields(self, path: str, mesh: Mesh) -> dict[str, str]:
        fields = {"category": mesh.category} if self._random.random() < 0.7 else {}
        if self._random.random() < 0.5:
            fields["refine"] = "false"
        if path == "/edit":
            fields["edits"] = json.dumps(
                {mesh.parameter: {"scale": self._random.uniform(0.9, 1.1)}}
            )
            fields["category"] = mesh.category
        return fields


async def soak(service: Service, mix: Mix, random: Random, requests: int, clients: int) -> float:
    """Send them; the growth of memory since `EVERY` requests, as a share."""
    seen: Counter[str] = Counter()
    memory: dict[int, float] = {}
    sent = 0
    start = time.monotonic()

    async def look() -> None:
        # Work for those who hung up ends, and the service gives back what requests left free.
        await asyncio.sleep(TRIM_EVERY_S + 1.0)
        memory[sent] = service.rss
        rate = sent / (time.monotonic() - start)
        print(f"| {sent} | {memory[sent]:.0f} | {rate:.1f} |", flush=True)

    async def client(until: int) -> None:
        nonlocal sent
        connection = Client(service.port)
        while sent < until:
            sent += 1
            try:
                seen[await _one(connection, mix, random)] += 1
            except TRANSIENT as error:
                seen[f"broken connection: {error!r}"] += 1
        connection.close()

    print("| requests | RSS, MiB | requests/s |\n|---:|---:|---:|", flush=True)
    for until in [*range(EVERY, requests, EVERY), requests]:
        await asyncio.gather(*(client(until) for _ in range(clients)))
        await look()
    print("\n" + ", ".join(f"{status}: {count}" for status, count in sorted(seen.items())))
    first, last = memory[min(memory)], memory[max(memory)]
    return last / first - 1


async def _one(connection: Client, mix: Mix, random: Random) -> str:
    """Send one request; what came of it."""
    kind = random.random()
    if kind < 0.1:
        call, _ = mix.work()
        await connection.leave(call, random.choice([0.3, 0.9, 1.0]), random.uniform(0.0, 0.1))
        return "left"
    if kind < 0.2:
        return str((await connection.send(mix.mistake())).status)
    if kind < 0.3:
        return str((await connection.send(mix.look())).status)
    call, mesh = mix.work()
    answer = await connection.send(call)
    if call.name == "/infer" and answer.status == 200:
        mix.keep(mesh, answer)
    if answer.status >= 500:
        print(f"{call.name}: {answer.status} {answer.body[:300]!r}")
    if answer.status == 429:
        await asyncio.sleep(random.uniform(0.0, 1.0))
    return str(answer.status)


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.load.soak", description=__doc__)
    parser.add_argument("--requests", type=int, default=10_000)
    parser.add_argument("--clients", type=int, default=4)
    parser.add_argument(
        "--vertices", type=int, default=3000, help="of the smallest meshes, at least"
    )
    parser.add_argument(
        "--folder", type=Path, help="with chairs/, airplanes/, humans/ of GLB files"
    )
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE")
    options = parser.parse_args()
    random = Random(options.seed)
    meshes = [
        generated(name, factor * options.vertices) for name in CATEGORIES for factor in (1, 4)
    ]
    if options.folder:
        meshes += _found(options.folder)
    settings = {**BUDGETS, **dict(entry.split("=", 1) for entry in options.set)}
    with started(settings) as service:
        print(f"at rest: {service.rss:.0f} MiB; {settings}\n")
        mix = Mix(meshes, random)
        growth = asyncio.run(soak(service, mix, random, options.requests, options.clients))
        print(f"growth since {EVERY} requests: {100 * growth:+.1f} %")


def _found(folder: Path) -> list[Mesh]:
    """A few real files of each category, of up to 2 MB."""
    parameters = {"chair": "seat_width", "airplane": "wing_length", "human": "left_elbow_y"}
    meshes = []
    for category, parameter in parameters.items():
        paths = sorted((folder / f"{category}s").rglob("*.glb"))
        small = [path for path in paths if path.stat().st_size < 2_000_000]
        meshes += [read(path, category, parameter) for path in small[:8]]
    return meshes


if __name__ == "__main__":
    main()
