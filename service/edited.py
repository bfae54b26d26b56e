"""An edited file and the account of what the edit did."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from service.deform.admissible import unusual
from service.deform.dimensions import Dimensions, Outcome
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
class Moved:
    """Where an edit takes an upload.

    Attributes:
        found: the upload and its parameters before.
        dimensions: of the bound mesh.
        outcome: the parameters after, and what held them back.
        vertices: ``[V, 3]`` new positions in the file's own frame.
        linear: ``[V, 3, 3]`` local linear maps, likewise.
    """

    found: Inference
    dimensions: Dimensions
    outcome: Outcome
    vertices: Array
    linear: NDArray[np.floating]

    @property
    def after(self) -> Array:
        """``[d]`` parameters after the edit."""
        return self.outcome.parameters


def write_edited(moved: Moved, format: str | None) -> Edited:
    """The edited file with its report.

    Args:
        moved: the edit.
        format: to write; None keeps the file's own, and with it everything but positions.
    """
    found, mesh = moved.found, moved.found.mesh
    if format is None or format == mesh.suffix:
        data, media_type = mesh.write(moved.vertices, moved.linear), mesh.media_type
    else:
        factor = file_unit(format, found.unit) / file_unit(mesh.format, found.unit)
        data = convert(moved.vertices / factor, mesh.faces, format)
        media_type = next(kind for kind, name in MEDIA_TYPES.items() if name == format)
    before = found.dimensions().derived(found.parameters)
    after = moved.dimensions.derived(moved.after)
    values = {name: new for name, _, new in _public(moved)}
    report = _report(moved, before, after)
    return Edited(data, format or mesh.suffix, media_type, values | after, report)


def _public(moved: Moved) -> list[tuple[str, float, float]]:
    """Name, value before and value after of each parameter that users see."""
    template = moved.found.model.template
    columns = (moved.found.parameters.tolist(), moved.after.tolist(), template.public)
    rows = zip(template.names, *columns, strict=True)
    return [(name, old, new) for name, old, new, seen in rows if seen]


def _report(moved: Moved, before: dict[str, float], after: dict[str, float]) -> dict[str, Any]:
    found, mesh = moved.found, moved.found.mesh
    flips = count_flips(mesh.vertices, moved.vertices, mesh.faces, moved.linear)
    return {
        "category": found.model.name,
        "model": found.describe_model(),
        "parameters": {
            name: {"before": old, "after": new, "unit": found.unit}
            for name, old, new in _public(moved)
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
    template = moved.found.best.estimate.template
    unit, before, after = moved.found.unit, moved.found.parameters, moved.after
    reason = ", ".join(moved.outcome.limits)
    warnings = [
        f"{name} is {got:.4g} {unit}, not {asked:.4g}: "
        + (f"the nearest that keeps {reason}" if reason else "the edits contradict each other")
        for name, (asked, got) in moved.outcome.adjusted.items()
    ]
    # What the bounds keep may miss zero by rounding.
    held = template.broken_relations(before) + [
        text.removesuffix(" >= 0") for text in moved.outcome.limits
    ]
    warnings += [
        f"{text} is now negative: parts may run into each other"
        for text in template.broken_relations(after)
        if text not in held
    ]
    warnings += [
        f"{name} is outside of what the model was trained on, for the rest of the shape"
        for name in unusual(template, before, after)
    ]
    if flips > MANY_FLIPS * len(moved.found.mesh.faces):
        warnings.append(
            f"{flips} faces turned inside out: the edit is more than this mesh can follow"
        )
    return warnings
