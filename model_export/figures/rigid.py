"""Every parameter of chairs and airplanes, down and up."""

from __future__ import annotations

from pathlib import Path

from model_export.figures.choices import AIRPLANES, CHAIRS
from model_export.figures.page import Page
from model_export.figures.studio import Studio
from model_export.figures.subject import Subject
from model_export.pictures import Panel, view
from service.edits import Change
from service.encode.model import Model

FACTORS = (0.7, 1.4)


def public_names(model: Model) -> list[str]:
    """The parameters that an edit may name."""
    return [parameter.name for parameter in model.template.parameters if not parameter.nuisance]


def edit_rows(subject: Subject, names: list[str]) -> list[list[Panel]]:
    """Two rows: the upload and each parameter smaller, its fitted template and each larger."""
    rows = [[subject.shown(subject.name)], [subject.fitted("fitted template")]]
    for row, factor in zip(rows, FACTORS, strict=True):
        for name in names:
            change = {name: Change("scale", factor)}
            row.append(subject.edited(f"{name}\nx {factor:g}", change))
    return rows


def chairs(studio: Studio) -> Path:
    """Eight parameters of six chairs."""
    names = public_names(studio.models["chair"])
    rows = [edit_rows(subject, names) for subject in studio.subjects("chairs", CHAIRS)]
    return studio.save("chairs", Page(190, 220, view()), rows)


def airplanes(studio: Studio) -> Path:
    """Six parameters of six airplanes."""
    names = public_names(studio.models["airplane"])
    rows = [edit_rows(subject, names) for subject in studio.subjects("airplanes", AIRPLANES)]
    return studio.save("airplanes", Page(250, 170, view(35, 28)), rows)
