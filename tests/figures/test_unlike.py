from __future__ import annotations

import pytest

from model_export.figures import unlike
from model_export.figures.studio import Studio
from model_export.figures.unlike import FORMATS, case_panels, cases, told
from service.edits import Change


def test_there_are_the_papers_ten_in_every_format(studio: Studio) -> None:
    found = cases(studio)
    assert [category for _, category, _ in found] == (
        ["chair"] * 3 + ["airplane"] * 5 + ["human"] * 2
    )
    assert all(subject.options.category == category for _, category, subject in found[:8])
    assert {str(subject.upload.name).rpartition(".")[2] for *_, subject in found[:8]} == {*FORMATS}


def test_a_case_is_shown_fitted_and_edited_twice(studio: Studio) -> None:
    title, category, subject = cases(studio)[0]
    panels = case_panels(title, category, subject)
    assert [len(panel.meshes) for panel in panels] == [1, 2, 1, 1]
    assert panels[0].title == "one leg (.ply)"
    assert panels[2].title.startswith("seat_width x 1.4")
    for panel in panels[2:]:
        assert (panel.meshes[0][0] != subject.found.vertices).any()


def test_two_cases_stand_side_by_side(studio: Studio, monkeypatch: pytest.MonkeyPatch) -> None:
    two = cases(studio)[:2]
    monkeypatch.setattr(unlike, "cases", lambda _: two)
    path = unlike.unlike(studio)
    assert path.name == "unlike.png"
    assert path.stat().st_size > 1000


def test_an_edit_is_told_a_change_a_line() -> None:
    edits = {"a": Change("scale", 1.4), "b": Change("add", -0.5), "c": Change("set", 2.0)}
    assert told(edits) == "a x 1.4\nb -0.5\nc = 2"
