from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from model_export.figures import rigid
from model_export.figures.rigid import edit_rows, public_names
from model_export.figures.studio import Studio
from service.template.loader import load_template


@pytest.mark.parametrize(("category", "count"), [("airplane", 6), ("chair", 8)])
def test_edits_are_drawn_of_what_users_see(category: str, count: int) -> None:
    names = public_names(SimpleNamespace(template=load_template(category)))
    assert len(names) == count
    assert "wing_sweep" not in names


def test_a_row_is_smaller_and_one_larger(studio: Studio) -> None:
    (subject,) = studio.subjects("chairs", {"any": ""})
    rows = edit_rows(subject, ["seat_width", "leg_height"])
    assert [len(row) for row in rows] == [3, 3]
    widths = [np.ptp(row[1].meshes[0][0][:, 0]) for row in rows]
    heights = [np.ptp(row[2].meshes[0][0][:, 1]) for row in rows]
    own = np.ptp(subject.found.vertices, axis=0)
    assert widths[0] < own[0] < widths[1]
    assert heights[0] < own[1] < heights[1]


@pytest.mark.parametrize("name", ["chairs", "airplanes"])
def test_a_sheet_has_a_row_a_factor(
    name: str, studio: Studio, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(rigid, "public_names", lambda model: [model.template.names[0]])
    path = getattr(rigid, name)(studio)
    assert path == studio.out / f"{name}.png"
    assert path.read_bytes().startswith(b"\x89PNG")
