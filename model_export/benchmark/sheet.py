"""The rivals side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from model_export.benchmark.accuracy import edit_accuracy, surface_accuracy
from model_export.benchmark.case import Case
from model_export.pictures import BLUE, GREY, YELLOW, Panel, save_sheet, view
from model_export.rivals.registry import Entry
from model_export.rivals.subject import Edit, Outcome

Wanted = tuple[Case, str, float]
"""A case, and the parameter and factor of an edit of it."""


def draw_rivals(wanted: Sequence[Wanted], rivals: Mapping[str, Entry], path: Path) -> None:
    """A line an edit: the input, the truth, and what each rival makes of it with the true
    parameters."""
    panels: list[Panel] = []
    for case, name, factor in wanted:
        known = next(iter(case.known))
        subject = case.subject(known)
        edit = next(e for e in case.edits(known) if (e.name, e.factor) == (name, factor))
        assert edit.truth is not None
        panels.append(Panel(case.name, [(case.vertices, case.faces, YELLOW, 1.0)]))
        title = f"{name.replace('_', ' ')} x {factor:g}\ntruth"
        panels.append(Panel(title, [(edit.truth, case.faces, BLUE, 1.0)]))
        for rival, entry in rivals.items():
            try:
                outcome = entry.rule(subject)(edit)
            except Exception as error:
                panels.append(Panel(f"{rival}\n{type(error).__name__}", [_nothing(case)]))
                continue
            faces = case.faces if outcome.faces is None else outcome.faces
            title = f"{rival}\nEA {_accuracy(case, edit, outcome):.2f}"
            panels.append(Panel(title, [(outcome.vertices, faces, GREY, 1.0)]))
    columns = 2 + len(rivals)
    save_sheet(panels, path, columns=columns, size=1.45, camera=view(40, 22), same_scale=False)


def _accuracy(case: Case, edit: Edit, outcome: Outcome) -> float:
    assert edit.truth is not None
    if outcome.faces is None:
        return edit_accuracy(case.vertices, outcome.vertices, edit.truth)[0]
    return surface_accuracy(case.vertices, edit.truth, outcome.vertices)[0]


def _nothing(case: Case) -> tuple[np.ndarray, np.ndarray, tuple[float, float, float], float]:
    return case.vertices[:3], np.array([[0, 1, 2]]), GREY, 0.0
