from __future__ import annotations

import json
from pathlib import Path

import pytest

from model_export.figures.choices import AIRPLANES, CHAIRS, NoMeshes, chosen
from model_export.realistic import find_shapes


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Ten files that nobody reads, and a better one of the first."""
    rows = [{"file": f"{index}.ply", "id": f"shape{index}"} for index in range(10)]
    for row in rows:
        (tmp_path / row["file"]).touch()
    (tmp_path / "better.obj").touch()
    (tmp_path / "manifest.jsonl").write_text("\n".join(map(json.dumps, rows)), "utf-8")
    return tmp_path


def test_the_docs_draw_six_of_each() -> None:
    assert len(CHAIRS) == len(AIRPLANES) == 6


def test_wanted_ones_are_taken_in_order_and_by_their_file(folder: Path) -> None:
    paths = chosen(folder, {"shape3": "", "shape0": "better.obj"})
    assert paths == {"shape3": folder / "3.ply", "shape0": folder / "better.obj"}


def test_another_folder_gives_its_own_held_out_ones_first(folder: Path) -> None:
    held_out = {shape.name for shape in find_shapes(folder) if shape.held_out}
    assert held_out
    paths = chosen(folder, dict.fromkeys("abcd", ""))
    assert len(paths) == 4
    assert set(list(paths)[: len(held_out)]) == held_out
    assert len(chosen(folder, dict.fromkeys(map(str, range(40)), ""))) == 10


def test_what_is_not_there_is_told(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(NoMeshes, match=r"no folder .*nowhere"):
        chosen(tmp_path / "nowhere", {"shape0": ""})
    with pytest.raises(NoMeshes, match=r"lacks shape77, shape78$"):
        chosen(folder, {"shape0": "", "shape77": "", "shape78": ""})
    with pytest.raises(NoMeshes, match=r"no file .*lost\.obj"):
        chosen(folder, {"shape0": "lost.obj"})
    (tmp_path / "empty").mkdir()
    with pytest.raises(NoMeshes, match="no mesh in"):
        chosen(tmp_path / "empty", {"shape0": ""})
