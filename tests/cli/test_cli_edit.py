from __future__ import annotations

import json
from pathlib import Path

import pytest
from cli_runs import Run, box, documents, extents


def test_an_edit_is_typed_with_units(anywhere: Run, box_glb: Path, tmp_path: Path) -> None:
    out = tmp_path / "wide.glb"
    line = ["edit", box_glb, "width=120%", "total_height=45cm", "depth+=2in", "-o", out]
    done = anywhere(*line, "-c", "debug")
    assert done.exit_code == 0, done.output
    assert extents(out) == pytest.approx([0.48, 0.45, 0.5508], abs=1e-4)
    assert done.stdout.splitlines()[0] == f"debug: 8 of 8 vertices moved -> {out}"
    (row,) = (line for line in done.stdout.splitlines() if line.startswith("width"))
    assert row.split() == ["width", "0.4000", "0.4800", "m", "+20.0", "%"]
    assert "asked 0.45" in done.stdout


def test_units_are_those_of_the_file(anywhere: Run, tmp_path: Path) -> None:
    file, out = tmp_path / "box.obj", tmp_path / "wide.obj"
    file.write_text(str(box(40, 80, 50).export(file_type="obj")), "utf-8")
    done = anywhere("edit", file, "width=0.6m", "depth=55", "-u", "cm", "-o", out, "-c", "debug")
    assert done.exit_code == 0, done.output
    assert extents(out) == pytest.approx([60.0, 80.0, 55.0], abs=1e-3)


def test_ranges_are_kept(anywhere: Run, box_glb: Path, tmp_path: Path) -> None:
    out = tmp_path / "fits.glb"
    done = anywhere("edit", box_glb, "total_height=..70cm", "-o", out, "-c", "debug")
    assert done.exit_code == 0, done.output
    assert extents(out)[1] == pytest.approx(0.7, abs=1e-4)
    assert "asked at most 0.7" in done.stdout


def test_json_edits_and_constraints(anywhere: Run, box_glb: Path, tmp_path: Path) -> None:
    out, edits = tmp_path / "x.glb", tmp_path / "edits.json"
    edits.write_text('{"width": {"scale": 2}}', "utf-8")
    constraints = '{"total_height": {"max": 0.7}}'
    line = ["edit", box_glb, "--edits", f"@{edits}", "--constraints", constraints, "-c", "debug"]
    (report,) = documents(anywhere(*line, "-o", out, "--json"))
    assert report["output"] == str(out)
    assert report["file"] == str(box_glb)
    assert report["parameters"]["width"]["after"] == pytest.approx(0.8, abs=1e-4)
    assert extents(out) == pytest.approx([0.8, 0.7, 0.5], abs=1e-4)


def test_both_write_the_same_and_tell_the_same(
    shape_edit: Run, debug_url: str, box_glb: Path, tmp_path: Path
) -> None:
    for more in (["--json"], [], ["--format", "stl"], ["--keep", "center", "--mode", "paper"]):
        line = ["edit", box_glb, "width*=1.5", "total_height=..70cm", "-c", "debug", *more]
        out = tmp_path / "same"
        here = shape_edit(*line, "-o", out, "-f")
        data = out.read_bytes()
        there = shape_edit(*line, "-o", out, "-f", "--url", debug_url)
        assert here.exit_code == there.exit_code == 0, here.output + there.output
        assert here.stdout == there.stdout
        assert out.read_bytes() == data


@pytest.mark.parametrize(
    ("edits", "code"),
    [
        (["zebra=1"], "unknown_parameter"),
        (["width=-1"], "size_not_positive"),
        (["width=30deg"], "unit_mismatch"),
        (["total_height=0.5..0.6", "height=0.9"], "constraints_conflict"),
        (["width=1", "--keep", "nose"], "unknown_keep"),
        (["--edits", '{"width": "wide"}'], "edit_malformed"),
        (["--constraints", '{"width": {"max": true}}'], "constraint_malformed"),
    ],
)
def test_both_refuse_in_the_same_words(
    shape_edit: Run, debug_url: str, box_glb: Path, tmp_path: Path, edits: list[str], code: str
) -> None:
    out = tmp_path / "never.glb"
    line = ["edit", box_glb, *edits, "-c", "debug", "-o", out, "--json"]
    here, there = shape_edit(*line), shape_edit(*line, "--url", debug_url)
    assert here.exit_code == there.exit_code == 1, here.output + there.output
    (one,), (two,) = documents(here), documents(there)
    assert one["code"] == code
    two.pop("trace_id", None)
    assert one == two
    assert not out.exists()


def test_several_files_go_to_a_folder(
    anywhere: Run, box_glb: Path, tall_glb: Path, tmp_path: Path
) -> None:
    bad = tmp_path / "bad.glb"
    bad.write_bytes(b"no mesh")
    line = ["edit", box_glb, bad, tall_glb, "width=1m", "-c", "debug", "-o", f"{tmp_path}/new/"]
    done = anywhere(*line)
    assert done.exit_code == 1
    assert sorted(path.name for path in (tmp_path / "new").iterdir()) == ["box.glb", "tall.glb"]
    assert extents(tmp_path / "new" / "tall.glb") == pytest.approx([1.0, 1.6, 0.6], abs=1e-4)
    assert f"1 of 3 files failed: {bad}" in done.stderr


def test_results_lie_beside_the_input_and_replace_nothing(anywhere: Run, box_glb: Path) -> None:
    line = ["edit", box_glb, "width=1m", "-c", "debug"]
    assert anywhere(*line).exit_code == 0
    beside = box_glb.with_name("box-edited.glb")
    assert extents(beside)[0] == pytest.approx(1.0, abs=1e-4)
    again = anywhere("edit", box_glb, "width=2m", "-c", "debug")
    assert again.exit_code == 1
    assert "file_exists" in again.stderr
    assert extents(beside)[0] == pytest.approx(1.0, abs=1e-4)
    assert anywhere("edit", box_glb, "width=2m", "-c", "debug", "--force").exit_code == 0
    assert extents(beside)[0] == pytest.approx(2.0, abs=1e-4)


def test_a_dry_run_writes_nothing(anywhere: Run, box_glb: Path) -> None:
    done = anywhere("edit", box_glb, "width=1m", "-c", "debug", "--dry-run")
    assert done.exit_code == 0
    assert done.stdout.splitlines()[0] == "debug: 8 of 8 vertices moved"
    assert [path.name for path in box_glb.parent.iterdir()] == ["box.glb"]


def test_a_mesh_goes_through_a_pipe(anywhere: Run, box_glb: Path, tmp_path: Path) -> None:
    line = ["edit", "-", "width=1m", "-c", "debug", "-o", "-"]
    done = anywhere(*line, piped=box_glb.read_bytes())
    assert done.exit_code == 0, done.stderr
    out = tmp_path / "out.glb"
    out.write_bytes(done.stdout_bytes)
    assert extents(out)[0] == pytest.approx(1.0, abs=1e-4)
    assert "debug: 8 of 8 vertices moved -> standard output" in done.stderr
    assert anywhere(*line, "-q", piped=box_glb.read_bytes()).stderr == ""


def test_another_format_is_told_to_be_bare(anywhere: Run, box_glb: Path, tmp_path: Path) -> None:
    out = tmp_path / "wide.ply"
    done = anywhere("edit", box_glb, "width=1m", "-c", "debug", "-o", out)
    assert done.exit_code == 0
    assert out.read_bytes().startswith(b"ply")
    assert "Warning: it is ply now: the geometry alone" in done.stdout


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["edit"], "Name a mesh file"),
        (["edit", "width=1"], "Name a mesh file"),
        (["edit", "a.glb"], "Say what to change"),
        (["edit", "a.glb", "width=wide"], "is no number"),
        (["edit", "a.glb", "b.glb", "width=1", "-o", "c.glb"], "-o DIR/"),
        (["edit", "a.glb", "width=1", "-o", "-", "--json"], "--json"),
    ],
)
def test_lines_that_make_no_sense(shape_edit: Run, arguments: list[str], told: str) -> None:
    done = shape_edit(*arguments)
    assert done.exit_code == 2
    assert told in done.stderr


def test_a_chair_is_edited_without_a_word_of_what_it_is(
    shape_edit: Run, chair_glb: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CATEGORIES", "chair")
    file, out = tmp_path / "chair.glb", tmp_path / "high.glb"
    file.write_bytes(chair_glb)
    done = shape_edit("edit", file, "seat_top_height=50cm", "-o", out, "--json")
    assert done.exit_code == 0, done.output
    report = json.loads(done.stdout)
    assert report["category"] == "chair"
    assert report["dimensions"]["seat_top_height"]["after"] == pytest.approx(0.5)
