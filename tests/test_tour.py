"""The notebook docs/tour.ipynb: it runs against the service as it is, and shows what it made."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

import httpx
import numpy as np
import pytest

from model_export import pictures

NOTEBOOK = Path(__file__).parent.parent / "docs" / "tour.ipynb"


@pytest.fixture(scope="module")
def cells() -> list[dict[str, Any]]:
    book = json.loads(NOTEBOOK.read_text("utf-8"))
    return [cell for cell in book["cells"] if cell["cell_type"] == "code"]


def test_the_notebook_was_run_from_top_to_bottom(cells: list[dict[str, Any]]) -> None:
    assert [cell["execution_count"] for cell in cells] == list(range(1, len(cells) + 1))
    outputs = [output for cell in cells for output in cell["outputs"]]
    assert not [output for output in outputs if output["output_type"] == "error"]
    shown = [cell for cell in cells if "show(\n" in _source(cell) or "show([" in _source(cell)]
    assert len(shown) >= 8
    for cell in shown:
        assert any("image/png" in output.get("data", {}) for output in cell["outputs"])


def test_the_notebook_runs(
    cells: list[dict[str, Any]], service_client: httpx.Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SHAPE_URL", str(service_client.base_url))
    monkeypatch.delenv("SHAPE_API_KEY", raising=False)
    sheets: list[Sequence[pictures.Panel]] = []

    def keep(panels: Sequence[pictures.Panel], path: Path, **layout: Any) -> None:
        sheets.append(panels)
        path.touch()

    # Drawing takes most of the time, and is tested with the pictures.
    monkeypatch.setattr(pictures, "save_sheet", keep)
    display = ModuleType("IPython.display")
    display.Image = lambda path: path  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "IPython", ModuleType("IPython"))
    monkeypatch.setitem(sys.modules, "IPython.display", display)

    names: dict[str, Any] = {}
    for cell in cells:
        exec(compile(_source(cell), NOTEBOOK.name, "exec"), names)

    assert len(sheets) >= 8
    drawn = [mesh for sheet in sheets for panel in sheet for mesh in panel.meshes]
    assert all(np.isfinite(vertices).all() and len(faces) for vertices, faces, _, _ in drawn)
    grid = [panel.meshes[0][0] for panel in sheets[2]]
    assert len(grid) == 2 * len(names["names"])
    assert all(not np.array_equal(vertices, names["before"]) for vertices in grid)


def _source(cell: dict[str, Any]) -> str:
    return "".join(cell["source"])
