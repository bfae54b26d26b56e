from __future__ import annotations

from pathlib import Path

import pytest
from cli_runs import Run, box, documents


def test_people_get_a_table(anywhere: Run, box_glb: Path) -> None:
    done = anywhere("infer", box_glb, "-c", "debug")
    assert done.exit_code == 0, done.output
    lines = done.stdout.splitlines()
    assert lines[0].startswith("debug 1.0.0")
    (width,) = (line for line in lines if line.startswith("width"))
    assert width.split()[:4] == ["width", "0.4000", "0", "m"]
    assert "●" in width
    assert width.rstrip().endswith("0.2 to 2")
    assert done.stderr == ""


def test_programs_get_one_document_and_nothing_else(anywhere: Run, box_glb: Path) -> None:
    done = anywhere("infer", box_glb, "-c", "debug", "-u", "cm", "--json")
    (report,) = documents(done)
    assert report["file"] == str(box_glb)
    assert report["parameters"]["width"] == {
        "value": pytest.approx(40.0, abs=1e-3),
        "sigma": 0.0,
        "unit": "cm",
    }
    assert report["mesh_id"].startswith("sha256-")
    assert done.stderr == ""


def test_both_answer_the_same(shape_edit: Run, debug_url: str, box_glb: Path) -> None:
    for arguments in ([], ["--json"], ["--no-refine", "-u", "in"], ["--up", "+z"]):
        line = ["infer", box_glb, "-c", "debug", *arguments]
        here, there = shape_edit(*line), shape_edit(*line, "--url", debug_url)
        assert here.exit_code == there.exit_code == 0
        assert here.stdout == there.stdout


def test_a_bad_file_stops_none_of_the_others(anywhere: Run, box_glb: Path, tmp_path: Path) -> None:
    bad = tmp_path / "bad.glb"
    bad.write_bytes(b"no mesh")
    files = [tmp_path / "none.glb", box_glb, bad, box_glb]
    done = anywhere("infer", *files, "-c", "debug")
    assert done.exit_code == 1
    assert done.stdout.count("debug 1.0.0") == 2
    assert done.stdout.count(str(box_glb)) == 2
    assert "file_missing" in done.stderr
    assert "malformed_glb" in done.stderr
    assert done.stderr.splitlines()[-1] == f"2 of 4 files failed: {files[0]}, {bad}"


def test_problems_are_documents_among_the_others(
    anywhere: Run, box_glb: Path, tmp_path: Path
) -> None:
    bad = tmp_path / "bad.glb"
    bad.write_bytes(b"no mesh")
    done = anywhere("infer", bad, box_glb, tmp_path, "-c", "debug", "--json")
    assert done.exit_code == 1
    one, two, three = documents(done)
    assert {one.pop(name, None) for name in ("status", "title", "type", "trace_id")}
    assert one == {
        "file": str(bad),
        "code": "malformed_glb",
        "detail": "The GLB file can't be read: it does not begin with a glTF header.",
        "suggestion": "Export the mesh again and check that the upload is complete.",
    }
    assert two["category"] == "debug"
    assert three["code"] == "file_is_folder"
    assert done.stderr == ""


def test_a_mesh_comes_through_a_pipe(anywhere: Run, box_glb: Path) -> None:
    done = anywhere("infer", "-", "-c", "debug", "--json", piped=box_glb.read_bytes())
    (report,) = documents(done)
    assert report["file"] == "-"
    assert report["parameters"]["height"]["value"] == pytest.approx(0.8, abs=1e-5)


def test_its_name_tells_the_format(anywhere: Run) -> None:
    piped = str(box().export(file_type="obj")).encode()
    named = anywhere("infer", "-", "-c", "debug", "--name", "box.obj", piped=piped)
    assert named.exit_code == 0, named.output
    wrong = anywhere("infer", "-", "-c", "debug", "--name", "box.glb", piped=piped)
    assert wrong.exit_code == 1
    assert "malformed_glb" in wrong.stderr


def test_quiet_tells_problems_alone(anywhere: Run, box_glb: Path, tmp_path: Path) -> None:
    done = anywhere("infer", box_glb, tmp_path / "none.glb", "-c", "debug", "--quiet")
    assert done.exit_code == 1
    assert done.stdout == ""
    assert "file_missing" in done.stderr


def test_a_category_that_there_is_none_of(anywhere: Run, box_glb: Path) -> None:
    done = anywhere("infer", box_glb, "-c", "zebra")
    assert done.exit_code == 1
    assert "unknown_category" in done.stderr
    assert "There is no category 'zebra'." in done.stderr
    assert "Use one of debug, or auto." in done.stderr


@pytest.mark.parametrize(
    "arguments",
    [["infer"], ["infer", "a.glb", "--up", "sideways"], ["infer", "a.glb", "-u", "parsec"], ["no"]],
)
def test_lines_that_make_no_sense(shape_edit: Run, arguments: list[str]) -> None:
    done = shape_edit(*arguments)
    assert done.exit_code == 2
    assert done.stdout == ""
    assert "Usage:" in done.stderr


def test_a_setting_that_makes_no_sense(
    shape_edit: Run, box_glb: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CATEGORIES", "zebra")
    done = shape_edit("infer", box_glb)
    assert done.exit_code == 2
    assert "CATEGORIES='zebra'" in done.stderr
