from __future__ import annotations

from pathlib import Path

import pytest

from model_export import new
from model_export.check import check


def run(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> int:
    monkeypatch.setattr("sys.argv", ["new", *arguments])
    try:
        new.main()
    except SystemExit as end:
        return int(end.code or 0)
    return 0


def test_the_starter_is_sound_as_it_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(monkeypatch, "bed_side_table") == 0
    template, mistakes = check(tmp_path / "bed_side_table.yaml")
    assert mistakes == []
    assert template is not None
    assert (template.name, template.label) == ("bed_side_table", "Bed side table")
    assert "{{" not in (tmp_path / "bed_side_table.yaml").read_text("utf-8")


def test_a_file_is_written_over_only_by_force(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text("precious", "utf-8")
    assert run(monkeypatch, "lamp", "--out", str(path)) == 1
    assert "--force" in capsys.readouterr().err
    assert path.read_text("utf-8") == "precious"
    assert run(monkeypatch, "lamp", "--out", str(path), "--force") == 0
    assert "name: lamp" in path.read_text("utf-8")
    assert f"check {path}" in path.read_text("utf-8")


@pytest.mark.parametrize("name", ["Table", "2legs", "a-b", "../x", "auto", "a" * 41, ""])
def test_names_that_the_api_can_not_use_are_refused(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(monkeypatch, name) == 1
    assert "is no name for a category" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
