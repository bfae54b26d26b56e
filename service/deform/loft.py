"""Parts that are more than a box: round across, or tapering along their run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from service.deform.binding import FLOOR
from service.template.affine import AffineTemplate
from service.template.frames import Frames
from service.template.unitshape import rings

Array = NDArray[np.float64]
Array32 = NDArray[np.float32]

# Unit shapes whose sections fill their corners up to here are boxes.
FILLED = 0.95


@dataclass(frozen=True)
class Outline:
    """The sections of a unit shape along its run, as ellipses.

    Attributes:
        levels: ``[k]`` ascending, along the run.
        center, half: ``[k, 2]`` middle and half size across it.
    """

    levels: Array
    center: Array
    half: Array

    def at(self, s: Array32) -> tuple[Array32, Array32]:
        """Middle and half size, both ``[2, n]``, at ``s [n]`` along the run."""
        center, half = (
            np.stack([np.interp(s, self.levels, c).astype(np.float32) for c in table.T])
            for table in (self.center, self.half)
        )
        return center, half


@dataclass(frozen=True)
class Loft:
    """One such part at the bound parameters.

    Attributes:
        frame: ``[3, 4]`` and
        taper: ``[3]`` the diagonal of its map's taper (see `service.template.frames`).
        run: the axis it runs along.
        outline: of its unit shape; None for a box.
    """

    frame: Array
    taper: Array
    run: int
    outline: Outline | None

    @property
    def tapered(self) -> bool:
        """Whether its map is more than its frame."""
        return bool(self.taper.any())

    @property
    def across(self) -> list[int]:
        """The two axes across the run."""
        return [axis for axis in range(3) if axis != self.run]

    @property
    def length(self) -> float:
        """Along its run, with its sign."""
        length = float(self.frame[self.run, self.run])
        return float(np.copysign(max(abs(length), FLOOR), length))

    @property
    def lean(self) -> Array32:
        """``[2]`` how far the ends lie apart across the run."""
        return self.frame[self.across, self.run].astype(np.float32)

    def section(self, s: Array32) -> Array32:
        """``[2, n]`` signed sizes across the run at ``s [n]``, none nearer to nothing than
        `FLOOR`."""
        across = self.across
        size = np.multiply.outer(self.taper[across].astype(np.float32), s)
        size += self.frame[across, across].astype(np.float32)[:, None]
        return np.copysign(np.maximum(np.abs(size), np.float32(FLOOR)), size)

    def unit(self, x: Array) -> Array32:
        """Unit coordinates ``[n, 3]`` of points ``x [n, 3]``, as `Frames.unit` has them."""
        u = np.empty((3, len(x)), np.float32)
        along = (x[:, self.run] - self.frame[self.run, 3]) / self.length
        s = np.clip(along, -0.5, 0.5)
        u[self.run] = along
        for axis in self.across:
            size = self.frame[axis, axis] + s * self.taper[axis]
            size = np.copysign(np.maximum(np.abs(size), FLOOR), size)
            u[axis] = (x[:, axis] - self.frame[axis, 3] - along * self.frame[axis, self.run]) / size
        return u.T

    def distance(self, u: Array32) -> Array32:
        """``[n]`` distance from the part, nearly, of points with unit coordinates ``u [n, 3]``."""
        along = u[:, self.run]
        s = np.clip(along, -0.5, 0.5)
        beyond = along - s
        # Across a leaning part, less of an offset along the axes is away from it.
        upright = (1.0 / np.hypot(1.0, self.lean / self.length)).astype(np.float32)[:, None]
        size = np.abs(self.section(s)) * upright
        offset = np.stack([u[:, axis] for axis in self.across]) * size
        offset += np.multiply.outer(self.lean * upright[:, 0], beyond)
        if self.outline is None:
            aside = _beyond_box(offset, np.float32(0.5) * size)
        else:
            center, half = self.outline.at(s)
            half = np.maximum(half * size, np.float32(FLOOR / 2))
            aside = _beyond_ellipse(offset - center * size, half)
        return _norm(aside, beyond * np.float32(self.length))


def lofts(
    template: AffineTemplate, f: Array, frames: Array, tapers: Array, starts: Array
) -> dict[int, Loft]:
    """The parts of a template that are no plain boxes.

    Args:
        template: the category's.
        f: ``[d]`` bound parameters.
        frames, tapers: ``[P, 3, 4]`` and ``[P, 3, 3]`` of the parts as they are bound, which begin
        starts: ``[P]`` so far along the template's own.
    """
    found = {}
    for part, run in enumerate(template.run.tolist()):
        outline = outline_of(template, f, part, starts[part])
        taper = np.diagonal(tapers[part])
        if outline is not None or taper.any():
            found[part] = Loft(frames[part], taper, run, outline)
    return found


def outline_of(
    template: AffineTemplate, f: Array, part: int, start: float = -0.5
) -> Outline | None:
    """The sections of a part from ``start`` along its run on; None for a box."""
    # Thin parts are seen more clearly in the middle of the ranges, swollen ones as they are.
    own, run, middle = template.part == part, template.run[part], (template.low + template.high) / 2
    plain, swollen = (
        _unit(template.maps(g), part, template.base[own] + template.jacobian[own] @ g)
        for g in (middle, f)
    )
    return None if _is_box(plain, run) else _outline(swollen, run, start)


def _unit(maps: Frames, part: int, x: Array) -> Array:
    """Unit coordinates ``[n, 3]`` of points ``x [n, 3]`` in one part."""
    one = slice(part, part + 1)
    return Frames(maps.frames[one], maps.tapers[one], maps.run[one]).unit(x)[:, 0]


def _is_box(u: Array, run: int) -> bool:
    """Whether a unit shape's vertices ``u [n, 3]`` fill the corners of its sections."""
    across = np.delete(u, run, axis=1)
    return bool(np.abs(2.0 * across).min(axis=1).max() > FILLED)


def _outline(u: Array, run: int, start: float) -> Outline:
    """Of a unit shape's vertices ``u [n, 3]``, from ``start`` on."""
    found = rings(u, run)
    levels = (found.levels - start) / (0.5 - start) - 0.5
    return Outline(levels, (found.low + found.high) / 2, (found.high - found.low) / 2)


def _beyond_box(offset: Array32, half: Array32) -> Array32:
    """``[n]`` distances of points from rectangles, both ``[2, n]``; 0 inside."""
    return _norm(*np.maximum(np.abs(offset) - half, 0.0))


def _beyond_ellipse(offset: Array32, half: Array32) -> Array32:
    """``[n]`` distances of points from ellipses, both ``[2, n]``, nearly; 0 inside.

    To first order in the distance, which falls far short behind a wing, a flat ellipse: there the
    distance from the box around it is better.
    """
    scaled = offset / half
    reach, slope = _norm(*scaled), _norm(*(scaled / half))
    outside = np.maximum(reach - 1.0, 0.0) * reach
    near = outside / np.where(outside > 0.0, slope, 1.0)
    distance: Array32 = np.maximum(near, _beyond_box(offset, half))
    return distance


def _norm(a: Array32, b: Array32) -> Array32:
    """``[n]`` lengths of vectors."""
    # In a fraction of the time of a hypotenuse that bears numbers beyond 1e18.
    length: Array32 = np.sqrt(a * a + b * b)
    return length
