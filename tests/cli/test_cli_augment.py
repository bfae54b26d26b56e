from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from cli_runs import Run, documents
from pyarrow import parquet


@pytest.fixture
def boxes(box_glb: Path, tall_glb: Path) -> Path:
    """A folder of two boxes and of what is none."""
    folder = box_glb.parent / "boxes"
    folder.mkdir()
    for path in (box_glb, tall_glb):
        shutil.move(path, folder / path.name)
    (folder / "bad.glb").write_bytes(b"no mesh")
    return folder


def test_a_folder_becomes_variants_and_a_bad_file_stops_nothing(
    shape_edit: Run, boxes: Path, tmp_path: Path
) -> None:
    out = tmp_path / "varied"
    line = ["augment", boxes, "--out", out, "-n", "2", "-c", "debug", "--workers", "1"]
    done = shape_edit(*line, "--keep", "center", "--format", "ply")
    assert done.exit_code == 1, done.output
    assert "Failed: bad.glb: malformed_glb" in done.stdout
    rows = parquet.read_table(out / "manifest").to_pylist()
    assert [row["format"] for row in rows if row["status"] == "ok"] == ["ply"] * 4
    assert all((out / row["file"]).is_file() for row in rows if row["file"])
    (summary,) = documents(shape_edit(*line, "--keep", "center", "--format", "ply", "--json"))
    seconds = summary.pop("seconds")
    assert seconds >= 0
    assert summary == {
        "out": str(out), "sources": 3, "copies": 0, "kept": 3, "done": 0, "failed": 0,
        "ok": 0, "rejected": 0, "failures": [],
    }  # fmt: skip
    other = shape_edit(*line, "--seed", "2", "--json")
    assert other.exit_code == 1
    (problem,) = documents(other)
    assert problem["code"] == "options_differ"


@pytest.mark.parametrize(
    ("more", "code"),
    [
        (["--shard", "3/2"], "shard_malformed"),
        (["-n", "0"], "count_out_of_range"),
        (["--strength", "2"], "strength_out_of_range"),
        (["--workers", "0"], "workers_out_of_range"),
    ],
)
def test_options_that_make_no_sense(
    shape_edit: Run, boxes: Path, tmp_path: Path, more: list[str], code: str
) -> None:
    done = shape_edit("augment", boxes, "--out", tmp_path / "out", "-c", "debug", *more)
    assert done.exit_code == 1
    assert code in done.stderr
    assert not (tmp_path / "out").exists()


def test_a_folder_that_there_is_none_of(shape_edit: Run, tmp_path: Path) -> None:
    assert shape_edit("augment", tmp_path / "none", "--out", tmp_path / "out").exit_code == 2
