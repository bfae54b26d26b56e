"""From a part's unit shape to space and back.

A part is stretched, leant and tapered along its run: seen from one end to the other, its section
passes evenly from one size and place to another.  With unit coordinates `u`, ``s = u[run]``, and
``[A | c]`` and ``T`` the part's frame and taper::

    x = (A + s T) u + c

Beyond the ends the section stays as it is there: ``s`` is clamped in the taper, so that the map can
be inverted everywhere, past the point of a delta wing too.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

THINNEST = 1e-3
"""Sections count as no thinner than this in the way back, in normalised lengths."""


@dataclass(frozen=True)
class Frames:
    """The maps of all parts at given parameters.

    Attributes:
        frames: ``[P, 3, 4]``; of the columns of A only the run's has entries off the diagonal.
        tapers: ``[P, 3, 3]`` diagonal, with nothing along the run.
        run: ``[P]`` int64, the axis that each part runs along.
    """

    frames: Array
    tapers: Array
    run: NDArray[np.int64]

    def place(self, u: Array) -> Array:
        """Points ``[..., P, 3]`` in space of unit coordinates ``u [..., P, 3]``."""
        s = np.clip(self._along(u), -0.5, 0.5)
        straight = np.einsum("pij,...pj->...pi", self.frames[:, :, :3], u) + self.frames[:, :, 3]
        placed: Array = straight + s[..., None] * self._tapered(u)
        return placed

    def derivative(self, u: Array) -> Array:
        """``[..., P, 3, 3]`` derivative of `place`; at the ends that of the inside."""
        along = self._along(u)
        s = np.clip(along, -0.5, 0.5)
        inside = np.abs(along) <= 0.5
        to_run = np.eye(3)[self.run]
        slope = np.where(inside[..., None], self._tapered(u), 0.0)
        linear: Array = self.frames[:, :, :3] + s[..., None, None] * self.tapers
        return linear + slope[..., :, None] * to_run[:, None, :]

    def unit(self, x: Array) -> Array:
        """Unit coordinates ``[n, P, 3]`` of points ``x [n, 3]``: the inverse of `place`.

        Exact, but where a section is thinner than `THINNEST`, which then stands in for its size.
        """
        parts = np.arange(len(self.run))
        linear, center = self.frames[:, :, :3], self.frames[:, :, 3]
        length = linear[parts, self.run, self.run]
        along = (x[:, self.run] - center[parts, self.run]) / _solid(length)
        lean = linear[parts, :, self.run]
        taper = np.diagonal(self.tapers, axis1=1, axis2=2)
        size = np.diagonal(linear, axis1=1, axis2=2)
        section = size + np.clip(along, -0.5, 0.5)[..., None] * taper
        u = (x[:, None] - center - along[..., None] * lean) / _solid(section)
        u[:, parts, self.run] = along
        return u

    def _along(self, u: Array) -> Array:
        """``[..., P]`` each part's own coordinate along its run."""
        return u[..., np.arange(len(self.run)), self.run]

    def _tapered(self, u: Array) -> Array:
        tapered: Array = np.einsum("pij,...pj->...pi", self.tapers, u)
        return tapered


def _solid(size: Array) -> Array:
    """Sizes with their sign, none nearer to nothing than `THINNEST`."""
    solid: Array = np.copysign(np.maximum(np.abs(size), THINNEST), size)
    return solid
