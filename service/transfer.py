"""Transfers: edits of one shape whose values come from another (the paper's mode from source to
target); what every kind of category has in common."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from service.edited import Edited, Moved
from service.edits import Change
from service.errors import InvalidRequest
from service.finding import blaming, require_recognised
from service.inference import Inference
from service.requests import POSITIONS, SIZES, UNITS, TransferOptions

Array = NDArray[np.float64]

SAME = 1e-9
"""Share of a value, or of a shape's size, that is rounding: values so near to the present ones are
those, so that a transfer between equal shapes changes nothing at all."""
NOUGHT = 1e-12
"""Values about zero that are rounding too."""


@dataclass(frozen=True)
class Taken:
    """What an edit takes from a target.

    Attributes:
        edits: of the source.
        values: what the target has, by name, in the source's units.
        units: of those values.
        scale: what lengths were multiplied by on the way.
        goal: ``[3]`` where the kept point is to lie, canonical and in the source's reported unit;
            None for where an edit leaves it.
        warnings: what the client should know of the target, and of the way.
    """

    edits: dict[str, Change]
    values: dict[str, float]
    units: dict[str, str]
    scale: float
    goal: Array | None
    warnings: Sequence[str]


def set_to(wanted: Mapping[str, float], present: Mapping[str, float]) -> dict[str, Change]:
    """Edits that set values, by name; the present ones but for rounding stay just as they are."""
    return {
        name: Change("set", now if _same(value, now := present[name]) else value)
        for name, value in wanted.items()
    }


def _same(value: float, now: float) -> bool:
    return math.isclose(value, now, rel_tol=SAME, abs_tol=NOUGHT)


def unit_ratio(found: Inference, other: Inference) -> float:
    """What the other's reported lengths are multiplied by to be in the unit of the first."""
    return UNITS[other.unit] / UNITS[found.unit]


def require_transfer(options: TransferOptions) -> None:
    """Raise `InvalidRequest` (``unknown_size``, ``unknown_position``) for options there are none
    of."""
    for name, value, known in (
        ("size", options.size, SIZES),
        ("position", options.position, POSITIONS),
    ):
        if value not in known:
            raise InvalidRequest(
                f"unknown_{name}",
                f"{name}={value[:40]!r} is none that a transfer knows",
                f"Use {' or '.join(known)}.",
            )


def require_pair(found: Inference, other: Inference, category: str, other_category: str) -> None:
    """Raise `InvalidRequest` unless a source and a target can be taken for shapes of one category.

    Args:
        found, other: the source and the target.
        category, other_category: what the client says of each.

    Raises:
        InvalidRequest: ``categories_differ`` or ``not_recognised``.
    """
    _require_alike(found, other)
    with blaming("source"):
        require_recognised(found, category)
    with blaming("target"):
        require_recognised(other, other_category)


def _require_alike(found: Inference, other: Inference) -> None:
    one, two = found.model.name, other.model.name
    if one == two:
        return
    sure = [name for name, shape in ((one, found), (two, other)) if shape.in_distribution]
    raise InvalidRequest(
        "categories_differ",
        f"by its shape the source is of the category {one} (score {found.best.score:.2f}), and the "
        f"target of {two} (score {other.best.score:.2f})",
        "Send two shapes of one category; or say which one to take both for: "
        + " or ".join(f"category={name}" for name in (sure or (one, two)))
        + ".",
    )


def shifted(moved: Moved, shift: Array) -> Moved:
    """An edited mesh moved as a whole.

    Args:
        moved: the edit.
        shift: ``[3]`` along the canonical axes, in the reported unit.
    """
    found = moved.found
    size = np.linalg.norm(np.ptp(canonical(found, found.mesh.vertices), axis=0))
    if np.linalg.norm(shift) <= SAME * size:
        return moved
    own = found.best.orientation.to_own(shift[None] / found.unit_scale)
    return replace(moved, vertices=moved.vertices + own)


def canonical(found: Inference, vertices: Array) -> Array:
    """``[V, 3]`` of a file's own frame along the canonical axes, in the reported unit."""
    return found.best.orientation.to_canonical(vertices) * found.unit_scale


def of_target(warnings: Iterable[str]) -> list[str]:
    """Warnings of the target, told apart from the source's."""
    return [f"target: {warning}" for warning in warnings]


def told(edited: Edited, taken: Taken, options: TransferOptions) -> Edited:
    """The edited file with an account of the transfer in its report."""
    account: dict[str, Any] = {
        "parameters": list(taken.edits),
        "size": options.size,
        "position": options.position,
        "scale": taken.scale,
        "target": {
            name: {"value": value, "unit": taken.units[name]}
            for name, value in taken.values.items()
        },
    }
    warnings = [*edited.report["warnings"], *taken.warnings]
    return replace(edited, report={**edited.report, "warnings": warnings, "transfer": account})
