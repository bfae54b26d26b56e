"""The running service against its own description: whatever is sent, what comes is documented.

Schemathesis makes the requests up from `openapi.yaml`, in keeping with it and not. The models are
those of `debug`, which answer at once; the same for the others, and for longer, by

    schemathesis run openapi.yaml --url http://127.0.0.1:8000 \
        --checks all --exclude-checks positive_data_acceptance --max-examples 500
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import requests
import schemathesis
import trimesh
from hypothesis import HealthCheck, settings
from schemathesis import Case
from schemathesis.checks import CHECKS
from schemathesis.transport.serialization import Binary

from service.api.keys import Entry, digest_of, new_key
from service.main import create_app
from service.settings import Settings

CONTRACT = Path(__file__).parents[2] / "openapi.yaml"
KEY = new_key()

BOX = trimesh.creation.box((0.4, 0.9, 0.5))
EXPORTED = [BOX.export(file_type=kind) for kind in ("glb", "obj", "ply", "stl", "off")]
MESHES = [mesh if isinstance(mesh, bytes) else mesh.encode() for mesh in EXPORTED]
# Possible in every unit.
EDITS = [{"width": {"scale": 1.5}}, {"height": {"scale": 0.8}, "width": {"add": 0.001}}, {}]
WORDS = {
    "category": ["auto", "debug"],
    "edits": [json.dumps(edits) for edits in EDITS],
    "variants": [json.dumps(EDITS), "[{}]"],
    "constraints": ['{"depth": {"max": 1e6}}', '{"depth": {"min": 1e-6}}'],
    "keep": ["floor", "center"],
    "parameters": ["width", '["height", "depth"]'],
}
"""Values that make sense of what the document can only describe in words."""

BOOLEANS = {"paired", "quantize", "refine", "strict"}
# All is text in a form: 0 is as good as false there, and an empty field as none.
SPELLINGS = {"0", "1", "f", "false", "n", "no", "off", "on", "t", "true", "y", "yes"}

schema = schemathesis.openapi.from_path(CONTRACT)
bounded = settings(
    max_examples=10,
    deadline=None,
    derandomize=True,
    database=None,
    suppress_health_check=list(HealthCheck),
)


@pytest.fixture(scope="module")
def session() -> Iterator[requests.Session]:
    with requests.Session() as session:
        session.trust_env = False
        yield session


@pytest.fixture(scope="module")
def url(serving: Callable[..., Any]) -> Iterator[str]:
    with serving(create_app(Settings(workers=2, categories="debug"))) as client:
        yield str(client.base_url)


@pytest.fixture(scope="module")
def locked_url(serving: Callable[..., Any]) -> Iterator[str]:
    entry = str(Entry("ann", digest_of(KEY)))
    app = create_app(Settings(workers=2, categories="debug", api_keys=entry))
    with serving(app) as client:
        yield str(client.base_url)


@pytest.fixture(scope="module")
def mesh_id(url: str, session: requests.Session) -> str:
    """Of a mesh that the service holds."""
    answer = session.post(f"{url}/infer", files={"mesh": ("box.glb", MESHES[0])}, timeout=60)
    return str(answer.json()["mesh_id"])


@schema.parametrize()
@bounded
def test_any_request(case: Case, url: str, session: requests.Session, mesh_id: str) -> None:
    """What keeps to the document is accepted, what does not is refused, both as it says."""
    number = draw(case)
    positive = case.meta.generation.mode.is_positive
    if positive and number % 2 and "mesh_id" in case.path_parameters:
        case.path_parameters["mesh_id"] = mesh_id
    if isinstance(case.body, dict):
        if positive:
            say_what_makes_sense(case, number)
        else:
            leave_one_fault(case.body)
        # Its fault may be in the mesh, or that there is nothing at all.
        for part in parts(case):
            if positive or (case.body and not {part, by_id(part)} & {*case.body}):
                give_mesh(case.body, part, number, mesh_id)
    headers = {"Accept": ("*/*", "application/json")[number % 2]}
    case.call_and_validate(base_url=url, session=session, headers=headers)


@schema.include(method="POST").parametrize()
@bounded
def test_any_file(case: Case, url: str, session: requests.Session) -> None:
    """Meshes that are damaged, cut off or none at all."""
    if isinstance(case.body, dict) and case.meta.generation.mode.is_positive:
        number = draw(case)
        say_what_makes_sense(case, number)
        mesh = bytearray(MESHES[number % len(MESHES)])
        for step in range(number % 7):
            mesh[(number * (step + 1)) % len(mesh)] ^= number >> step & 255
        for part in parts(case):
            case.body[part] = Binary(bytes(mesh[: number % (2 * len(mesh))]))
    unaccepted = CHECKS.get_one("positive_data_acceptance")
    # A job would be accepted, and fail when the mesh is read.
    at_once = {"prefer": "wait"}
    case.call_and_validate(
        base_url=url, session=session, headers=at_once, excluded_checks=[unaccepted]
    )


@schema.parametrize()
@settings(bounded, max_examples=3)
def test_any_request_without_a_key(case: Case, locked_url: str, session: requests.Session) -> None:
    response = case.call(base_url=locked_url, session=session)
    documented = case.operation.definition.raw["responses"]
    if response.status_code not in (404, 405):
        assert (response.status_code == 401) is ("401" in documented), case.operation.label
    case.validate_response(response, excluded_checks=[CHECKS.get_one("positive_data_acceptance")])


def draw(case: Case) -> int:
    """A number that hangs on all of a case, to choose by."""
    return zlib.crc32(repr((case.body, case.path_parameters)).encode())


def say_what_makes_sense(case: Case, number: int) -> None:
    """Put words that go with the meshes into a form."""
    form = case.body
    for part in parts(case):
        form.pop(part, None)
        form.pop(by_id(part), None)
    if "variants" in form:
        form.pop("edits", None)
        form.pop("constraints", None)
    elif case.operation.path == "/edit" and "constraints" not in form:
        form.setdefault("edits", "{}")
    if form.get("up", "auto")[1:] == form.get("front", "auto")[1:]:
        form.pop("front", None)
    for name, values in WORDS.items():
        if name in form:
            form[name] = values[number % len(values)]


def leave_one_fault(form: dict[str, Any]) -> None:
    """Let a form that breaks the schema break it on the wire too, where all is text."""
    for name, value in form.items():
        # A list of one is that one, and one of none is not sent.
        vanishes = value in ("", None) or (isinstance(value, list) and len(value) < 2)
        if vanishes or (name in BOOLEANS and str(value).lower() in SPELLINGS):
            form[name] = "?"


def parts(case: Case) -> tuple[str, ...]:
    """The files of an operation's form."""
    return ("source", "target") if case.operation.path == "/transfer" else ("mesh",)


def by_id(part: str) -> str:
    """The field that stands in for a file."""
    return "mesh_id" if part == "mesh" else f"{part}_mesh_id"


def give_mesh(form: dict[str, Any], part: str, number: int, mesh_id: str) -> None:
    """Put a mesh into a form, or the id of one."""
    if number % 3:
        form[part] = Binary(MESHES[number % len(MESHES)])
    else:
        form[by_id(part)] = mesh_id
