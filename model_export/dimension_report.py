"""Whether a dimension that is asked for is had: ``python -m model_export.dimension_report chair``.

Each derived dimension of real meshes is set to 0.9 and 1.1 times what the service tells of it, and
measured anew on the edited mesh: by the fit alone, by what the mesh itself measures before, and, as
a constraint, by the least change of all parameters.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from model_export.config import SHIPPED
from model_export.realistic import find_shapes
from service.affineinference import AffineInference
from service.constraints import Interval
from service.deform.demands import Unsatisfiable
from service.deform.dimensions import Dimensions
from service.deform.measured import find_levels
from service.deform.outcome import Outcome
from service.edits import Change
from service.encode.model import Model, load_models
from service.errors import InvalidRequest, ShapeError
from service.pipeline import infer
from service.requests import InferOptions, Upload

Array = NDArray[np.float64]
Way = Callable[[Dimensions, str, float], Outcome]

FACTORS = (0.9, 1.1)
WITHIN = 0.01
"""What a hand would call the same height."""


def _edit(dimensions: Dimensions, name: str, value: float) -> Outcome:
    return dimensions.outcome({name: Change("set", value)})


def _constraint(dimensions: Dimensions, name: str, value: float) -> Outcome:
    return dimensions.outcome({}, constraints={name: Interval(value, value)})


WAYS: dict[str, tuple[bool, Way]] = {
    "edit, by the fit": (False, _edit),
    "edit, by the mesh": (True, _edit),
    "constraint": (True, _constraint),
}
"""Whether the mesh itself is measured before, and what is asked."""


@dataclass(frozen=True)
class Result:
    """What one request for a dimension came to.

    Attributes:
        name, way: which.
        error: of the dimension on the edited mesh, as a share of what was asked for; None where the
            service said that it can't be had.
    """

    name: str
    way: str
    error: float | None


def judge(found: AffineInference) -> Iterator[Result]:
    """Ask for each derived dimension of an upload and measure what comes of it."""
    fit = found.fit
    bound = found.bound("blend")
    shape = fit.template, found.parameters, found.vertices, found.scale
    by_fit, by_mesh = Dimensions(*shape, bound.columns), found.dimensions(bound)
    told = found.dimensions().derived(found.parameters)
    for (name, value), factor, (way, (measures, ask)) in product(
        told.items(), FACTORS, WAYS.items()
    ):
        try:
            outcome = ask(by_mesh if measures else by_fit, name, factor * value)
        except (InvalidRequest, Unsatisfiable):
            yield Result(name, way, None)
            continue
        change = outcome.change * found.scale
        vertices = found.vertices + bound.displace(change)
        had = _measure(found, name, vertices, fit.parameters + change)
        if had is None or outcome.adjusted:
            yield Result(name, way, None)
        else:
            yield Result(name, way, abs(had / found.scale / (factor * value) - 1.0))


def _measure(found: AffineInference, name: str, vertices: Array, f: Array) -> float | None:
    """A dimension of moved vertices, as nobody knew where they were before."""
    fit = found.fit
    extent = fit.template.derived[name].extent
    if extent is not None:
        return float(np.ptp(vertices[:, "xyz".index(extent)]))
    level = find_levels(vertices, found.mesh.faces, fit.template, f, fit.translation).get(name)
    return None if level is None else float(level.of(vertices[:, 1]) - vertices[:, 1].min())


def table(results: list[Result]) -> str:
    """A row a dimension and way: how many were had within 1 %, and how far off they were."""
    lines = [
        "| dimension | asked for as | within 1 % | median error | p90 | can't be had |",
        "|---|---|---|---|---|---|",
    ]
    for name, way in dict.fromkeys((result.name, result.way) for result in results):
        errors = [r.error for r in results if (r.name, r.way) == (name, way)]
        had = np.array([error for error in errors if error is not None])
        near = 100 * np.mean(had < WITHIN) if len(had) else 0.0
        middle, most = 100 * np.quantile(had, [0.5, 0.9]) if len(had) else (np.nan, np.nan)
        lines.append(
            f"| {name} | {way} | {near:.1f} % of {len(had)} | {middle:.3f} % | {most:.3f} % "
            f"| {len(errors) - len(had)} |"
        )
    return "\n".join(lines)


def uploads(
    folder: Path, models: Mapping[str, Model], category: str, stride: int
) -> Iterator[AffineInference]:
    """What is inferred of the meshes of a folder (+Y up, +Z front) that can be served."""
    options = InferOptions(category=category, up="+y", front="+z")
    for shape in find_shapes(folder)[::stride]:
        try:
            found = infer(Upload(shape.path.read_bytes(), shape.path.name), models, options)
        except ShapeError:
            continue
        assert isinstance(found, AffineInference)
        yield found


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m model_export.dimension_report")
    parser.add_argument("category")
    parser.add_argument("--realistic", type=Path, required=True, help="folder of meshes")
    parser.add_argument("--models", type=Path, default=SHIPPED)
    parser.add_argument("--stride", type=int, default=1, help="take every so-many-th mesh")
    arguments = parser.parse_args()
    models = load_models(arguments.models)
    found = uploads(arguments.realistic, models, arguments.category, arguments.stride)
    print(table([result for upload in found for result in judge(upload)]))


if __name__ == "__main__":
    main()
