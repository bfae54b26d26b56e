from __future__ import annotations

from pathlib import Path

import pytest

from model_export.figures.__main__ import SHEETS, main


def run(monkeypatch: pytest.MonkeyPatch, *arguments: object) -> None:
    monkeypatch.setattr("sys.argv", ["figures", *map(str, arguments)])
    main()


def test_one_command_draws_how_an_edit_comes_about(
    folders: dict[str, Path],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    named = [part for kind, folder in folders.items() for part in (f"--{kind}", folder)]
    out = tmp_path / "pictures"
    run(monkeypatch, *named, "--out", out, "--only", "overview")
    assert [path.name for path in out.iterdir()] == ["overview.png"]
    told = capsys.readouterr()
    assert told.out == ""
    for line in ("chair: chair, fit", "plane: airplane, fit", "body: human, fit", "wrote"):
        assert line in told.err


@pytest.mark.parametrize(
    ("arguments", "fault"),
    [
        (["--only", "chairs"], "chairs: it takes a folder of chairs: say --chairs DIR"),
        (["--only", "bodies", "--humans", "nowhere"], "bodies: there is no folder nowhere"),
        (["--only", "sofas"], "invalid choice: 'sofas'"),
    ],
)
def test_what_is_missing_is_told(
    arguments: list[str],
    fault: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as error:
        run(monkeypatch, "--out", tmp_path / "out", *arguments)
    assert error.value.code == 2
    assert fault in capsys.readouterr().err


def test_all_sheets_can_be_drawn_alone() -> None:
    assert list(SHEETS) == ["overview", "chairs", "airplanes", "bodies", "unlike"]
