"""An edited file and the account of what the edit did."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from service.deform.dimensions import Dimensions
from service.deform.flips import count_flips
from service.inference import Inference
from service.mesh.convert import convert
from service.mesh.formats import MEDIA_TYPES
from service.requests import file_unit

Array = NDArray[np.float64]

MANY_FLIPS = 1e-3
"""Share of flipped faces above which an answer says so."""


@dataclass(frozen=True)
class Edited:
    """An edited file and what became of it.

    Attributes:
        data, format, media_type: the file.
        parameters: values after the edit, by name, derived ones included.
        report: values and dimensions before and after, moved vertices, flipped faces, warnings.
    """

    data: bytes
    format: str
    media_type: str
    parameters: dict[str, float]
    report: dict[str, Any]


@dataclass(frozen=True)
class Moved:
    """Where an edit takes an upload.

    Attributes:
        found: the upload and its parameters before.
        dimensions: of the bound mesh.
        after: ``[d]`` parameters after.
        vertices: ``[V, 3]`` new positions in the file's own frame.
        linear: ``[V, 3, 3]`` local linear maps, likewise.
    """

    found: Inference
    dimensions: Dimensions
    after: Array
    vertices: Array
    linear: NDArray[np.floating]


def write_edited(moved: Moved, format: str | None) -> Edited:
    """The edited file with its report.

    Args:
        moved: the edit.
        format: to write; None keeps the file's own, and with it everything but positions.
    """
    found, mesh = moved.found, moved.found.mesh
    if format is None or format == mesh.format:
        data, media_type = mesh.write(moved.vertices, moved.linear), mesh.media_type
    else:
        factor = file_unit(format, found.unit) / file_unit(mesh.format, found.unit)
        data = convert(moved.vertices / factor, mesh.faces, format)
        media_type = next(kind for kind, name in MEDIA_TYPES.items() if name == format)
    before = found.dimensions().derived(found.parameters)
    after = moved.dimensions.derived(moved.after)
    values = dict(zip(found.model.template.names, map(float, moved.after), strict=True))
    report = _report(moved, before, after)
    return Edited(data, format or mesh.format, media_type, values | after, report)


def _report(moved: Moved, before: dict[str, float], after: dict[str, float]) -> dict[str, Any]:
    found, mesh = moved.found, moved.found.mesh
    rows = zip(found.model.template.names, found.parameters, moved.after, strict=True)
    flips = count_flips(mesh.vertices, moved.vertices, mesh.faces, moved.linear)
    return {
        "category": found.model.name,
        "model": found.describe_model(),
        "parameters": {
            name: {"before": float(old), "after": float(new), "unit": found.unit}
            for name, old, new in rows
        },
        "derived": {
            name: {"before": old, "after": after[name], "unit": found.unit}
            for name, old in before.items()
        },
        "vertices": {
            "total": len(mesh.vertices),
            "moved": int((moved.vertices != mesh.vertices).any(axis=1).sum()),
        },
        "flipped_faces": flips,
        "warnings": [*found.warnings, *_warnings(moved, flips)],
    }


def _warnings(moved: Moved, flips: int) -> list[str]:
    template = moved.found.model.template
    before = template.broken_relations(moved.found.parameters)
    broken = [text for text in template.broken_relations(moved.after) if text not in before]
    warnings = [f"parts now run into each other: {text} is negative" for text in broken]
    if flips > MANY_FLIPS * len(moved.found.mesh.faces):
        warnings.append(
            f"{flips} faces turned inside out: the edit is more than this mesh can follow"
        )
    return warnings
