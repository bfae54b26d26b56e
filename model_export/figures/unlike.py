"""The paper's ten shapes unlike its training's: fitted, and edited."""

from __future__ import annotations

from itertools import cycle
from pathlib import Path

from model_export.benchmark.outliers import OUTLIERS
from model_export.figures.choices import HANDS_TOGETHER, LONG_HAIR
from model_export.figures.page import Page
from model_export.figures.studio import Studio
from model_export.figures.subject import Subject
from model_export.pictures import Panel, view
from service.edits import Change
from service.mesh.convert import convert
from service.requests import Upload

Edits = dict[str, Change]

FORMATS = ("ply", "obj", "stl", "glb", "off", "gltf")
"""That the generated ones are sent in, in turn."""
USUAL: dict[str, tuple[Edits, Edits]] = {
    "chair": (
        {"seat_width": Change("scale", 1.4)},
        {"leg_height": Change("scale", 0.6), "back_height": Change("scale", 1.4)},
    ),
    "airplane": (
        {"wing_length": Change("scale", 1.4)},
        {
            "fuselage_length": Change("scale", 0.75),
            "vertical_stabilizer_length": Change("scale", 1.5),
        },
    ),
    "human": (
        {"neck_y": Change("add", 0.6), "shape_1": Change("add", 1.5)},
        {"left_shoulder_z": Change("add", 0.7), "right_elbow_y": Change("add", -0.7)},
    ),
}
"""Two edits a category."""
OWN: dict[str, Edits] = {
    "tailplane on top": {"horizontal_stabilizer_length": Change("scale", 1.5)},
    "no tailplane": {"horizontal_stabilizer_length": Change("scale", 1.5)},
}
"""Edits in place of a category's first, for what is out of the ordinary with a shape."""


def cases(studio: Studio) -> list[tuple[str, str, Subject]]:
    """Name, category and upload of each."""
    found = []
    for (name, (category, make)), format in zip(OUTLIERS.items(), cycle(FORMATS), strict=False):
        upload = Upload(convert(*make(), format), f"shape.{format}")
        title = f"{name} (.{format})"
        found.append((title, category, studio.subject(name, upload, category)))
    for name, wanted in (("long hair", LONG_HAIR), ("hands almost together", HANDS_TOGETHER)):
        (subject,) = studio.subjects("humans", wanted)
        found.append((name, "human", subject))
    return found


def told(edits: Edits) -> str:
    """An edit in a title, a change a line."""
    signs = {"scale": "x {:g}", "add": "{:+g}", "set": "= {:g}"}
    return "\n".join(
        f"{name} {signs[change.kind].format(change.amount)}" for name, change in edits.items()
    )


def case_panels(title: str, category: str, subject: Subject) -> list[Panel]:
    """A shape, its fitted template over it, and two edits."""
    first, second = USUAL[category]
    edits = [OWN.get(subject.name, first), second]
    return [
        subject.shown(title),
        subject.fitted("fitted template"),
        *(subject.edited(told(edit), edit) for edit in edits),
    ]


def unlike(studio: Studio) -> Path:
    """All ten, two a line: each pair of cases is of one category."""
    shown = [case_panels(*case) for case in cases(studio)]
    pairs = [[left + right] for left, right in zip(shown[::2], shown[1::2], strict=True)]
    return studio.save("unlike", Page(180, 230, view()), pairs)
