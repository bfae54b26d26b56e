from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from service.encode.session import EncoderSession, file_digest
from service.errors import ModelFault


def test_a_cloud_becomes_a_row_of_numbers(tmp_path: Path, write_network: Any) -> None:
    session = EncoderSession(write_network(tmp_path / "a.onnx", [1.5, -2.0]))
    assert session.points == 50
    cloud = np.random.default_rng(0).normal(size=(50, 3))
    answer = session.run(cloud)
    assert (answer.shape, answer.dtype) == ((5,), np.float64)
    np.testing.assert_allclose(answer, [1.5, -2.0, *cloud.max(axis=0)], rtol=1e-6)


def test_any_layout_and_precision_will_do(tmp_path: Path, write_network: Any) -> None:
    session = EncoderSession(write_network(tmp_path / "a.onnx", []), threads=2)
    cloud = np.random.default_rng(0).normal(size=(50, 3)).astype(np.float32)
    expected = session.run(cloud)
    assert np.array_equal(session.run(np.asfortranarray(cloud)), expected)
    assert np.array_equal(session.run(np.repeat(cloud, 2, axis=0)[::2]), expected)
    assert np.array_equal(session.run(cloud.astype(np.float64)), expected)


@pytest.mark.parametrize(
    "shape", [(1, "points", 3), (2, 50, 3), (1, 50, 4), (50, 3), (1, 1, 50, 3)]
)
def test_a_network_of_another_shape_is_refused(
    tmp_path: Path, write_network: Any, shape: tuple[int | str, ...]
) -> None:
    path = write_network(tmp_path / "odd.onnx", [], shape)
    with pytest.raises(ModelFault) as caught:
        EncoderSession(path)
    assert caught.value.code == "model_shape"
    assert caught.value.detail.startswith("odd.onnx takes ")


def test_a_file_with_another_digest_is_not_even_parsed(tmp_path: Path, write_network: Any) -> None:
    path = write_network(tmp_path / "a.onnx", [])
    assert EncoderSession(path, digest=file_digest(path)).points == 50
    path.write_bytes(path.read_bytes()[:-1])
    with pytest.raises(ModelFault) as caught:
        EncoderSession(path, digest="sha256-00")
    assert caught.value.code == "model_digest"
    assert caught.value.detail == f"a.onnx is {file_digest(path)}, its card says sha256-00"
    path.unlink()
    with pytest.raises(ModelFault) as caught:
        EncoderSession(path, digest="sha256-00")
    assert caught.value.code == "model_file_missing"


@pytest.mark.parametrize("content", [b"", b"no network", None])
def test_a_file_that_is_no_network_is_refused(tmp_path: Path, content: bytes | None) -> None:
    path = tmp_path / "bad.onnx"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(ModelFault) as caught:
        EncoderSession(path)
    assert caught.value.code == "model_unreadable"
    assert "bad.onnx" in caught.value.detail


PROGRAM = """
from service.encode.model import SHIPPED, load_models
load_models(SHIPPED, names=["debug"])["debug"].verify()
"""


def test_onnxruntime_reports_to_nobody(tmp_path: Path) -> None:
    environment = {**os.environ, "HOME": str(tmp_path), "XDG_CACHE_HOME": str(tmp_path)}
    environment.pop("ORT_DISABLE_TELEMETRY", None)
    subprocess.run([sys.executable, "-c", PROGRAM], env=environment, check=True, timeout=120)
    # It would gather what it sends in the user's cache.
    assert list(tmp_path.rglob("*onnxruntime*")) == []
