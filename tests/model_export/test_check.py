from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
from matplotlib import image

import service
from model_export.check import check, main
from model_export.new import starter
from service.template.loader import load_template


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "table.yaml"
    path.write_text(starter("table", "table.yaml"), "utf-8")
    return path


def test_a_sound_template_is_drawn_and_written_as_a_mesh(
    file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sheet, mesh = tmp_path / "sheet.png", tmp_path / "rest.obj"
    assert main([str(file), "--out", str(sheet), "--mesh", str(mesh)]) == 0
    said = capsys.readouterr().out
    template = load_template(file)
    assert "5 parameters, 5 parts" in said
    assert f"{len(template.base)} vertices for clouds of 2048 points" in said
    picture = image.imread(sheet)[:, :, :3]
    # Two rows of extremes below the rest shape, in three colours.
    height = len(picture)
    yellow = (picture[:, :, 0] > picture[:, :, 2] + 0.2).any(axis=1)
    blue = (picture[:, :, 2] > picture[:, :, 0] + 0.2).any(axis=1)
    assert yellow[: height // 2].any()
    assert not yellow[height // 2 :].any()
    assert blue[height // 2 :].any()
    assert not blue[: height // 3].any()
    rest = trimesh.load_mesh(mesh, process=False)
    assert rest.bounds[0][1] == pytest.approx(0)
    low, high = template.decode(template.low), template.decode(template.high)
    assert (rest.extents > np.ptp(low, axis=0)).all()
    assert (rest.extents < np.ptp(high, axis=0)).all()


def test_variants_are_drawn_too(file: Path, tmp_path: Path) -> None:
    def yellow_rows() -> int:
        assert main([str(file), "--out", str(tmp_path / "sheet.png")]) == 0
        picture = image.imread(tmp_path / "sheet.png")[:, :, :3]
        return int((picture[:, :, 0] > picture[:, :, 2] + 0.2).any(axis=1).sum())

    before = yellow_rows()
    text = file.read_text("utf-8")
    file.write_text(f"{text}\nvariants:\n  one: {{}}\n  other: {{}}\n", "utf-8")
    assert yellow_rows() > before


def test_errors_are_told_apart_from_warnings(
    file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = file.read_text("utf-8")
    file.write_text(text.replace("points: 2048", "points: 100"), "utf-8")
    assert main([str(file)]) == 0
    assert capsys.readouterr().out.startswith("warning: points: ")
    file.write_text(text.replace("[0.30, 2.60]", "[2.60, 0.30]"), "utf-8")
    assert main([str(file), "--out", str(tmp_path / "sheet.png")]) == 1
    assert capsys.readouterr().out.startswith("error: parameters top_width: ")
    assert not (tmp_path / "sheet.png").exists()


@pytest.mark.parametrize("content", [b"a: [", b"\xff\xfe\x00", b"", b"- 1"])
def test_what_is_no_template_is_an_error(file: Path, content: bytes) -> None:
    file.write_bytes(content)
    template, mistakes = check(file)
    assert template is None
    assert [mistake.entry for mistake in mistakes] == ["the file"]


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    assert main([str(tmp_path / "nothing.yaml")]) == 1


SHIPPED = sorted((Path(service.__file__).parent / "template").glob("*.yaml"))


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_the_shipped_templates_are_sound(path: Path) -> None:
    template, mistakes = check(path)
    assert template is not None
    assert [str(mistake) for mistake in mistakes if mistake.error] == []
