"""That the tools which measure the service work; what they measure is not looked at here."""

from __future__ import annotations

from random import Random

import anyio
import httpx

from .__main__ import Tally, percentile, prepared, row, run
from .client import GENERATOR, Answer, Client, upload
from .meshes import generated
from .soak import Mix


def test_percentiles() -> None:
    values = [number / 1000 for number in range(1, 101)]
    assert percentile(values, 0.5) == 51.0
    assert percentile(values, 0.99) == 100.0
    assert percentile(values, 1.0) == 100.0
    assert percentile([], 0.5) == 0.0


def test_a_row_of_the_table() -> None:
    tally = Tally(seconds=2.0, accepted=[0.1] * 3, refused=[0.5], probes=[0.01])
    assert row(4, tally) == "| 4 | 1.5 | 100 | 100 | 100 | 0 | 25 % | 0 | 10.0 | 10.0 | 10.0 |"


def test_a_numbered_mesh_is_another_file() -> None:
    mesh = generated("chair", 2000)
    call = upload("/infer", mesh.name, mesh.data)
    first, second = call.numbered(1).body, call.numbered(2).body
    assert len({call.body, first, second}) == 3
    assert len(first) == len(call.body)
    assert GENERATOR not in first


def test_the_same_seed_gives_the_same_mix() -> None:
    meshes = [generated("chair", 0), generated("airplane", 0)]

    def drawn() -> list[bytes]:
        random = Random(7)
        mix = Mix(meshes, random)
        mix.keep(meshes[0], Answer(200, {}, b'{"mesh_id": "sha256-1"}', 0.0))
        return [
            call.bytes() for _ in range(9) for call in (mix.work()[0], mix.mistake(), mix.look())
        ]

    assert drawn() == drawn()


def test_a_moment_of_load(service_client: httpx.Client) -> None:
    port = service_client.base_url.port
    assert port is not None

    async def load() -> Tally:
        calls = await prepared(port, [generated("chair", 0)], "/edit by id")
        return await run(port, calls, clients=2, seconds=0.5, wait=0.0, same=False)

    tally = anyio.run(load)
    assert tally.failed == []
    assert tally.accepted
    assert tally.probes


def test_a_client_that_leaves(service_client: httpx.Client) -> None:
    port = service_client.base_url.port
    assert port is not None
    mesh = generated("chair", 0)
    call = upload("/infer", mesh.name, mesh.data)

    async def leave() -> int:
        client = Client(port)
        await client.leave(call, 0.5, 0.0)
        answer = await client.send(call)
        client.close()
        return answer.status

    assert anyio.run(leave) == 200
