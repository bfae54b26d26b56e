"""Several versions of a model, as clients meet them."""

from __future__ import annotations

import gc
import shutil
import time
import weakref
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import anyio
import httpx
import pytest
import trimesh

from model_export.debug_model import write_model
from service.api.schemas import Categories, Category, Ready
from service.main import create_app
from service.settings import Settings

BOX = {"mesh": ("box.glb", bytes(trimesh.creation.box((0.5, 1.0, 2.0)).export(file_type="glb")))}


@pytest.fixture(scope="module")
def own(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two versions of the debug model, beside the shipped one, 1.0.0."""
    folder = tmp_path_factory.mktemp("models")
    for version in ("0.9.0", "2.0.0"):
        (folder / version).mkdir()
        write_model(folder / version, version)
    return folder


@pytest.fixture(scope="module")
def versions(own: Path, serving: Any) -> Iterator[httpx.Client]:
    """A client of a service with those, the oldest of which is the default."""
    settings = Settings(
        workers=2, categories=("debug",), models_dir=own, default_models={"debug": "0.9.0"}
    )
    with serving(create_app(settings)) as client:
        yield client


def version_of(response: httpx.Response) -> str:
    assert response.status_code == 200, response.text
    return str(response.json()["model"]["version"])


@pytest.mark.parametrize(
    ("category", "expected"),
    [
        ("debug", "0.9.0"),
        ("auto", "0.9.0"),
        ("debug@0.9.0", "0.9.0"),
        ("debug@1.0.0", "1.0.0"),
        ("debug@2.0.0", "2.0.0"),
    ],
)
def test_a_client_picks_a_version(versions: httpx.Client, category: str, expected: str) -> None:
    form = {"category": category}
    assert version_of(versions.post("/infer", data=form, files=BOX)) == expected
    accept = {"Accept": "application/json"}
    form["edits"] = '{"width": {"scale": 2}}'
    assert version_of(versions.post("/edit", data=form, files=BOX, headers=accept)) == expected
    del form["edits"]
    for path in ("/sliders", "/template"):
        response = versions.post(path, data=form, files=BOX)
        assert response.status_code == 200
        assert f'"version":"{expected}"'.encode() in response.content.replace(b": ", b":")


def test_each_category_is_listed_once_with_its_versions(versions: httpx.Client) -> None:
    listed = Categories.model_validate_json(versions.get("/categories").content, extra="forbid")
    (category,) = listed.categories
    assert (category.name, category.model.version) == ("debug", "0.9.0")
    assert [(v.name, v.version, v.default) for v in category.versions] == [
        ("debug@2.0.0", "2.0.0", False),
        ("debug@1.0.0", "1.0.0", False),
        ("debug@0.9.0", "0.9.0", True),
    ]
    assert category.versions[2].digest == category.model.digest


def test_a_version_is_described_under_its_name(versions: httpx.Client) -> None:
    answer = versions.get("/categories/debug@2.0.0")
    category = Category.model_validate_json(answer.content, extra="forbid")
    assert (category.name, category.model.version) == ("debug", "2.0.0")
    assert len(category.versions) == 3


def test_another_version_is_refused_with_those_that_there_are(
    versions: httpx.Client, problem: Any
) -> None:
    document = problem(versions.get("/categories/debug@3"), 404, "unknown_category")
    assert document.detail == "There is no version '3' of debug."
    assert "debug@2.0.0, debug@1.0.0, debug@0.9.0" in document.suggestion
    response = versions.post("/infer", data={"category": "debug@3"}, files=BOX)
    assert "debug@1.0.0" in problem(response, 422, "unknown_category").suggestion


def test_probes_and_the_document_know_all_of_them(versions: httpx.Client) -> None:
    names = ["debug", "debug@0.9.0", "debug@1.0.0", "debug@2.0.0"]
    ready = Ready.model_validate_json(versions.get("/readyz").content, extra="forbid")
    assert list(ready.models) == names
    assert ready.models["debug"] == ready.models["debug@0.9.0"]
    schemas = versions.get("/openapi.json").json()["components"]["schemas"]
    for form in ("InferForm", "EditForm", "SlidersForm"):
        assert schemas[form]["properties"]["category"]["enum"] == ["auto", *names]


def test_a_default_that_is_not_installed_is_told_and_another_serves(
    own: Path, tmp_path: Path, serve: Any
) -> None:
    shutil.copytree(own / "2.0.0", tmp_path / "models")
    client = serve(
        create_app(
            Settings(
                categories=("debug",),
                models_dir=tmp_path / "models",
                default_models={"debug": "7.0.0"},
            )
        )
    )
    assert version_of(client.post("/infer", files=BOX)) == "2.0.0"
    ready = Ready.model_validate_json(client.get("/readyz").content)
    (fault,) = ready.faults
    assert fault.code == "default_missing"
    assert "debug=7.0.0" in fault.detail
    assert "2.0.0, 1.0.0" in fault.suggestion


def test_only_the_categories_that_are_asked_for_are_loaded(serve: Any, problem: Any) -> None:
    client = serve(create_app(Settings(categories=("debug",))))
    assert [c["name"] for c in client.get("/categories").json()["categories"]] == ["debug"]
    response = client.post("/infer", data={"category": "chair"}, files=BOX)
    assert problem(response, 422, "unknown_category").suggestion == "Use one of debug, or auto."


def test_without_any_category_it_says_what_to_do(serve: Any, problem: Any) -> None:
    client = serve(create_app(Settings(categories=())))
    assert client.post("/infer", files=BOX).status_code == 503
    document = problem(client.get("/readyz"), 503, "model_fault")
    assert "CATEGORIES" in document.suggestion


def test_models_that_are_replaced_are_freed_whatever_is_kept_of_requests(
    tmp_path: Path, serve: Any
) -> None:
    app = create_app(Settings(categories=(), models_dir=tmp_path))
    write_model(tmp_path, "1.0.0")
    client = serve(app)
    readiness = app.state.context.readiness
    sessions = []
    for turn in range(5):
        sent = client.post("/infer", files=BOX).json()
        assert sent["model"]["version"] == f"1.{turn}.0"
        edit = {"mesh_id": sent["mesh_id"], "edits": '{"width": 1}'}
        assert client.post("/edit", data=edit).status_code == 200
        sessions.append(weakref.ref(readiness.installed.models["debug"]._session._session))
        write_model(tmp_path, f"1.{turn + 1}.0")
        anyio.run(readiness.reload)
    # A worker's thread may not have left its last request yet.
    for _ in range(100):
        gc.collect()
        if not any(session() for session in sessions):
            break
        time.sleep(0.05)
    assert [session() for session in sessions] == [None] * 5
    assert readiness.installed.models["debug"].version == "1.5.0"
