"""Pictures of meshes with templates drawn over them, to look at fits and edits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import matplotlib
import numpy as np
from numpy.typing import NDArray

matplotlib.use("Agg")

from matplotlib import pyplot
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection

Array = NDArray[np.float64]

YELLOW = (0.93, 0.78, 0.36)
BLUE = (0.25, 0.47, 0.85)
GREY = (0.66, 0.68, 0.71)


@dataclass(frozen=True)
class Panel:
    """One picture of a sheet.

    Attributes:
        title: written above it.
        meshes: vertices, faces, colour and opacity of each mesh, all in one canonical frame; none
            leave its place empty.
    """

    title: str
    meshes: Sequence[tuple[Array, NDArray[np.int64], tuple[float, float, float], float]]


def view(azimuth: float = 35.0, elevation: float = 20.0) -> Array:
    """``[3, 3]`` rotation to right, up and towards the eye, for angles in degrees."""
    a, e = np.radians([azimuth, elevation])
    about_y = np.array([[np.cos(a), 0, -np.sin(a)], [0, 1, 0], [np.sin(a), 0, np.cos(a)]])
    about_x = np.array([[1, 0, 0], [0, np.cos(e), -np.sin(e)], [0, np.sin(e), np.cos(e)]])
    return about_x @ about_y


def draw(axes: Axes, panel: Panel, camera: Array) -> None:
    """Draw a panel's meshes, far faces first, shaded by their normals."""
    triangles, colours = [], []
    light = np.array([0.3, 0.6, 0.74])
    for vertices, faces, colour, opacity in panel.meshes:
        corners = (vertices @ camera.T)[faces]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
        shade = 0.35 + 0.65 * np.abs(normals @ light)
        triangles.append(corners)
        rgb = np.clip(shade[:, None] * np.array(colour), 0, 1)
        colours.append(np.column_stack([rgb, np.full(len(faces), opacity)]))
    corners, rgba = np.concatenate(triangles), np.concatenate(colours)
    order = np.argsort(corners[:, :, 2].mean(axis=1))
    edge = np.where(rgba[order, 3:] < 1, 0.0, 1.0) * rgba[order]
    axes.add_collection(
        PolyCollection(
            corners[order][:, :, :2], facecolors=rgba[order], edgecolors=edge, linewidths=0.2
        )
    )
    flat = corners[:, :, :2].reshape(-1, 2)
    middle, half = (flat.min(0) + flat.max(0)) / 2, 0.54 * np.ptp(flat, axis=0).max()
    axes.set_xlim(middle[0] - half, middle[0] + half)
    axes.set_ylim(middle[1] - half, middle[1] + half)
    axes.set_aspect("equal")
    axes.axis("off")
    axes.set_title(panel.title, fontsize=7)


def save_sheet(
    panels: Sequence[Panel],
    path: Path,
    columns: int = 5,
    size: float = 2.2,
    camera: Array | None = None,
    aspect: float = 1.0,
    same_scale: bool = False,
) -> None:
    """Write the panels as one PNG, row by row.

    Args:
        panels: to draw.
        path: of the PNG.
        columns: panels a row.
        size: height of a panel in inches.
        camera: see `view`.
        aspect: width of a panel over its height.
        same_scale: draw all to one scale, on one floor.
    """
    rows = -(-len(panels) // columns)
    figure, grid = pyplot.subplots(
        rows,
        columns,
        figsize=(columns * size * aspect, rows * size),
        squeeze=False,
        layout="constrained",
    )
    for axes in grid.flat:
        axes.axis("off")
    places = zip(grid.flat, panels, strict=False)
    drawn = [(axes, panel) for axes, panel in places if panel.meshes]
    for axes, panel in drawn:
        draw(axes, panel, view() if camera is None else camera)
    if same_scale:
        height = max(np.ptp(axes.get_ylim()) for axes, _ in drawn)
        for axes, _ in drawn:
            floor, middle = axes.get_ylim()[0], sum(axes.get_xlim()) / 2
            axes.set_ylim(floor, floor + height)
            axes.set_xlim(middle - aspect * height / 2, middle + aspect * height / 2)
    figure.savefig(path, dpi=110)
    pyplot.close(figure)
