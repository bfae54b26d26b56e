"""How an edit comes about, in the paper's order: mesh, template, edited template, edited mesh."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from model_export.figures.choices import OVERVIEW_AIRPLANE, OVERVIEW_BODY, OVERVIEW_CHAIR
from model_export.figures.page import Page
from model_export.figures.studio import Studio
from model_export.figures.unlike import told
from model_export.pictures import Panel, view
from service.edits import Change

ROWS: Mapping[str, tuple[Mapping[str, str], dict[str, Change]]] = {
    "chairs": (
        OVERVIEW_CHAIR,
        {"seat_width": Change("scale", 1.4), "leg_height": Change("scale", 0.6)},
    ),
    "airplanes": (
        OVERVIEW_AIRPLANE,
        {"wing_length": Change("scale", 1.3), "fuselage_length": Change("scale", 0.75)},
    ),
    "humans": (
        OVERVIEW_BODY,
        {"left_shoulder_z": Change("add", 1.0), "right_knee_x": Change("add", 1.0)},
    ),
}
"""Folder, mesh and edit of each."""


def overview(studio: Studio) -> Path:
    """A row a category."""
    groups: list[list[list[Panel]]] = []
    for kind, (wanted, edit) in ROWS.items():
        (subject,) = studio.subjects(kind, wanted)
        row = [
            subject.shown("a mesh as it came"),
            subject.fitted("the template fitted to it"),
            subject.template(f"the template edited\n{told(edit)}", edit),
            subject.edited("the mesh moved alike", edit),
        ]
        groups.append([row])
    return studio.save("overview", Page(260, 300, view(35, 25)), groups)
