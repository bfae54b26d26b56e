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

from model_export.raster import paint

Array = NDArray[np.float64]

YELLOW = (0.93, 0.78, 0.36)
BLUE = (0.25, 0.47, 0.85)
GREY = (0.66, 0.68, 0.71)
PIXELS = 480
"""Of the side of a panel before it is scaled to its place on the sheet."""

Colour = tuple[float, float, float] | Array
"""Of a mesh; or ``[F, 3]``, of each of its faces."""


@dataclass(frozen=True)
class Panel:
    """One picture of a sheet.

    Attributes:
        title: written above it.
        meshes: vertices, faces, colour and opacity of each mesh, all in one canonical frame; none
            leave its place empty.
    """

    title: str
    meshes: Sequence[tuple[Array, NDArray[np.int64], Colour, float]]


def view(azimuth: float = 35.0, elevation: float = 20.0) -> Array:
    """``[3, 3]`` rotation to right, up and towards the eye, for angles in degrees."""
    a, e = np.radians([azimuth, elevation])
    about_y = np.array([[np.cos(a), 0, -np.sin(a)], [0, 1, 0], [np.sin(a), 0, np.cos(a)]])
    about_x = np.array([[1, 0, 0], [0, np.cos(e), -np.sin(e)], [0, np.sin(e), np.cos(e)]])
    return about_x @ about_y


def faces_of(panel: Panel, camera: Array) -> tuple[Array, Array, Array]:
    """Corners ``[F, 3, 3]`` as a camera has them, colours ``[F, 3]`` and opacities ``[F]``."""
    corners, colours, opacity = [], [], []
    for vertices, faces, colour, share in panel.meshes:
        corners.append((vertices @ camera.T)[faces])
        colours.append(np.broadcast_to(np.asarray(colour), (len(faces), 3)))
        opacity.append(np.full(len(faces), share))
    return np.concatenate(corners), np.concatenate(colours), np.concatenate(opacity)


def draw(axes: Axes, panel: Panel, camera: Array) -> None:
    """Draw a panel's meshes, near faces over far ones, shaded by their normals."""
    corners, colours, opacity = faces_of(panel, camera)
    flat = corners[:, :, :2].reshape(-1, 2)
    middle, half = (flat.min(0) + flat.max(0)) / 2, 0.54 * np.ptp(flat, axis=0).max()
    scale = PIXELS / 2 / half
    picture = paint(corners, colours, opacity, middle, scale, (PIXELS, PIXELS))
    sides = (middle[0] - half, middle[0] + half, middle[1] - half, middle[1] + half)
    axes.imshow(picture, extent=sides)
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
