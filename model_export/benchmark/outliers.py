"""The inputs O: what the paper shows of shapes unlike its training's, each made anew."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from model_export.benchmark.case import Case
from model_export.benchmark.known import inferred
from model_export.detailed import detailed_airplane
from model_export.detailed.lofts import turned
from model_export.primitives import Mesh, join, slab, tube
from service.encode.model import Model
from service.mesh.surface import Normalization


def pedestal() -> Mesh:
    """A chair on one leg."""
    base = upright([0.0, 0.02, 0.03, 0.2, 0.4], [0.24, 0.23, 0.06, 0.035, 0.035])
    seat = slab((0, 0.42, 0), (0.44, 0.05, 0.44), 0.02, 3)
    back = slab((0, 0.68, -0.2), (0.42, 0.48, 0.03), 0.01, 3)
    return join([base, seat, back])


def toilet() -> Mesh:
    """A bowl, a seat, a lid that is up, and a cistern."""
    bowl = upright([0.0, 0.05, 0.2, 0.33, 0.40], [0.13, 0.12, 0.12, 0.19, 0.20])
    seat = slab((0, 0.415, 0.0), (0.38, 0.03, 0.42), 0.012, 3)
    lid = slab((0, 0.62, -0.19), (0.36, 0.38, 0.025), 0.01, 3)
    cistern = slab((0, 0.58, -0.29), (0.42, 0.36, 0.16), 0.02, 3)
    return join([bowl, seat, lid, cistern])


def pillows() -> Mesh:
    """A chair with arms and pillows."""
    pieces = [
        slab((0, 0.26, 0), (0.62, 0.16, 0.6), 0.03, 3),
        slab((0, 0.55, -0.26), (0.62, 0.5, 0.12), 0.04, 3),
        slab((0, 0.40, 0.05), (0.58, 0.14, 0.5), 0.06, 3),
        slab((-0.12, 0.60, -0.12), (0.3, 0.3, 0.14), 0.06, 3),
        slab((0.14, 0.60, -0.13), (0.3, 0.3, 0.14), 0.06, 3),
    ]
    for side in (-1, 1):
        pieces.append(slab((side * 0.37, 0.36, 0.0), (0.12, 0.36, 0.6), 0.04, 3))
        for ahead in (-1, 1):
            foot = np.linspace(0.0, 0.18, 9)[:, None] * [0.0, 1.0, 0.0]
            path = foot + np.array([side * 0.27, 0.0, ahead * 0.25])
            pieces.append(tube(path, np.full((9, 2), 0.025), 12, True))
    return join(pieces)


def upright(y: list[float], radius: list[float]) -> Mesh:
    """A body turned about the vertical axis."""
    at = np.linspace(y[0], y[-1], 24)
    vertices, faces = turned(at, np.interp(at, y, radius), np.zeros(3), 24)
    return vertices[:, [1, 2, 0]], faces


def airplane(seed: int, **style: object) -> Mesh:
    """A detailed airplane of that style."""
    shape = detailed_airplane(seed, 3, **style)
    return shape.mesh(shape.parameters), shape.faces


def delta() -> Mesh:
    """A delta wing without a tailplane."""
    length = float(detailed_airplane(1).parameters[1])
    return airplane(
        1, tailplane=False, engines="none", winglet=0.0, kink=0.0, chord=0.5 * length,
        tip_chord=0.04 * length, sweep=0.26 * length, station=-0.12, thick=0.05, level=-0.1,
    )  # fmt: skip


OUTLIERS: dict[str, tuple[str, Callable[[], Mesh]]] = {
    "one leg": ("chair", pedestal),
    "toilet": ("chair", toilet),
    "arms and pillows": ("chair", pillows),
    "delta wing": ("airplane", delta),
    "no tailplane": ("airplane", lambda: airplane(0, tailplane=False)),
    "tailplane on top": ("airplane", lambda: airplane(3, on_fin=1.0)),
    "three fins": ("airplane", lambda: airplane(1, side_fins=True, on_fin=0.0)),
    "straight wings, propellers": ("airplane", lambda: airplane(7, engines="props", blades=4)),
}


def outlier_cases(model: Model) -> Iterator[Case]:
    """Those of a category."""
    for name, (category, make) in OUTLIERS.items():
        if category != model.name:
            continue
        vertices, faces = make()
        x = Normalization.of(vertices).apply(vertices)
        known = {"inferred": inferred(model, x, faces)}
        yield Case("O", name, model.template, x, faces, known)
