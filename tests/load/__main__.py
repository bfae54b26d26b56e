"""Throughput, latency and refusals at more and more clients, with probes in between."""

from __future__ import annotations

import argparse
import asyncio
import gc
import itertools
import json
import os
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from .client import Answer, Call, Client, by_id, upload
from .meshes import CATEGORIES, Mesh, generated, read
from .service import started

PROBE_EVERY_S = 0.05


@dataclass
class Tally:
    """What the clients of one run saw; times are in seconds."""

    seconds: float = 0.0
    accepted: list[float] = field(default_factory=list)
    refused: list[float] = field(default_factory=list)
    failed: list[str] = field(default_factory=list)
    probes: list[float] = field(default_factory=list)

    def note(self, answer: Answer) -> None:
        """Count an answer."""
        if answer.status == 200:
            self.accepted.append(answer.seconds)
        elif answer.status == 429:
            self.refused.append(answer.seconds)
        else:
            self.failed.append(f"{answer.status} {answer.body[:200]!r}")


def percentile(values: Sequence[float], share: float) -> float:
    """The least value that is not below so large a share of them, in ms."""
    ordered = sorted(values)
    return 1e3 * ordered[min(len(ordered) - 1, int(share * len(ordered)))] if ordered else 0.0


async def prepared(port: int, meshes: Sequence[Mesh], routes: str) -> list[Call]:
    """The calls of a run; the service has answered each once."""
    client = Client(port)
    calls: list[Call] = []
    for mesh in meshes:
        answer = await client.send(upload("/infer", mesh.name, mesh.data))
        if answer.status != 200:
            raise RuntimeError(f"{mesh.name}: {answer.status} {answer.body[:500]!r}")
        edits = json.dumps({mesh.parameter: {"scale": 1.1}})
        mesh_id, options = answer.json()["mesh_id"], {"category": mesh.category}
        calls += [
            upload("/infer", mesh.name, mesh.data),
            upload("/edit", mesh.name, mesh.data, edits=edits, **options),
            by_id("/edit", mesh_id, edits=edits, **options),
            upload("/sliders", mesh.name, mesh.data, **options),
        ]
    chosen = [call for call in calls if routes in ("mixed", call.name)]
    for call in chosen:
        answer = await client.send(call)
        if answer.status != 200:
            raise RuntimeError(f"{call.name}: {answer.status} {answer.body[:500]!r}")
    client.close()
    return chosen


async def run(
    port: int, calls: Sequence[Call], clients: int, seconds: float, wait: float, same: bool
) -> Tally:
    """Let so many clients call, each again once it is answered.

    Args:
        same: whether uploads may be those that the service has in its caches.
        wait: seconds that a client waits after a 429; below zero, as long as `Retry-After` says.
    """
    tally = Tally()
    start = time.perf_counter()
    end = start + seconds
    turn, numbers = itertools.cycle(calls), itertools.count(time.time_ns() // 1000)

    async def call_again() -> None:
        client = Client(port)
        while time.perf_counter() < end:
            call = next(turn) if same else next(turn).numbered(next(numbers))
            try:
                answer = await client.send(call)
            except (OSError, asyncio.IncompleteReadError) as error:
                tally.failed.append(repr(error))
                continue
            tally.note(answer)
            if answer.status == 429:
                await asyncio.sleep(float(answer.headers["retry-after"]) if wait < 0 else wait)
        client.close()

    async def probe() -> None:
        kept = Client(port)
        for number in itertools.count():
            if time.perf_counter() >= end:
                break
            # By turns over a connection that is kept and over one of its own, as orchestrators do.
            client = kept if number % 2 else Client(port)
            began = time.perf_counter()
            answer = await client.send(Call("probe", "GET", ("/livez", "/readyz")[number // 2 % 2]))
            tally.probes.append(time.perf_counter() - began)
            if answer.status != 200:
                tally.failed.append(f"probe: {answer.status}")
            if client is not kept:
                client.close()
            await asyncio.sleep(PROBE_EVERY_S)
        kept.close()

    await asyncio.gather(probe(), *(call_again() for _ in range(clients)))
    tally.seconds = time.perf_counter() - start
    return tally


HEAD = (
    "| clients | accepted/s | p50 ms | p95 ms | p99 ms | refused/s | 429 | other | "
    "probe p50 ms | p99 ms | max ms |\n" + "|---:" * 11 + "|"
)


def row(clients: int, tally: Tally) -> str:
    """One line of the table."""
    answers = len(tally.accepted) + len(tally.refused) + len(tally.failed)
    cells = [
        f"{clients}",
        f"{len(tally.accepted) / tally.seconds:.1f}",
        *(f"{percentile(tally.accepted, share):.0f}" for share in (0.5, 0.95, 0.99)),
        f"{len(tally.refused) / tally.seconds:.0f}",
        f"{100 * len(tally.refused) / max(answers, 1):.0f} %",
        f"{len(tally.failed)}",
        *(f"{percentile(tally.probes, share):.1f}" for share in (0.5, 0.99, 1.0)),
    ]
    return "| " + " | ".join(cells) + " |"


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.load", description=__doc__)
    parser.add_argument("--clients", default="1,2,4,8,16,32,64", help="numbers, commas between")
    parser.add_argument("--seconds", type=float, default=15.0, help="of each number of clients")
    parser.add_argument(
        "--routes", default="mixed", choices=["mixed", "/infer", "/edit", "/edit by id", "/sliders"]
    )
    parser.add_argument("--categories", default=",".join(CATEGORIES))
    parser.add_argument("--vertices", type=int, default=10_000, help="of each mesh, at least")
    parser.add_argument("--mesh", type=Path, help="a file of your own, of the one category")
    parser.add_argument("--parameter", default="seat_width", help="that edits of --mesh change")
    parser.add_argument(
        "--wait", type=float, default=-1.0, help="seconds after a 429; else as Retry-After says"
    )
    parser.add_argument("--same", action="store_true", help="the same uploads again and again")
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE")
    options = parser.parse_args()
    categories = options.categories.split(",")
    if options.mesh:
        meshes = [read(options.mesh, categories[0], options.parameter)]
    else:
        meshes = [generated(category, options.vertices) for category in categories]
    how = options.seconds, options.wait, options.same
    settings = dict(entry.split("=", 1) for entry in options.set)
    sizes = ", ".join(f"{mesh.name} {len(mesh.data) / 1e6:.1f} MB" for mesh in meshes)
    cpus = len(os.sched_getaffinity(0))
    print(f"{options.routes}; {sizes}; {cpus} CPUs; {settings or 'defaults'}\n")
    # The clients' own garbage collections would show as slow probes.
    gc.freeze()
    with started(settings) as service:
        calls = asyncio.run(prepared(service.port, meshes, options.routes))
        print(HEAD, flush=True)
        alone = None
        took, since = time.process_time(), time.perf_counter()
        for clients in map(int, options.clients.split(",")):
            tally = asyncio.run(run(service.port, calls, clients, *how))
            print(row(clients, tally), flush=True)
            alone = alone or tally
            for failure in tally.failed[:3]:
                print(f"  {failure}")
        ratio = percentile(tally.accepted, 0.99) / percentile(alone.accepted, 0.99)
        share = (time.process_time() - took) / (time.perf_counter() - since)
        print(f"\np99 of the last over that of the first: {ratio:.1f}; RSS {service.rss:.0f} MiB")
        print(f"The clients took {100 * share:.0f} % of one CPU.")


if __name__ == "__main__":
    main()
