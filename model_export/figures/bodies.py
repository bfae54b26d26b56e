"""Joints of a body turned about every axis, either way, and its shape changed."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from model_export.figures.choices import BODY
from model_export.figures.page import Page
from model_export.figures.studio import Studio
from model_export.figures.subject import Subject
from model_export.pictures import Panel, view
from service.edits import Change

JOINTS = ("left_shoulder", "right_elbow", "left_hip", "right_knee", "spine2", "neck")
TURNS = (-0.6, 0.6)
"""Radians."""
SHAPES = ("shape_0", "shape_1", "shape_2")
STEPS = (-1.5, 1.5)
"""Standard deviations."""


def edit_rows(subject: Subject) -> list[list[Panel]]:
    """The upload, its fitted body and its shapes; then two joints a row."""
    rows = [
        [
            subject.shown("as it came"),
            subject.fitted("fitted body"),
            *_edits(subject, SHAPES, STEPS),
            *[Panel("", [])] * 4,
        ]
    ]
    for pair in zip(JOINTS[::2], JOINTS[1::2], strict=True):
        names = [f"{joint}_{axis}" for joint in pair for axis in "xyz"]
        rows.append(_edits(subject, names, TURNS))
    return rows


def _edits(subject: Subject, names: Sequence[str], amounts: Sequence[float]) -> list[Panel]:
    return [
        subject.edited(f"{name}\n{amount:+g}", {name: Change("add", amount)})
        for name in names
        for amount in amounts
    ]


def bodies(studio: Studio) -> Path:
    """Six joints and three shapes of one character."""
    (subject,) = studio.subjects("humans", BODY)
    return studio.save("bodies", Page(150, 240, view(25, 10)), [edit_rows(subject)])
