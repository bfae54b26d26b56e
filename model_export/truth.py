"""Dimensions of real shapes measured by hand, and how far a model's answers are from them.

For measuring only: nothing here is trained on.  A truth file has a JSON object a line::

    {"id": "fgm-c150", "kind": "ga", "size": 7.1, "values": {"fuselage_length": [7.1, 6.9]}}

``size`` is the length that errors are given in percent of, ``values`` every defensible reading of
each dimension, in the mesh's own unit.  Chairs measured by position are read too: objects with
``template``, ``measured``, ``alternatives`` and ``bbox`` in place of ``size`` and ``values``.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from model_export.contact_sheet import fit_panel
from model_export.pictures import Panel as Panel
from model_export.pictures import save_sheet
from model_export.realistic import RealisticShape, find_shapes
from model_export.samples import Inferred, infer_shape
from service.deform.dimensions import Dimensions
from service.encode.model import SIGMA_FLOOR, Model

Array = NDArray[np.float64]

PERCENTILES = (50, 75, 90)
ALL = "all"
PAPER_NAMES = {"back_depth": "back_thickness", "seat_height": "seat_thickness"}
"""What the files of chairs call thicknesses, after the paper, by what the API does."""


@dataclass(frozen=True)
class Measured:
    """A shape measured by hand.

    Attributes:
        name, kind: of the shape.
        size: what errors are shares of, in the mesh's unit.
        readings: every defensible value of each dimension.
    """

    name: str
    kind: str
    size: float
    readings: Mapping[str, Sequence[float]]

    def gap(self, name: str, value: float) -> float:
        """Percent of the size that a value is off the nearest reading."""
        return 100 * min(abs(value - reading) for reading in self.readings[name]) / self.size


@dataclass(frozen=True)
class Judged:
    """A model's answer for a measured shape.

    Attributes:
        shape, measured: the shape.
        encoder, refined: percent off by dimension, of the encoder alone and with refinement.
        sigma: percent claimed for the refined values.
        fitted_sigma: normalised, as the fit alone has it.
        unit: normalised length that a percent of the size is.
    """

    shape: RealisticShape
    measured: Measured
    encoder: Mapping[str, float]
    refined: Mapping[str, float]
    sigma: Mapping[str, float]
    fitted_sigma: Mapping[str, float]
    unit: float

    @property
    def worst(self) -> float:
        """The largest error of a refined value."""
        return max(self.refined.values())


def read_truth(path: Path) -> dict[str, Measured]:
    """The shapes of a truth file by name."""
    rows = (json.loads(line) for line in path.read_text("utf-8").splitlines() if line.strip())
    return {measured.name: measured for measured in map(_measured, rows)}


def _measured(row: Mapping[str, Any]) -> Measured:
    kind = str(row.get("kind", ALL))
    if "values" in row:
        return Measured(row["id"], kind, float(row["size"]), row["values"])
    other = row.get("alternatives", {})
    readings: dict[str, list[float]] = {}
    for key, value in row["template"].items():
        if row["template_confidence"].get(key) != "undefined":
            others = _listed(other.get("template", {}).get(key, []))
            readings[PAPER_NAMES.get(key, key)] = [value, *others]
    floor = row["bbox"]["min"][1]
    others = _listed(other.get("measured", {}).get("seat_top_y", []))
    readings["seat_top_height"] = [y - floor for y in (row["measured"]["seat_top_y"], *others)]
    height = row["bbox"]["extents"][1]
    readings["total_height"] = [height]
    return Measured(row["id"], kind, height, readings)


def _listed(entry: float | list[float]) -> list[float]:
    return entry if isinstance(entry, list) else [entry]


def judge(model: Model, folder: Path, truth: Mapping[str, Measured]) -> list[Judged]:
    """A model's answers for the measured shapes of a folder."""
    shapes = [shape for shape in find_shapes(folder) if shape.name in truth]
    return [_judged(model, shape, truth[shape.name]) for shape in tqdm(shapes, desc="truth")]


def _judged(model: Model, shape: RealisticShape, measured: Measured) -> Judged:
    found = infer_shape(model, shape)
    normalization, sigma = found.fit.normalization, found.fit.sigma
    encoded = model.encode(normalization.apply(found.samples.points)).parameters
    encoder, refined = (
        {n: measured.gap(n, v) for n, v in _dimensions(found, f).items() if n in measured.readings}
        for f in (encoded, found.fit.parameters)
    )
    alone = np.sqrt(np.maximum(sigma**2 - SIGMA_FLOOR**2, 0.0)) / model.sigma_scale
    fitted = dict(zip(model.template.names, alone.tolist(), strict=True))
    unit = 0.01 * measured.size * normalization.scale
    claims = dict(zip(model.template.names, (sigma / unit).tolist(), strict=True))
    return Judged(shape, measured, encoder, refined, claims, fitted, unit)


def rescaled(judged: Sequence[Judged], scales: Mapping[str, float]) -> list[Judged]:
    """The same answers, as claimed by a model whose card has these `sigma_scale`s."""
    return [
        replace(
            entry,
            sigma={
                name: float(np.hypot(scales.get(name, 1.0) * fitted, SIGMA_FLOOR)) / entry.unit
                for name, fitted in entry.fitted_sigma.items()
            },
        )
        for entry in judged
    ]


def _dimensions(found: Inferred, f: Array) -> dict[str, float]:
    """Public parameters and derived dimensions in the mesh's unit, for normalised ``f [d]``."""
    template, scale = found.fit.template, found.fit.normalization.scale
    vertices = found.fit.normalization.apply(found.mesh.vertices)
    derived = Dimensions(template, f / scale, vertices, scale).derived(f / scale)
    rows = zip(template.names, (f / scale).tolist(), template.public, strict=True)
    return {name: value for name, value, seen in rows if seen} | derived


def save_worst(model: Model, judged: Sequence[Judged], path: Path, count: int = 10) -> None:
    """Draw the shapes with the largest errors, the template over each, and say what is off."""
    panels = []
    for entry in sorted(judged, key=lambda entry: -entry.worst)[:count]:
        name = max(entry.refined, key=lambda name: entry.refined[name])
        panel = fit_panel(model, entry.shape)
        panels.append(replace(panel, title=f"{panel.title}\n{name} off by {entry.worst:.1f} %"))
    save_sheet(panels, path)


def summary(judged: Sequence[Judged]) -> dict[str, Any]:
    """The card's account: percentiles of the errors of each dimension, and sigma's coverage."""
    table = {}
    for name in _names(judged):
        rows = [entry for entry in judged if name in entry.refined]
        table[name] = {
            "shapes": len(rows),
            "encoder": _percentiles([entry.encoder[name] for entry in rows]),
            "refined": _percentiles([entry.refined[name] for entry in rows]),
        }
        claims = [entry for entry in rows if name in entry.sigma]
        if claims:
            within = [entry.refined[name] <= entry.sigma[name] for entry in claims]
            table[name]["within_sigma_percent"] = round(100 * float(np.mean(within)), 1)
    return {"percentiles": list(PERCENTILES), "errors_percent_of_size": table}


def _percentiles(errors: Sequence[float]) -> list[float]:
    return [round(float(value), 2) for value in np.percentile(errors, PERCENTILES)]


def errors_table(judged: Sequence[Judged]) -> str:
    """Median / 75th / 90th percentile of the errors of each dimension, as Markdown."""
    lines = ["| dimension | encoder | refined | within sigma |", "|---|---|---|---|"]
    for name, row in summary(judged)["errors_percent_of_size"].items():
        cells = (
            " / ".join(f"{value:.1f}" for value in row[kind]) for kind in ("encoder", "refined")
        )
        share = row.get("within_sigma_percent")
        lines.append(
            f"| {name} | {' | '.join(cells)} | {'-' if share is None else f'{share:.0f} %'} |"
        )
    return "\n".join(lines)


def kinds_table(judged: Sequence[Judged]) -> str:
    """Median errors of each dimension by kind of shape, refined, as Markdown."""
    kinds = sorted({entry.measured.kind for entry in judged})
    counts = [sum(entry.measured.kind == kind for entry in judged) for kind in kinds]
    heads = (f"{kind} ({count})" for kind, count in zip(kinds, counts, strict=True))
    lines = [f"| dimension | {' | '.join(heads)} |", "|---" * (len(kinds) + 1) + "|"]
    for name in _names(judged):
        cells = []
        for kind in kinds:
            own = [e.refined[name] for e in judged if e.measured.kind == kind and name in e.refined]
            cells.append(f"{np.median(own):.1f}" if own else "-")
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return "\n".join(lines)


def _names(judged: Iterable[Judged]) -> list[str]:
    return list(dict.fromkeys(name for entry in judged for name in entry.refined))
