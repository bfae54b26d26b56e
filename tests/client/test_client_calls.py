from __future__ import annotations

import asyncio
import inspect
import subprocess
import sys
from pathlib import Path

import httpx
import pytest
from client_app import Script, alive

from service.client import (
    AsyncShapeClient,
    Mesh,
    ShapeClient,
    at_most,
    scale,
)

PROGRAM = """
import sys
OWN = {"httpx", "httpcore", "pydantic", "pydantic_core", "h11", "anyio", "certifi", "idna",
       "annotated_types", "typing_extensions", "typing_inspection", "sniffio"}
class Wall:
    def find_spec(self, name, path=None, target=None):
        top = name.partition(".")[0]
        known = top in sys.stdlib_module_names | OWN | {"service"}
        if not known and not top.startswith("_sysconfigdata"):
            raise ModuleNotFoundError(name)
sys.meta_path.insert(0, Wall())
import service.client
own = [n for n in sys.modules if n.startswith("service.") and not n.startswith("service.client")]
assert not own, own
"""


@pytest.fixture
def client(service_client: httpx.Client) -> ShapeClient:
    return ShapeClient(http=service_client)


def test_it_needs_only_httpx_and_pydantic() -> None:
    subprocess.run([sys.executable, "-c", PROGRAM], check=True, timeout=60)


def test_a_mesh_is_inferred_edited_and_kept(
    client: ShapeClient, chair_glb: bytes, tmp_path: Path
) -> None:
    mesh = Mesh(chair_glb, "chair.glb")
    report = client.infer(mesh, category="chair")
    assert mesh.mesh_id == report.mesh_id
    assert client.mesh(mesh).data == chair_glb
    edited = client.edit(mesh, {"seat_width": scale(1.2)}, category="chair")
    before = report.parameters["seat_width"].value
    assert edited.parameters["seat_width"] == pytest.approx(1.2 * before, rel=1e-3)
    assert edited.save(tmp_path) == tmp_path / edited.filename
    assert (tmp_path / edited.filename).read_bytes() == edited.data != chair_glb


def test_constraints_and_reports(client: ShapeClient, chair_glb: bytes) -> None:
    report = client.edit_report(chair_glb, category="chair", constraints={"seat_width": at_most(9)})
    assert report.parameters["seat_width"].before == report.parameters["seat_width"].after
    assert client.mesh(report.mesh_id).data == client.mesh(report.source_mesh_id).data


def test_transfer_sliders_and_template(client: ShapeClient, chair_glb: bytes) -> None:
    wide = client.edit(chair_glb, {"seat_width": scale(1.2)}, category="chair")
    report = client.transfer_report(chair_glb, wide, category="chair", parameters=["seat_width"])
    assert report.transfer.parameters == ["seat_width"]
    assert client.transfer(chair_glb, wide, category="chair").data[:4] == b"glTF"
    for made in (client.sliders, client.template):
        assert made(chair_glb, category="chair", parameters=["seat_width"]).data[:4] == b"glTF"


def test_what_is_served(client: ShapeClient) -> None:
    names = {category.name for category in client.categories()}
    assert names <= set(client.ready().models)
    assert client.category("chair").name == "chair"
    assert client.alive().status == "alive"


def test_the_asynchronous_client(service_client: httpx.Client, chair_glb: bytes) -> None:
    async def edited() -> bytes:
        async with AsyncShapeClient(str(service_client.base_url)) as client:
            return (await client.edit(chair_glb, {"seat_width": 0.5}, category="chair")).data

    assert asyncio.run(edited())[:4] == b"glTF"


def test_both_clients_have_the_same_methods() -> None:
    names = {name for name in dir(ShapeClient) if not name.startswith("_")}
    assert names == {name for name in dir(AsyncShapeClient) if not name.startswith("_")}
    for name in names:
        method, other = getattr(ShapeClient, name), getattr(AsyncShapeClient, name)
        assert (
            inspect.signature(method).parameters.keys()
            == inspect.signature(other).parameters.keys()
        )
        assert inspect.getdoc(method)
        assert inspect.getdoc(other) == inspect.getdoc(method)


def test_the_key_is_sent_and_not_shown(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SHAPE_API_KEY", "hush-hush")
    monkeypatch.setenv("SHAPE_URL", "http://shapes.test/")
    script = Script(alive())
    with ShapeClient(transport=httpx.MockTransport(script)) as client:
        client.alive()
        assert "hush" not in repr(client) + repr(vars(client))
    (request,) = script.requests
    assert request.headers["authorization"] == "Bearer hush-hush"
    assert str(request.url) == "http://shapes.test/livez"


def test_options_that_are_not_there_are_told(client: ShapeClient) -> None:
    with pytest.raises(TypeError, match="no option 'unit'"):
        client.infer(b"", unit="cm")  # type: ignore[call-arg]
