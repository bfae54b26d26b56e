from __future__ import annotations

from pathlib import Path

import pytest
from cli_runs import Run, box, documents, extents


def test_one_takes_the_parameters_of_the_other(
    anywhere: Run, box_glb: Path, tall_glb: Path, tmp_path: Path
) -> None:
    out = tmp_path / "like.glb"
    done = anywhere("transfer", box_glb, tall_glb, "-c", "debug", "-o", out)
    assert done.exit_code == 0, done.output
    assert extents(out) == pytest.approx([0.3, 1.6, 0.6], abs=1e-3)
    assert f"-> {out}" in done.stdout


def test_some_of_them_alone(anywhere: Run, box_glb: Path, tall_glb: Path) -> None:
    done = anywhere("transfer", box_glb, tall_glb, "-c", "debug", "-p", "height")
    assert done.exit_code == 0, done.output
    out = box_glb.with_name("box-transfer.glb")
    assert extents(out) == pytest.approx([0.4, 1.6, 0.5], abs=1e-3)


def test_the_target_may_be_in_other_units(anywhere: Run, box_glb: Path, tmp_path: Path) -> None:
    other, out = tmp_path / "other.obj", tmp_path / "like.glb"
    other.write_text(str(box(30, 160, 60).export(file_type="obj")), "utf-8")
    line = ["transfer", box_glb, other, "--target-units", "cm", "-c", "debug", "-o", out]
    assert anywhere(*line).exit_code == 0
    assert extents(out) == pytest.approx([0.3, 1.6, 0.6], abs=1e-3)


def test_both_write_the_same_and_tell_the_same(
    shape_edit: Run, debug_url: str, box_glb: Path, tall_glb: Path, tmp_path: Path
) -> None:
    out = tmp_path / "like.glb"
    for more in (["--json"], ["--size", "source"], ["--position", "target", "--format", "obj"]):
        line = ["transfer", box_glb, tall_glb, "-c", "debug", "-o", out, "-f", *more]
        here = shape_edit(*line)
        data = out.read_bytes()
        there = shape_edit(*line, "--url", debug_url)
        assert here.exit_code == there.exit_code == 0, here.output + there.output
        if more == ["--json"]:
            assert documents(here) == documents(there)
        else:
            assert here.stdout == there.stdout
        assert out.read_bytes() == data


def test_either_may_come_through_a_pipe(anywhere: Run, box_glb: Path, tall_glb: Path) -> None:
    piped = tall_glb.read_bytes()
    (report,) = documents(
        anywhere("transfer", box_glb, "-", "-c", "debug", "--dry-run", "--json", piped=piped)
    )
    assert report["parameters"]["height"]["after"] == pytest.approx(1.6, abs=1e-3)
    assert "output" not in report
    done = anywhere("transfer", "-", tall_glb, "-c", "debug", "-o", "-", piped=box_glb.read_bytes())
    assert done.stdout_bytes.startswith(b"glTF")
    assert anywhere("transfer", "-", "-", piped=piped).exit_code == 2


def test_both_refuse_in_the_same_words(
    shape_edit: Run, debug_url: str, box_glb: Path, tmp_path: Path
) -> None:
    bad = tmp_path / "bad.glb"
    bad.write_bytes(b"no mesh")
    for more in ([bad], [box_glb, "-p", "zebra"], [box_glb, "--keep", "nose"]):
        line = ["transfer", box_glb, *more, "-c", "debug", "--json", "-n"]
        here, there = shape_edit(*line), shape_edit(*line, "--url", debug_url)
        assert here.exit_code == there.exit_code == 1, here.output + there.output
        (one,), (two,) = documents(here), documents(there)
        two.pop("trace_id", None)
        assert one == two
