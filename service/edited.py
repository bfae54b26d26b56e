"""An edited file and the account of what the edit did."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from service.constraints import Interval
from service.inference import Inference
from service.mesh.convert import convert
from service.mesh.formats import MEDIA_TYPES
from service.mesh.moves import any_of_rows
from service.requests import file_unit
from service.stages import stage

Array = NDArray[np.float64]

MANY_FLIPS = 1e-3
"""Share of flipped faces above which an answer says so."""


@dataclass(frozen=True)
class Edited:
    """An edited file and what became of it.

    Attributes:
        data, media_type: the file.
        format: what its name ends in.
        parameters: values after the edit, by name, derived ones included.
        report: values and dimensions before and after, moved vertices, flipped faces, warnings.
    """

    data: bytes
    format: str
    media_type: str
    parameters: dict[str, float]
    report: dict[str, Any]


@dataclass(frozen=True)
class Shift:
    """A parameter or derived dimension that users see, before an edit and after it."""

    name: str
    before: float
    after: float
    unit: str


@dataclass(frozen=True)
class Measured:
    """A dimension of the mesh itself before and after an edit, and where it was to lie, if so."""

    name: str
    before: float
    after: float
    unit: str
    asked: Interval | None = None

    def report(self) -> dict[str, Any]:
        """The same as JSON."""
        values = {"before": self.before, "after": self.after, "unit": self.unit}
        return values if self.asked is None else {**values, "asked": self.asked.asked}


@dataclass(frozen=True)
class Moved:
    """Where an edit takes an upload.

    Attributes:
        found: the upload and its parameters before.
        parameters, derived: what they were and are.
        dimensions: what the mesh itself measured and measures.
        vertices: ``[V, 3]`` new positions in the file's own frame.
        linear: ``[V, 3, 3]`` local linear maps, likewise.
        flips: how many faces turn inside out.
        warnings: what the client should know of the edit.
    """

    found: Inference
    parameters: Sequence[Shift]
    derived: Sequence[Shift]
    dimensions: Sequence[Measured]
    vertices: Array
    linear: NDArray[np.floating]
    flips: int
    warnings: Sequence[str]


def write_edited(moved: Moved, format: str | None) -> Edited:
    """The edited file with its report.

    Args:
        moved: the edit.
        format: to write; None keeps the file's own, and with it everything but positions.
    """
    found, mesh = moved.found, moved.found.mesh
    with stage("write"):
        if format is None or format == mesh.suffix:
            data, media_type = mesh.write(moved.vertices, moved.linear), mesh.media_type
        else:
            factor = file_unit(format, found.unit) / file_unit(mesh.format, found.unit)
            data = convert(moved.vertices / factor, mesh.faces, format)
            media_type = next(kind for kind, name in MEDIA_TYPES.items() if name == format)
    with stage("transfer"):
        report = _report(moved)
    values = {shift.name: shift.after for shift in (*moved.parameters, *moved.derived)}
    return Edited(data, format or mesh.suffix, media_type, values, report)


def _report(moved: Moved) -> dict[str, Any]:
    found, mesh = moved.found, moved.found.mesh
    return {
        "category": found.model.name,
        "model": found.model.identity,
        "parameters": _changes(moved.parameters),
        "derived": _changes(moved.derived),
        "dimensions": {measured.name: measured.report() for measured in moved.dimensions},
        "vertices": {
            "total": len(mesh.vertices),
            "moved": int(any_of_rows(moved.vertices != mesh.vertices).sum()),
        },
        "flipped_faces": moved.flips,
        "warnings": [*found.warnings, *moved.warnings, *_folds(moved.flips, len(mesh.faces))],
    }


def _changes(shifts: Sequence[Shift]) -> dict[str, dict[str, Any]]:
    return {
        shift.name: {"before": shift.before, "after": shift.after, "unit": shift.unit}
        for shift in shifts
    }


def _folds(flips: int, faces: int) -> list[str]:
    if flips <= MANY_FLIPS * faces:
        return []
    return [f"{flips} faces turned inside out: the edit is more than this mesh can follow"]
