"""Meshes for the tests of this folder."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from service.template.affine import AffineTemplate
from service.template.loader import load_template
from service.template.shapes import box

# A chair of the size that the normalised frame has them, and where its origin lies.
PARAMETERS = np.array([0.5, 0.04, 0.05, 0.45, 0.42, 0.40, 0.04, 0.05])
ORIGIN = np.array([0.01, -0.05, 0.02])


def chair() -> AffineTemplate:
    return load_template("paper_chair")


def change(name: str, by: float) -> NDArray[np.float64]:
    """A change of one of the chair's parameters."""
    df = np.zeros(8)
    df[chair().names.index(name)] = by
    return df


def block(
    low: tuple[float, float, float], high: tuple[float, float, float], cells: int = 4
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """A box from corner to corner, placed like the chair; its sides share no vertices."""
    shape = box((cells, cells, cells))
    size = np.subtract(high, low)
    return shape.vertices * size + np.add(low, high) / 2 + ORIGIN, shape.faces


def joined(
    *meshes: tuple[NDArray[np.float64], NDArray[np.int64]],
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    starts = np.cumsum([0, *(len(v) for v, _ in meshes)])
    faces = [f + start for (_, f), start in zip(meshes, starts[:-1], strict=True)]
    return np.concatenate([v for v, _ in meshes]), np.concatenate(faces)


def template_mesh() -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """The chair itself as an upload."""
    template = chair()
    return template.decode(PARAMETERS) + ORIGIN, template.faces
