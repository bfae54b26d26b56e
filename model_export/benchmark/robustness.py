"""Whether uploads are answered however they come, and how far their parameters drift (B12)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import cast

import numpy as np
from numpy.typing import NDArray

from model_export.benchmark.spoilt import (
    CROPPED,
    FEW,
    FLIPPED,
    HOLE,
    HOLES,
    MANY,
    NOISE,
    SCALES,
    STRAY,
    spoilt,
)
from model_export.orientation_report import looks_the_same
from service.affineinference import AffineInference
from service.encode.model import Model
from service.errors import ShapeError
from service.mesh.convert import convert
from service.pipeline import infer
from service.requests import InferOptions, Upload

Array = NDArray[np.float64]

ENOUGH = 0.1
"""Drift below which a parameter is as good as the same."""


@dataclass(frozen=True)
class Stand:
    """How the answer for one disturbed upload stands beside that for the clean one.

    Attributes:
        source, category: of the input.
        kind: of disturbance.
        refusal: why it is not answered; none where it is.
        recognised: of the right category.
        upright: with the up and front that it has, or others from where it looks the same.
        drift: ``abs(f~ - f) / f`` of the public parameters that the clean one's variant has; none
            where it is refused or taken for something else.
    """

    source: str
    category: str
    kind: str
    refusal: str = ""
    recognised: bool = False
    upright: bool = False
    drift: tuple[float, ...] = ()


def stands(
    models: Mapping[str, Model],
    category: str,
    source: str,
    vertices: Array,
    faces: NDArray[np.int64],
    turns: int,
    many: bool,
) -> Iterator[Stand]:
    """Send a mesh in every disturbance, told nothing; see `spoilt` for the arguments.

    Parameters are compared with those of the clean mesh whose category and orientation are told.
    """
    clean = Upload(convert(vertices, faces, "ply"), "mesh.ply")
    told = cast(AffineInference, infer(clean, models, InferOptions(category, "+y", "+z")))
    same = looks_the_same(vertices, faces)
    for own in spoilt(vertices, faces, turns, many):
        stand = Stand(source, category, own.kind)
        try:
            found = infer(own.upload, models, InferOptions())
        except ShapeError as error:
            yield replace(stand, refusal=error.code)
            continue
        if found.model.name != category:
            yield stand
            continue
        # Rounded, as a lean of some degrees that is found is no other side.
        turn = np.round(found.best.orientation.rotation @ own.orientation.rotation.T)
        upright = any(np.array_equal(turn, other) for other in same)
        drift = tuple(drifts(told, cast(AffineInference, found), own.scale).tolist())
        yield replace(stand, recognised=True, upright=upright, drift=drift)


def drifts(told: AffineInference, found: AffineInference, scale: float) -> Array:
    """Relative change of each public parameter that the first one has."""
    template = told.model.template
    there = np.flatnonzero(told.fit.template.active & template.public & (told.parameters > 0.0))
    f, other = told.parameters[there], found.parameters[there] / scale
    return np.asarray(np.abs(other - f) / f)


ABOUT = f"""Told nothing, the service is sent files turned every way, in {len(SCALES)} other scales,
and disturbed: {HOLES} holes with a radius of {HOLE} of the diagonal, {FLIPPED} of the faces turned
over and {STRAY} more afloat, faces that share nothing, {CROPPED} of the area cut off by a plane,
every coordinate off by {NOISE} of the diagonal (standard deviation), at most {FEW} vertices by
collapsing edges, and {MANY:,} of one chair and one airplane.  Drift is `abs(f~ - f) / f` of public
parameters against the clean file whose category and orientation are told.  The aim is 99 %
answered, and a drift below 10 %."""


def robustness_section(tables: Sequence[str]) -> str:
    """What is done, and what came of it in each category."""
    return "\n\n".join([ABOUT, *tables])


def table(rows: Sequence[Stand]) -> str:
    """A line for each disturbance of a source and category."""
    lines = [
        "| inputs | disturbance | uploads | answered, % | right category, % | right side up, % "
        "| drift, median, % | drift, p90, % | parameters within 10 %, % | refused |",
        "|---" * 10 + "|",
    ]
    for source, category, kind in dict.fromkeys((r.source, r.category, r.kind) for r in rows):
        own = [r for r in rows if (r.source, r.category, r.kind) == (source, category, kind)]
        refused = [row.refusal for row in own if row.refusal]
        shares = [
            f"{100 * np.mean(flags):.1f}"
            for flags in (
                [not r.refusal for r in own],
                [r.recognised for r in own],
                [r.upright for r in own],
            )
        ]
        drift = np.concatenate([row.drift for row in own])
        told = ["-"] * 3
        if len(drift):
            figures = np.median(drift), np.quantile(drift, 0.9), (drift < ENOUGH).mean()
            told = [f"{100 * figure:.1f}" for figure in figures]
        cells = [f"{source}, {category}s", kind, str(len(own)), *shares, *told]
        cells.append(", ".join(dict.fromkeys(refused)) or "none")
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)
