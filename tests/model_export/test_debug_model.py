from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from model_export import debug_model
from service.encode.discriminator import Discriminator
from service.encode.model import SHIPPED
from service.encode.session import EncoderSession
from service.mesh.frame import orientations


def test_the_shipped_files_come_out_again(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    debug_model.main(["--out", str(tmp_path)])
    assert "debug.json" in capsys.readouterr().out
    names = sorted(path.name for path in tmp_path.iterdir())
    assert names == ["debug.discriminator.onnx", "debug.json", "debug.onnx"]
    for name in names:
        assert (tmp_path / name).read_bytes() == (SHIPPED / name).read_bytes(), name


def test_a_version_can_be_named(tmp_path: Path) -> None:
    debug_model.main(["--out", str(tmp_path), "--version", "2.0.0"])
    assert '"version": "2.0.0"' in (tmp_path / "debug.json").read_text("utf-8")


def test_the_encoder_measures_a_cloud(tmp_path: Path) -> None:
    debug_model.write_encoder(tmp_path / "any.onnx", 20)
    cloud = np.random.default_rng(0).normal(size=(20, 3)).astype(np.float32)
    low, high = cloud.min(axis=0), cloud.max(axis=0)
    answer = EncoderSession(tmp_path / "any.onnx").run(cloud)
    np.testing.assert_allclose(answer, [*(high - low), *(high + low) / 2], rtol=1e-6)


def test_the_discriminator_takes_all_alike(tmp_path: Path) -> None:
    debug_model.write_discriminator(tmp_path / "any.onnx")
    cloud = np.random.default_rng(0).normal(size=(20, 3))
    ways = orientations("auto", "auto")
    odds = Discriminator(tmp_path / "any.onnx").odds(cloud, ways)
    assert odds.tolist() == [0.0] * len(ways)
