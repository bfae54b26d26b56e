from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from cli_runs import Run, documents, extents
from fastapi import FastAPI
from starlette.responses import PlainTextResponse

from service.api.keys import digest_of
from service.main import create_app
from service.settings import Settings


def test_nobody_there(shape_edit: Run, box_glb: Path) -> None:
    from service.client.retry import Retry

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Retry, "attempts", 1)
        line = ["infer", box_glb, box_glb, "--url", "http://127.0.0.1:9", "--json"]
        done = shape_edit(*line)
    assert done.exit_code == 3
    (problem,) = documents(done)  # the second is not even tried
    assert problem["code"] == "unreachable"


def test_somebody_else_there(shape_edit: Run, box_glb: Path, serve: Callable[..., object]) -> None:
    other = FastAPI()
    other.add_api_route("/infer", lambda: PlainTextResponse("hello"), methods=["POST"])
    client = serve(other)
    done = shape_edit("infer", box_glb, "--url", str(client.base_url))  # type: ignore[attr-defined]
    assert done.exit_code == 3
    assert "answer_malformed" in done.stderr


@pytest.mark.parametrize("url", ["ftp://x", "localhost"])
def test_a_url_that_is_none(shape_edit: Run, box_glb: Path, url: str) -> None:
    assert shape_edit("infer", box_glb, "--url", url).exit_code == 2


def test_a_key_lets_in(shape_edit: Run, box_glb: Path, serve: Callable[..., object]) -> None:
    key = "shape_" + "k" * 43
    keys = f"alice:{digest_of(key)}"
    client = serve(create_app(Settings(workers=1, categories=("debug",), api_keys=keys)))
    line = ["infer", box_glb, "-c", "debug", "--url", str(client.base_url)]  # type: ignore[attr-defined]
    refused = shape_edit(*line)
    assert refused.exit_code == 1
    assert "trace_id" in refused.stderr
    assert shape_edit(*line, "--api-key", key).exit_code == 0


def test_a_service_that_keeps_nothing(
    shape_edit: Run, box_glb: Path, serve: Callable[..., object]
) -> None:
    settings = Settings(workers=1, categories=("debug",), mesh_cache_bytes=0)
    url = str(serve(create_app(settings)).base_url)  # type: ignore[attr-defined]
    line = ["edit", box_glb, "width=1m", "-c", "debug", "--url", url]
    done = shape_edit(*line)
    assert done.exit_code == 0, done.output
    assert extents(box_glb.with_name("box-edited.glb"))[0] == pytest.approx(1.0, abs=1e-4)
