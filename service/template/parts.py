"""Parts as template files write them: a unit shape, where it is placed, and its mirrored copies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from service.template.expressions import ExpressionError, parse_rows
from service.template.shapes import RUN, unit_shape
from service.template.swelling import swelling
from service.template.unitshape import UnitShape

Array = NDArray[np.float64]


class PartError(ValueError):
    """A part that can't be made; the message names it."""


@dataclass(frozen=True)
class Part:
    """One placed unit shape.

    Attributes:
        name: of the part.
        shape: its mesh.
        frame: ``[3, 4, 1 + d]`` and
        taper: ``[3, 3, 1 + d]`` affine rows of its map (see `service.template.frames`).
        swell: ``[n, 3, 1 + d]`` what its sections add to that (see `service.template.swelling`).
        run: the axis it runs along.
        hidden: ``[m]`` bool, faces that are never seen from outside.
    """

    name: str
    shape: UnitShape
    frame: Array
    taper: Array
    swell: Array
    run: int
    hidden: NDArray[np.bool_]

    def vertices(self) -> Array:
        """``[n, 3, 1 + d]`` affine rows of the vertices' coordinates."""
        unit = self.shape.vertices
        straight = np.einsum("vk,ckd->vcd", homogeneous(unit), self.frame) + self.swell
        if not self.taper.any():
            return straight
        s = unit[:, self.run, None]
        tapered: Array = straight + np.einsum("vk,ckd->vcd", s * unit, self.taper)
        return tapered

    def mirrored(self, name: str, axes: str) -> Part:
        """The reflection across the planes through the origin that are normal to `axes`."""
        sign = np.array([-1.0 if axis in axes else 1.0 for axis in "xyz"])[:, None, None]
        faces = self.shape.faces[:, ::-1] if len(axes) % 2 else self.shape.faces
        return replace(
            self,
            name=name,
            shape=replace(self.shape, faces=faces),
            frame=sign * self.frame,
            taper=sign * self.taper,
            swell=sign[:, 0] * self.swell,
        )


def read_parts(name: str, entry: Mapping[str, Any], names: Sequence[str]) -> list[Part]:
    """A part of a template file and its mirrored copies.

    Args:
        name: of the part.
        entry: ``shape`` and its options; ``center`` and ``size``, or ``start`` and ``end`` of a
            part that tapers or leans ``along`` an axis; ``sections`` that swell between them;
            ``hidden`` sides; ``mirror``.
        names: of the parameters.

    Raises:
        PartError: for an unknown shape, side or axis, or options that make no shape.
        ExpressionError: for a length that is not affine in the parameters.
    """
    along = entry.get("along", RUN.get(entry["shape"], "y"))
    if along not in ("x", "y", "z"):
        raise PartError(f"part {name!r}: along {along!r} is no axis; use x, y or z")
    try:
        shape = unit_shape(entry, along)
        swell = np.zeros((*shape.vertices.shape, 1 + len(names)))
        if "sections" in entry:
            swell = swelling(entry["sections"], shape.vertices, "xyz".index(along), names)
    except ExpressionError:
        raise
    except ValueError as error:
        raise PartError(f"part {name!r}: {error}") from error
    hidden = entry.get("hidden", [])
    unknown = set(hidden) - set(shape.sides)
    if unknown:
        raise PartError(f"part {name!r}: no side is named {sorted(unknown)[0]!r}")
    run = "xyz".index(along)
    frame, taper = _between(entry, names, run) if "start" in entry else _sized(entry, names)
    is_hidden = np.isin(shape.side, [shape.sides.index(side) for side in hidden])
    part = Part(name, shape, frame, taper, swell, run, is_hidden)
    return [part, *(part.mirrored(n, axes) for n, axes in entry.get("mirror", {}).items())]


def _sized(entry: Mapping[str, Any], names: Sequence[str]) -> tuple[Array, Array]:
    """Frame and taper of a part of one size, given by its centre and size."""
    frame = np.zeros((3, 4, 1 + len(names)))
    frame[np.arange(3), np.arange(3)] = parse_rows(entry["size"], names)
    frame[:, 3] = parse_rows(entry["center"], names)
    return frame, np.zeros((3, 3, 1 + len(names)))


def _between(entry: Mapping[str, Any], names: Sequence[str], run: int) -> tuple[Array, Array]:
    """Frame and taper of a part between two sections, each with a centre and two sizes."""
    frame, taper = np.zeros((3, 4, 1 + len(names))), np.zeros((3, 3, 1 + len(names)))
    start, end = (parse_rows(entry[name]["center"], names) for name in ("start", "end"))
    frame[:, 3] = (start + end) / 2
    frame[:, run] = end - start
    across = [axis for axis in range(3) if axis != run]
    first, last = (parse_rows(entry[name]["size"], names) for name in ("start", "end"))
    frame[across, across] = (first + last) / 2
    taper[across, across] = last - first
    return frame, taper


def homogeneous(points: Array) -> Array:
    """``[n, 3]`` points with a fourth coordinate of 1."""
    return np.pad(points, ((0, 0), (0, 1)), constant_values=1.0)
