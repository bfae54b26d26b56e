"""The paper's comparison of source and target: every source with the parameters of every target.

``python -m model_export.transfer_grid --sources FILE ... --targets DIR --out grid.png``

It draws a grid, sources at the left and targets on top, and prints how far shapes are from the
target: symmetric mean distance of the surfaces, in percent of the target's diagonal.

- source: as it is, stood where the target stands.
- stretched: scaled to the target's bounding box, along each axis: what any viewer offers.
- caged: moved by a cage of 42 vertices as near to the target as that can be brought, round by round
  to the nearest points, which the target itself shows: a bound for methods that learn such cages.
- transferred: edited to the target's parameters, put where the target is.

Targets that the service would not take for one of the category by itself are left out.

Rigid shapes are of any unit, and are first brought to one diagonal; bodies stay in metres.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from model_export.config import SHIPPED
from model_export.pictures import GREY, YELLOW, Panel, save_sheet
from model_export.realistic import RealisticShape, find_shapes
from model_export.rivals.cage import Cage
from service.encode.basemodel import Model
from service.encode.distance import Cloud, mesh_distance
from service.encode.model import load_models
from service.inferences import Inferences
from service.mesh.convert import convert
from service.mesh.formats import read_mesh
from service.mesh.surface import sample_surface
from service.pipeline import infer, transfer
from service.requests import InferOptions, TransferOptions, Upload

Array = NDArray[np.float64]

GREEN = (0.45, 0.72, 0.45)
SAMPLES = 8000
NEAREST = 6000
"""Points of a target that a cage is drawn to; the distance is to others."""
STEP = 5
"""Every so-many-th round is measured."""
HELD_BYTES = 1 << 29
"""Of memory for what is known of the shapes."""


@dataclass(frozen=True)
class Shape:
    """A shape of the grid, +Y up and +Z front, standing on the floor.

    Attributes:
        name: for its picture.
        upload: as it is sent.
        vertices, faces: its own.
    """

    name: str
    upload: Upload
    vertices: Array
    faces: NDArray[np.int64]

    @classmethod
    def of(cls, name: str, path: Path, diagonal: float | None) -> Shape:
        """The mesh of a file, brought to a diagonal if one is given."""
        upload = Upload(path.read_bytes(), path.name)
        mesh = read_mesh(upload.data, upload.name)
        if diagonal is None:
            return cls(name, upload, mesh.vertices, mesh.faces)
        factor = diagonal / np.linalg.norm(np.ptp(mesh.vertices, axis=0))
        scaled = Upload(convert(mesh.vertices * factor, mesh.faces, "ply"), f"{path.stem}.ply")
        return cls(name, scaled, mesh.vertices * factor, mesh.faces)

    def moved(self, vertices: Array) -> Shape:
        """The same with other positions."""
        return replace(self, vertices=vertices)

    def panel(self, colour: tuple[float, float, float], title: str = "") -> Panel:
        """Its picture."""
        return Panel(title, [(self.vertices, self.faces, colour, 1.0)])


@dataclass(frozen=True)
class Pair:
    """A source with a target's parameters, and how far each is from the target."""

    result: Shape
    source: float
    stretched: float
    caged: float
    transferred: float


def paired(
    source: Shape,
    target: Shape,
    models: Mapping[str, Model],
    options: InferOptions,
    known: Inferences,
    cage: Cage,
) -> Pair:
    """One cell of the grid; the cage is the source's."""
    how = TransferOptions(position="target")
    edited = transfer(source.upload, target.upload, models, options, options, how, known)
    result = source.moved(read_mesh(edited.data, source.upload.name).vertices)
    own, box = source.vertices, target.vertices
    ratio = np.ptp(box, axis=0) / np.maximum(np.ptp(own, axis=0), 1e-12)
    return Pair(
        result,
        source=distance(source.moved(_stood(own, box)), target),
        stretched=distance(source.moved(_stood(own * ratio, box)), target),
        caged=caged(source, target, cage),
        transferred=distance(result, target),
    )


def caged(source: Shape, target: Shape, cage: Cage) -> float:
    """The least distance of any round of drawing the source to the target, beginning with it as it
    stands and with it stretched."""
    own, box = source.vertices, target.vertices
    points = sample_surface(box, target.faces, NEAREST, np.random.default_rng(2)).points
    reached = []
    for ratio in (np.ones(3), np.ptp(box, axis=0) / np.maximum(np.ptp(own, axis=0), 1e-12)):
        shift = (_stood(own * ratio, box) - own * ratio)[0]
        rounds = cage.drawn_to(source.faces, np.stack([ratio, shift]), points)
        reached += [distance(source.moved(made), target) for made in rounds[::STEP]]
    return min(reached)


def _stood(vertices: Array, where: Array) -> Array:
    """Vertices moved to stand on the same floor as others, about the same middle."""
    middles = [(points.min(axis=0) + points.max(axis=0)) / 2 for points in (vertices, where)]
    shift = middles[1] - middles[0]
    shift[1] = where[:, 1].min() - vertices[:, 1].min()
    return np.asarray(vertices + shift)


def distance(shape: Shape, target: Shape) -> float:
    """Symmetric mean distance of two surfaces over the target's diagonal."""
    samples = sample_surface(target.vertices, target.faces, SAMPLES, np.random.default_rng(0))
    return mesh_distance(shape.vertices, shape.faces, Cloud(samples.points, samples.normals))


def panels(
    sources: Sequence[Shape], targets: Sequence[Shape], grid: Sequence[Sequence[Pair]], across: int
) -> list[Panel]:
    """The grid in bands of so many targets: a row of them, and a row a source."""
    empty, drawn = Panel("", []), []
    for start in range(0, len(targets), across):
        band = range(start, start + across)
        row = [targets[i].panel(GREEN) if i < len(targets) else empty for i in band]
        drawn += [empty, *row]
        for source, pairs in zip(sources, grid, strict=True):
            row = [pairs[i].result.panel(GREY) if i < len(targets) else empty for i in band]
            drawn += [source.panel(YELLOW), *row]
    return drawn


def table(grid: Sequence[Sequence[Pair]]) -> str:
    """Mean and median of each distance in percent, and how often the transfer is the nearer."""
    pairs = [pair for row in grid for pair in row]
    figures = {
        name: np.array([getattr(pair, name) for pair in pairs])
        for name in ("source", "stretched", "caged", "transferred")
    }
    lines = ["| | mean | median | transferred is nearer |", "|---|---|---|---|"]
    for name, values in figures.items():
        nearer = float((figures["transferred"] < values).mean())
        told = "" if name == "transferred" else f"{100 * nearer:.0f} % of {len(pairs)}"
        mean, median = 100 * values.mean(), 100 * np.median(values)
        lines.append(f"| {name} | {mean:.2f} | {median:.2f} | {told} |")
    return "\n".join(lines)


def found(paths: Sequence[Path], licences: Sequence[str]) -> list[RealisticShape]:
    """The files, and of folders the held-out shapes of some licences, in the order of those."""
    shapes: list[RealisticShape] = []
    for path in paths:
        if path.is_file():
            shapes.append(RealisticShape(path.stem, path, True, {}))
            continue
        held_out = [s for s in find_shapes(path) if s.held_out and s.info.get("core", True)]
        if licences:
            kept = [s for s in held_out if _licence(s) in licences]
            held_out = sorted(kept, key=lambda shape: licences.index(_licence(shape)))
        shapes += held_out
    return shapes


def _licence(shape: RealisticShape) -> str:
    return str(shape.info.get("licence", shape.info.get("license", "")))


def gathered(
    arguments: argparse.Namespace, model: Model, known: Inferences
) -> tuple[list[Shape], list[Shape]]:
    """Sources and targets; no shape is its own target."""
    diagonal = None if model.turns_freely else 1.0
    takers = found(arguments.sources, arguments.licences)
    paths = {shape.path.resolve() for shape in takers}
    givers = [
        shape
        for shape in found(arguments.targets, arguments.licences)
        if shape.path.resolve() not in paths
    ]
    sources, targets = (
        [Shape.of(shape.name, shape.path, diagonal) for shape in shapes]
        for shapes in (takers, givers)
    )
    if not arguments.all:
        options, models = _upright(model), {model.name: model}
        targets = [t for t in targets if infer(t.upload, models, options, known).in_distribution]
    return sources, targets[: arguments.count]


def _upright(model: Model) -> InferOptions:
    return InferOptions(model.name, "+y", "+z")


def measured(
    sources: Sequence[Shape], targets: Sequence[Shape], model: Model, known: Inferences
) -> list[list[Pair]]:
    """The grid, each pair printed as it comes."""
    grid = []
    for source in sources:
        row, cage = [], Cage.about(source.vertices)
        for target in targets:
            pair = paired(source, target, {model.name: model}, _upright(model), known, cage)
            figures = (pair.source, pair.stretched, pair.caged, pair.transferred)
            told = " ".join(f"{100 * figure:6.2f}" for figure in figures)
            print(f"{source.name:32} {target.name:32} {told}")
            row.append(pair)
        grid.append(row)
    return grid


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(
        prog="python -m model_export.transfer_grid",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--category", default="chair", help="of all shapes")
    parser.add_argument("--models", type=Path, default=SHIPPED, help="models folder")
    for name in ("--sources", "--targets"):
        parser.add_argument(
            name, type=Path, nargs="+", required=True, help="files, or folders of real meshes"
        )
    parser.add_argument("--licences", nargs="*", default=[], help="of a folder's shapes, in order")
    parser.add_argument("--all", action="store_true", help="targets, also those not recognised")
    parser.add_argument("--count", type=int, help="of targets at most")
    parser.add_argument("--across", type=int, default=11, help="targets a row of the picture")
    parser.add_argument("--out", type=Path, default=Path("runs/transfer.png"), help="PNG to write")
    arguments = parser.parse_args()
    model, known = load_models(arguments.models)[arguments.category], Inferences(HELD_BYTES)
    sources, targets = gathered(arguments, model, known)
    grid = measured(sources, targets, model, known)
    print(table(grid))
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    across = min(arguments.across, len(targets))
    drawn = panels(sources, targets, grid, across)
    save_sheet(drawn, arguments.out, 1 + across, size=1.2, aspect=0.8, same_scale=True)


if __name__ == "__main__":
    main()
