from __future__ import annotations

from pathlib import Path

import pytest

from model_export.config import SHIPPED
from model_export.dimension_report import WAYS, Result, judge, table, uploads
from service.encode.model import load_models


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory, chair_glb: bytes) -> list[Result]:
    folder: Path = tmp_path_factory.mktemp("meshes")
    (folder / "chair.glb").write_bytes(chair_glb)
    (folder / "nothing.glb").write_bytes(b"glTF")
    found = uploads(folder, load_models(SHIPPED), "chair", 1)
    return [result for upload in found for result in judge(upload)]


def test_each_dimension_is_asked_for_twice_in_each_way(results: list[Result]) -> None:
    assert len(results) == 4 * 2 * len(WAYS)
    # The mesh is nearly the template itself: even the fit knows its seat.
    assert all(result.error is not None and result.error < 0.01 for result in results)
    by_mesh = [r.error for r in results if r.way != "edit, by the fit"]
    assert max(error for error in by_mesh if error is not None) < 1e-6


def test_the_table_has_a_row_a_dimension_and_way() -> None:
    rows = [Result("a", "edit", 0.0), Result("a", "edit", 0.02), Result("a", "edit", None)]
    head, _, row, other = table([*rows, Result("b", "edit", None)]).splitlines()
    assert head.count("|") == row.count("|") == other.count("|")
    assert "50.0 % of 2 | 1.000 %" in row
    assert row.endswith("| 1 |")
    assert "of 0" in other
