from __future__ import annotations

from pathlib import Path

import pytest

from service.mesh.formats import read_mesh

from .corpus import LARGEST, chair, formats, gathered, seeds
from .oracle import examine


@pytest.mark.parametrize("format", formats())
def test_every_seed_is_sound(format: str) -> None:
    assert len(seeds(format)) >= 2
    for data in gathered(format, None):
        assert examine(data, format).code == ""


def test_the_chair_stands_on_the_floor() -> None:
    vertices = read_mesh(chair("ply"), "a.ply").vertices
    assert vertices[:, 1].min() == 0
    assert 0.5 < vertices[:, 1].max() < 1.5


def test_files_of_a_folder(tmp_path: Path) -> None:
    (tmp_path / "deep").mkdir()
    (tmp_path / "deep" / "one.OFF").write_bytes(b"OFF one")
    (tmp_path / "two.off").write_bytes(b"OFF two")
    (tmp_path / "large.off").write_bytes(bytes(LARGEST + 1))
    (tmp_path / "other.obj").write_bytes(b"v")
    assert gathered("off", tmp_path) == [b"OFF one", b"OFF two"]
    with pytest.raises(FileNotFoundError, match="stl"):
        gathered("stl", tmp_path)
