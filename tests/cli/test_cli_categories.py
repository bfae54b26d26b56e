from __future__ import annotations

from pathlib import Path

import pytest
from cli_runs import Run, documents

from service.api.schemas import Categories, Category


def test_people_get_tables(anywhere: Run) -> None:
    listed = anywhere("categories")
    assert listed.exit_code == 0, listed.output
    (row,) = (line for line in listed.stdout.splitlines() if line.startswith("debug"))
    assert "width, height, depth" in row
    told = anywhere("categories", "debug")
    assert told.stdout.splitlines()[0].startswith("Box (for tests): debug 1.0.0; keeps floor")
    assert any(line.startswith("total_height") for line in told.stdout.splitlines())


def test_both_answer_the_same(shape_edit: Run, debug_url: str) -> None:
    for line in (["categories"], ["categories", "debug"], ["categories", "debug@1.0.0"]):
        for more in ([], ["--json"]):
            here = shape_edit(*line, *more)
            there = shape_edit(*line, *more, "--url", debug_url)
            assert here.exit_code == there.exit_code == 0, here.output + there.output
            assert here.stdout == there.stdout


def test_programs_get_what_the_service_answers(shape_edit: Run) -> None:
    (listed,) = documents(shape_edit("categories", "--json"))
    assert Categories.model_validate(listed).categories[0].name == "debug"
    (told,) = documents(shape_edit("categories", "debug", "--json"))
    assert Category.model_validate(told).versions[0].default


@pytest.mark.parametrize("more", [[], ["--json"]])
def test_a_name_that_there_is_none_of(anywhere: Run, more: list[str]) -> None:
    done = anywhere("categories", "zebra", *more)
    assert done.exit_code == 1
    said = done.stdout if more else done.stderr
    assert "unknown_category" in said
    assert "There are debug." in said


def test_no_model_at_all(shape_edit: Run, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("CATEGORIES", "none")
    done = shape_edit("categories")
    assert done.exit_code == 1
    assert "no_models" in done.stderr
    monkeypatch.setenv("MODELS_DIR", str(tmp_path / "nowhere"))
    assert "is no folder" in shape_edit("categories").stderr
