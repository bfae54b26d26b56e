"""The inputs S, D and R of the benchmark; `outliers` has O."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import product
from pathlib import Path

import numpy as np

from model_export.benchmark.case import FACTORS, Case
from model_export.benchmark.known import Known, inferred, told, wrong_by
from model_export.detailed import DetailedShape, detailed_airplane, detailed_chair
from model_export.realistic import find_shapes
from model_export.samples import TEST_SEED
from model_export.synthetic import Augmentation, SyntheticShapes
from service.deform.followers import following
from service.encode.model import Model
from service.errors import ShapeError
from service.mesh.formats import read_mesh
from service.mesh.surface import Normalization

DETAILED: dict[str, Callable[[int, int | None], DetailedShape]] = {
    "chair": detailed_chair,
    "airplane": detailed_airplane,
}
OFF = 0.05
LARGEST = 60_000
"""Vertices of a real mesh, at most: rivals take minutes on larger ones."""


def detailed_case(model: Model, shape: DetailedShape, seed: int) -> Case:
    """D: a detailed shape, edited by its own generator."""
    vertices = shape.mesh(shape.parameters)
    frame = Normalization.of(vertices)
    x = frame.apply(vertices)
    count = len(shape.names)
    known = {
        "true": told(shape, model.template, frame, np.ones(count)),
        "off": told(shape, model.template, frame, wrong_by(OFF, seed, count)),
        "inferred": inferred(model, x, shape.faces),
    }
    truths = {}
    for (index, name), factor in product(enumerate(shape.names), FACTORS):
        f = shape.parameters.copy()
        f[index] *= factor
        truths[name, factor] = frame.apply(shape.mesh(f))
    return Case("D", f"{model.name} {seed}", model.template, x, shape.faces, known, truths)


def detailed_cases(model: Model, count: int, density: int | None = None) -> Iterator[Case]:
    """The detailed shapes of seeds 0 to ``count - 1``, cut as finely as is said."""
    for seed in range(count):
        yield detailed_case(model, DETAILED[model.name](seed, density), seed)


def template_cases(model: Model, count: int) -> Iterator[Case]:
    """S: fresh draws of the template, edited by the template."""
    shapes = SyntheticShapes(model.template, Augmentation.none(), TEST_SEED)
    parameters, variant = shapes.draw_parameters(count), shapes.draw_variants(count)
    for number, (f, own) in enumerate(zip(parameters, variant.tolist(), strict=True)):
        template = model.template.variants[own]
        used, faces = np.unique(template.faces[~template.hidden], return_inverse=True)
        frame = Normalization.of(template.decode(f)[used])
        f, t = f * frame.scale, -frame.center * frame.scale
        moving = following(template, f)
        x = template.decode(f)[used] + t
        truths = {}
        for (index, p), factor in product(enumerate(template.parameters), FACTORS):
            if p.nuisance or not template.active[index]:
                continue
            df = np.zeros_like(f)
            df[index] = f[index] * (factor - 1.0)
            truths[p.name, factor] = x + (moving.jacobian @ df)[used]
        faces = faces.reshape(-1, 3)
        known = {"true": Known(template, f, t), "inferred": inferred(model, x, faces)}
        yield Case("S", f"{model.name} draw {number}", template, x, faces, known, truths)


def real_cases(model: Model, folder: Path, count: int) -> Iterator[Case]:
    """R: held-out real shapes, whose true edits nobody knows."""
    held_out = [s for s in find_shapes(folder) if s.held_out and s.info.get("core", True)]
    order = np.random.default_rng(0).permutation(len(held_out))
    given = 0
    for index in order:
        if given == count:
            return
        shape = held_out[index]
        try:
            mesh = read_mesh(shape.path.read_bytes(), shape.path.name)
        except ShapeError:
            continue
        if len(mesh.vertices) > LARGEST:
            continue
        x = Normalization.of(mesh.vertices).apply(mesh.vertices)
        known = {"inferred": inferred(model, x, mesh.visible)}
        yield Case("R", shape.name, model.template, x, mesh.faces, known)
        given += 1
