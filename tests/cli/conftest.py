"""The command line over boxes, which the model `debug` answers at once: here and at a service."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from cli_runs import Run, box
from click.testing import CliRunner, Result

from service.cli.main import PROGRAM, cli
from service.main import create_app
from service.settings import Settings


@pytest.fixture(autouse=True)
def _plain_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    own = ("SHAPE_URL", "SHAPE_API_KEY", "MODELS_DIR", "BODY_MODEL", "DEFAULT_MODELS", "COLUMNS")
    for name in own:
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("CATEGORIES", "debug")


@pytest.fixture(scope="session")
def debug_url(serving: Any) -> Iterator[str]:
    """A service that knows boxes."""
    with serving(create_app(Settings(workers=2, categories=("debug",)))) as client:
        yield str(client.base_url)


@pytest.fixture
def shape_edit() -> Run:
    """Runs a command line in this process."""

    def run(*arguments: str | Path, piped: bytes | None = None) -> Result:
        return CliRunner().invoke(
            cli, [str(argument) for argument in arguments], piped, prog_name=PROGRAM
        )

    return run


@pytest.fixture(params=["local", "remote"])
def anywhere(request: pytest.FixtureRequest, shape_edit: Run) -> Run:
    """The same, with each command done here and at a service."""
    if request.param == "local":
        return shape_edit
    url = request.getfixturevalue("debug_url")
    return lambda *arguments, **more: shape_edit(*arguments, "--url", url, **more)


@pytest.fixture
def box_glb(tmp_path: Path) -> Path:
    """A file with a box of 0.4, 0.8 and 0.5 m."""
    path = tmp_path / "box.glb"
    path.write_bytes(bytes(box().export(file_type="glb")))
    return path


@pytest.fixture
def tall_glb(tmp_path: Path) -> Path:
    """A file with a box of 0.3, 1.6 and 0.6 m."""
    path = tmp_path / "tall.glb"
    path.write_bytes(bytes(box(0.3, 1.6, 0.6).export(file_type="glb")))
    return path
