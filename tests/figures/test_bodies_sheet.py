from __future__ import annotations

import numpy as np
import pytest

from model_export.figures import bodies
from model_export.figures.bodies import JOINTS, SHAPES, edit_rows
from model_export.figures.studio import Studio
from service.template.skinned import NAMES


def test_six_joints_and_three_shapes_are_turned_either_way(
    studio: Studio, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(bodies, "TURNS", (0.4,))
    monkeypatch.setattr(bodies, "STEPS", (1.0,))
    (subject,) = studio.subjects("humans", {"any": ""})
    first, *rows = edit_rows(subject)
    names = [panel.title.splitlines()[0] for row in rows for panel in row]
    assert names == [f"{joint}_{axis}" for joint in JOINTS for axis in "xyz"]
    assert [panel.title.splitlines()[0] for panel in first[2:5]] == list(SHAPES)
    assert {*names, *SHAPES} <= set(NAMES)
    for panel in (panel for row in (first[2:5], *rows) for panel in row):
        assert np.abs(panel.meshes[0][0] - subject.found.vertices).max() > 0.01
