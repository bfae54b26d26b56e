"""What tests of the whole service share: an app that listens, and meshes to send it."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from pathlib import Path

import httpx
import pytest
import trimesh
import uvicorn
from plain_chair import PLAIN
from pretend_body import posed, write_body_model
from starlette.types import ASGIApp

from service.api.schemas import ProblemDocument
from service.main import create_app
from service.server import listen
from service.settings import Settings
from service.template.bodyfile import load_body
from service.template.loader import load_template
from service.template.skinned import Body, SkinnedTemplate

Serve = Callable[[ASGIApp], httpx.Client]
Serving = Callable[[ASGIApp], AbstractContextManager[httpx.Client]]
CheckProblem = Callable[[httpx.Response, int, str], ProblemDocument]


@contextmanager
def _serving(app: ASGIApp) -> Iterator[httpx.Client]:
    """An app behind a real server on a free port, and a client of it."""
    (listener,) = listen("127.0.0.1", 0)
    server = uvicorn.Server(uvicorn.Config(app, log_config=None))
    thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]})
    thread.start()
    try:
        while not server.started:
            assert thread.is_alive(), "the server did not start"
            time.sleep(0.002)
        port = listener.getsockname()[1]
        with httpx.Client(
            base_url=f"http://127.0.0.1:{port}", timeout=60, trust_env=False
        ) as client:
            yield client
    finally:
        server.should_exit = True
        thread.join()
        listener.close()


@pytest.fixture(scope="session")
def serving() -> Serving:
    """A context manager that starts an app."""
    return _serving


@pytest.fixture
def serve() -> Iterator[Serve]:
    """Starts apps for the length of a test."""
    with ExitStack() as stack:
        yield lambda app: stack.enter_context(_serving(app))


@pytest.fixture(scope="session")
def problem() -> CheckProblem:
    """Checks that an answer is a whole problem document, and gives it back."""

    def check(response: httpx.Response, status: int, code: str) -> ProblemDocument:
        assert response.headers["content-type"] == "application/problem+json", response.text
        document = ProblemDocument.model_validate_json(response.content, extra="forbid")
        assert (response.status_code, document.status, document.code) == (status, status, code)
        assert document.title
        assert document.trace_id == response.headers["trace-id"]
        assert document.detail
        assert document.suggestion
        return document

    return check


@pytest.fixture(scope="session")
def service_client() -> Iterator[httpx.Client]:
    """A client of the service as it is installed, with its models."""
    with _serving(create_app(Settings(workers=2))) as client:
        yield client


@pytest.fixture(scope="session")
def box_chair() -> trimesh.Trimesh:
    """The template at plain values, in metres, standing on y = 0: seat top at 0.46."""
    template = load_template("paper_chair")
    vertices = template.decode([PLAIN[name] for name in template.names])
    vertices = vertices - [0.0, vertices[:, 1].min(), 0.0]
    return trimesh.Trimesh(vertices, template.faces, process=False)


@pytest.fixture(scope="session")
def chair_glb(box_chair: trimesh.Trimesh) -> bytes:
    """The box chair as a GLB file."""
    return bytes(box_chair.export(file_type="glb"))


@pytest.fixture(scope="session")
def human() -> SkinnedTemplate:
    """The shipped body."""
    return load_body()


@pytest.fixture(scope="session")
def strider(human: SkinnedTemplate) -> Body:
    """Someone in mid-stride, in metres."""
    return posed(human)


@pytest.fixture(scope="session")
def body_folder(
    human: SkinnedTemplate, strider: Body, tmp_path_factory: pytest.TempPathFactory
) -> Path:
    """A models folder with a model of bodies that knows but this one."""
    folder = tmp_path_factory.mktemp("body")
    write_body_model(folder, human, strider)
    return folder
