"""How well uploads are recognised whichever way they face and whatever unit they are in:
``python -m model_export.orientation_report chair --realistic DIR``.

Each shape is sent in all 24 axis-aligned orientations at several scales.  An answer is right when
it turns the shape to where its own upright front is, or to where it looks the same: a square stool
has four fronts.  Its parameters are compared with the answer for the upright shape.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from tqdm import tqdm

from model_export.config import SHIPPED
from model_export.realistic import RealisticShape, find_shapes
from service.encode.model import Model, load_models
from service.inference import Inference
from service.mesh.formats import read_mesh
from service.mesh.frame import Orientation, orientations
from service.mesh.surface import sample_surface
from service.pipeline import infer
from service.requests import InferOptions, Upload

Array = NDArray[np.float64]

TURNS = orientations()
HINTLESS = InferOptions()
SCALES = (1.0, 0.01, 1000.0)
SAME = 0.015
"""A shape looks the same from another side when its points then lie no farther from it, on the
mean, than this share of its diagonal."""
CLOSE = 0.02
"""Share of the height by which parameters may differ from the upright answer's."""


@dataclass(frozen=True)
class Answer:
    """What came of one upload.

    Attributes:
        name: of the shape.
        way: that it was turned to.
        right: whether the orientation found is the shape's own.
        up: whether at least its up is.
        gap: largest difference of a parameter from the upright answer's, over the height.
        refused: the category was not recognised.
    """

    name: str
    way: Orientation
    right: bool
    up: bool
    gap: float
    refused: bool


def answers(model: Model, shape: RealisticShape, scales: tuple[float, ...]) -> Iterator[Answer]:
    """The service's answers for a shape in every orientation and at some scales."""
    mesh = read_mesh(shape.path.read_bytes(), shape.path.name)
    height = float(np.ptp(mesh.vertices[:, 1]))
    upright = _infer(model, mesh.vertices, mesh.faces, InferOptions(up="+y", front="+z"))
    same = looks_the_same(mesh.vertices, mesh.faces)
    for way in TURNS:
        own = way.to_own(mesh.vertices)
        for scale in scales:
            found = _infer(model, own * scale, mesh.faces, HINTLESS)
            turn = np.round(found.best.orientation.rotation @ way.rotation.T)
            gap = np.abs(found.parameters / scale - upright.parameters)[model.template.public]
            yield Answer(
                name=shape.name,
                way=way,
                right=any(np.array_equal(turn, other) for other in same),
                up=bool(turn[1, 1] == 1.0),
                gap=float(gap.max()) / height,
                refused=not found.in_distribution,
            )


def _infer(
    model: Model, vertices: Array, faces: NDArray[np.int64], options: InferOptions
) -> Inference:
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    upload = Upload(mesh.export(file_type="ply"), "mesh.ply")
    return infer(upload, {model.name: model}, options)


def looks_the_same(vertices: Array, faces: NDArray[np.int64]) -> list[Array]:
    """The turns ``[3, 3]`` that a shape looks the same after."""
    points = sample_surface(vertices, faces, 4096, np.random.default_rng(0)).points
    others = sample_surface(vertices, faces, 4096, np.random.default_rng(1)).points
    center = (points.min(axis=0) + points.max(axis=0)) / 2
    points, others = points - center, others - center
    diagonal = float(np.linalg.norm(np.ptp(points, axis=0)))
    tree = cKDTree(points)
    turns = [way.rotation for way in orientations()]
    gaps = [tree.query(others @ turn.T)[0].mean() / diagonal for turn in turns]
    return [turn for turn, gap in zip(turns, gaps, strict=True) if gap < SAME or turn is turns[0]]


def main() -> None:
    """Print the table, and the shapes that are got wrong."""
    program = "python -m model_export.orientation_report"
    parser = argparse.ArgumentParser(prog=program, description=__doc__)
    parser.add_argument("name", help="the category")
    parser.add_argument("--models", type=Path, default=SHIPPED)
    parser.add_argument("--realistic", type=Path, required=True, help="folder of upright meshes")
    parser.add_argument("--shapes", type=int, default=40, help="of those held out, at most")
    parser.add_argument("--scales", type=float, nargs="*", default=SCALES)
    arguments = parser.parse_args()
    model = load_models(arguments.models)[arguments.name]
    shapes = [s for s in find_shapes(arguments.realistic) if s.held_out][: arguments.shapes]
    found: list[Answer] = []
    for shape in tqdm(shapes, unit="shape"):
        found += answers(model, shape, tuple(arguments.scales))
    right = [answer for answer in found if answer.right]
    print(f"{len(shapes)} shapes, {len(found)} uploads")
    print(f"orientation right: {100 * len(right) / len(found):.2f} %")
    print(f"up right: {100 * np.mean([answer.up for answer in found]):.2f} %")
    close = np.mean([answer.right and answer.gap <= CLOSE for answer in found])
    print(
        f"right and parameters within 2 % of the height of the upright answer: {100 * close:.2f} %"
    )
    print(f"of the right ones: {100 * np.mean([a.gap <= CLOSE for a in right]):.2f} %")
    print(f"not recognised: {100 * np.mean([answer.refused for answer in found]):.2f} %")
    for shape in shapes:
        own = [answer for answer in found if answer.name == shape.name]
        wrong = sum(not answer.right for answer in own)
        far = sum(answer.right and answer.gap > CLOSE for answer in own)
        if wrong or far:
            print(f"  {shape.name}: {wrong} wrong, {far} with other parameters, of {len(own)}")


if __name__ == "__main__":
    main()
