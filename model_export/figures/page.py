"""A sheet: rows of pictures, each row to one scale and in one frame, so that nothing moves but what
an edit moves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib import font_manager
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from model_export.pictures import Array, Panel, faces_of
from model_export.raster import paint

FINER = 3
"""Times as many pixels a side are drawn as shown."""
MARGIN = 5
"""Pixels around a picture."""
TEXT = 11
LINE = 14
"""Pixels of a letter and of a line."""
COLOURS = 256
"""On a sheet: flat shading has few."""


@dataclass(frozen=True)
class Page:
    """How pictures are laid out.

    Attributes:
        width: of a picture in pixels.
        height: at most; a row is no higher than what it shows.
        camera: see `pictures.view`.
    """

    width: int
    height: int
    camera: Array

    def image(self, groups: Sequence[Sequence[Sequence[Panel]]]) -> Image.Image:
        """The sheet of groups of rows; all pictures of a group have one scale and frame."""
        strips = [self._strip(row, self._frame(group)) for group in groups for row in group]
        size = max(strip.width for strip in strips), sum(strip.height for strip in strips)
        sheet = Image.new("RGB", size, "white")
        top = 0
        for strip in strips:
            sheet.paste(strip, (0, top))
            top += strip.height
        return sheet

    def _frame(self, rows: Sequence[Sequence[Panel]]) -> tuple[Array, float, tuple[int, int]]:
        """Middle of what rows show, pixels a unit, and width and height of each picture."""
        shown = [
            (mesh[0] @ self.camera.T)[mesh[1]].reshape(-1, 3)[:, :2]
            for row in rows
            for panel in row
            for mesh in panel.meshes
        ]
        low = np.min([points.min(axis=0) for points in shown], axis=0)
        high = np.max([points.max(axis=0) for points in shown], axis=0)
        wide, tall = np.maximum(high - low, 1e-9)
        scale = float(min((self.width - 2 * MARGIN) / wide, (self.height - 2 * MARGIN) / tall))
        return (low + high) / 2, scale, (self.width, int(np.ceil(tall * scale)) + 2 * MARGIN)

    def _strip(
        self, panels: Sequence[Panel], frame: tuple[Array, float, tuple[int, int]]
    ) -> Image.Image:
        """A row of pictures, each under its title."""
        middle, scale, (width, height) = frame
        titles = [panel.title.splitlines() for panel in panels]
        above = LINE * max(map(len, titles)) + MARGIN
        strip = Image.new("RGB", (width * len(panels), above + height), "white")
        pen, font = ImageDraw.Draw(strip), _font()
        for index, (panel, lines) in enumerate(zip(panels, titles, strict=True)):
            left = index * width
            for row, line in enumerate(lines):
                at = left + (width - pen.textlength(line, font)) / 2
                pen.text((at, MARGIN + row * LINE), line, "black", font)
            if panel.meshes:
                strip.paste(self._picture(panel, middle, scale, width, height), (left, above))
        return strip

    def _picture(
        self, panel: Panel, middle: Array, scale: float, width: int, height: int
    ) -> Image.Image:
        corners, colours, opacity = faces_of(panel, self.camera)
        size = FINER * width, FINER * height
        fine = paint(corners, colours, opacity, middle, FINER * scale, size)
        on_white = fine[..., :3] * fine[..., 3:] + 1.0 - fine[..., 3:]
        mean = on_white.reshape(height, FINER, width, FINER, 3).mean(axis=(1, 3))
        levels: NDArray[np.uint8] = np.rint(255 * mean).astype(np.uint8)
        return Image.fromarray(levels)


def write(image: Image.Image, path: Path) -> None:
    """Write a sheet as a PNG of few colours."""
    image.quantize(COLOURS, kmeans=1, dither=Image.Dither.NONE).save(path, optimize=True)


def _font() -> ImageFont.FreeTypeFont:
    return ImageFont.truetype(font_manager.findfont("DejaVu Sans"), TEXT)
