"""The rivals side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from model_export.benchmark.accuracy import diagonal
from model_export.benchmark.case import Case
from model_export.benchmark.score import Judge
from model_export.pictures import BLUE, GREY, YELLOW, Panel, save_sheet, view
from model_export.rivals.registry import Entry
from model_export.rivals.subject import Edit, Outcome, Subject
from service.mesh.surface import sample_surface

Wanted = tuple[Case, str, float]
"""A case, and the parameter and factor of an edit of it."""
Colour = tuple[float, float, float]

SAMPLES = 200_000
SHADES: tuple[tuple[float, Colour], ...] = (
    (0.002, GREY),
    (0.004, (0.92, 0.80, 0.62)),
    (0.007, (0.94, 0.66, 0.38)),
    (0.010, (0.92, 0.47, 0.25)),
    (np.inf, (0.80, 0.16, 0.12)),
)
"""Colours of errors up to a share of the diagonal."""


def draw_rivals(wanted: Sequence[Wanted], rivals: Mapping[str, Entry], path: Path) -> None:
    """Two lines an edit: the input, the truth, and what each rival makes of it with the true
    parameters, coloured by its error."""
    panels: list[Panel] = []
    columns = -(-(2 + len(rivals)) // 2)
    for case, name, factor in wanted:
        known = next(iter(case.known))
        subject = case.subject(known)
        edit = next(e for e in case.edits(known) if (e.name, e.factor) == (name, factor))
        assert edit.truth is not None
        panels.append(Panel(f"{case.name}\ninput", [(case.vertices, case.faces, YELLOW, 1.0)]))
        title = f"{name.replace('_', ' ')} x {factor:g}\ntrue edit"
        panels.append(Panel(title, [(edit.truth, case.faces, BLUE, 1.0)]))
        for rival, entry in rivals.items():
            panels.append(_panel(rival, entry, case, edit, subject))
        empty = Panel("", [(case.vertices[:3], np.array([[0, 1, 2]]), GREY, 0.0)])
        panels += [empty] * (-len(panels) % columns)
    save_sheet(panels, path, columns=columns, size=1.7, camera=view(40, 22))


def _panel(name: str, entry: Entry, case: Case, edit: Edit, subject: Subject) -> Panel:
    try:
        outcome = entry.rule(subject)(edit)
    except Exception as error:
        nothing = (case.vertices[:3], np.array([[0, 1, 2]]), GREY, 0.0)
        return Panel(f"{name}\n{type(error).__name__}", [nothing])
    faces = case.faces if outcome.faces is None else outcome.faces
    error = _error(case, edit, outcome) / diagonal(case.vertices)
    found = np.searchsorted([most for most, _ in SHADES], error[faces].mean(axis=1))
    meshes = [
        (outcome.vertices, faces[found == index], colour, 1.0)
        for index, (_, colour) in enumerate(SHADES)
        if (found == index).any()
    ]
    accuracy = Judge(case).score(edit, outcome).accuracy
    return Panel(f"{name}\nEA {accuracy:.2f}", meshes)


def _error(case: Case, edit: Edit, outcome: Outcome) -> NDArray[np.float64]:
    """``[V]`` distance of each vertex from its true place, or of another mesh's from the true
    surface."""
    assert edit.truth is not None
    if outcome.faces is None:
        return np.asarray(np.linalg.norm(outcome.vertices - edit.truth, axis=1))
    points = sample_surface(edit.truth, case.faces, SAMPLES, np.random.default_rng(0)).points
    return np.asarray(cKDTree(points).query(outcome.vertices)[0])
