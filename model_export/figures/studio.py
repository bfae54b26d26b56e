"""What sheets are made with: the models, the folders of meshes, and where pictures go."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from model_export.figures.choices import NoMeshes, chosen
from model_export.figures.page import Page, write
from model_export.figures.subject import Subject, uploaded
from model_export.pictures import Panel
from service.encode.basemodel import Model
from service.inferences import Inferences
from service.requests import InferOptions, Upload

HELD_BYTES = 1 << 29
"""Of memory for what is known of the meshes."""


@dataclass(frozen=True)
class Studio:
    """What every sheet needs.

    Attributes:
        models: the categories.
        folders: of real meshes, by `chairs`, `airplanes` and `humans`.
        out: folder that pictures are written to.
        known: what the service knows of them.
    """

    models: Mapping[str, Model]
    folders: Mapping[str, Path]
    out: Path
    known: Inferences = field(default_factory=lambda: Inferences(HELD_BYTES))

    def subjects(self, kind: str, wanted: Mapping[str, str]) -> list[Subject]:
        """Meshes of a folder as uploads of which nothing is said.

        Raises:
            NoMeshes: see `chosen`; and for a folder that was not named.
        """
        if kind not in self.folders:
            raise NoMeshes(f"it takes a folder of {kind}: say --{kind} DIR")
        paths = chosen(self.folders[kind], wanted)
        return [self.subject(name, uploaded(path)) for name, path in paths.items()]

    def subject(self, name: str, upload: Upload, category: str | None = None) -> Subject:
        """An upload of which nothing is said but perhaps its category."""
        options = InferOptions() if category is None else InferOptions(category)
        return Subject(name, upload, self.models, options, self.known)

    def save(self, name: str, page: Page, groups: Sequence[Sequence[Sequence[Panel]]]) -> Path:
        """Write a sheet of groups of rows as ``name.png``."""
        path = self.out / f"{name}.png"
        write(page.image(groups), path)
        print(f"wrote {path}, {path.stat().st_size // 1000} kB", file=sys.stderr)
        return path
