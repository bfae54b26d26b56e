"""Round unit shapes: rings of vertices one above the other, closed at both ends."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from service.template.unitshape import UnitShape

Array = NDArray[np.float64]

ROUND_SIDES = ("start", "end", "around")
"""The flat ends, where a shape has any, and what lies between."""
SLENDERNESS = 6.0
"""Length over width that rings are spaced evenly for."""


def tube(cells: tuple[int, int], power: float = 2.0) -> UnitShape:
    """A cylinder along z with flat ends, whose edges are sharp.

    Args:
        cells: number of faces around, a multiple of 4, and along.
        power: of the superellipse across; 2 is a circle, more is squarer.

    Returns:
        ``around (along + 1) + 2 (around + 1)`` vertices.
    """
    around, along = cells
    rings = np.linspace(-0.5, 0.5, along + 1)
    outline = _superellipse(around, power)
    wall = np.concatenate([np.insert(outline, 2, z, axis=1) for z in rings])
    faces = [_wall(around, along)]
    points, count = [wall], len(wall)
    for z in (-0.5, 0.5):
        disc = np.concatenate([np.insert(outline, 2, z, axis=1), [[0.0, 0.0, z]]])
        fan = _fan(np.arange(around), around)
        faces.append(count + (fan if z > 0 else fan[:, ::-1]))
        points.append(disc)
        count += len(disc)
    side = np.repeat([2, 0, 1], [len(f) for f in faces])
    return UnitShape(np.concatenate(points), np.concatenate(faces), side, ROUND_SIDES)


def ellipsoid(cells: tuple[int, int], power: float = 2.0) -> UnitShape:
    """A ball, or with a `power` above 2 one on the way to a cube; its poles lie along z.

    Args:
        cells: number of faces around, a multiple of 4, and from pole to pole, an even one.
        power: of the superellipses across and along.

    Returns:
        ``around (along - 1) + 2`` vertices.
    """
    around, along = cells
    profile = _superellipse(2 * along, power)[: along + 1]
    size, z = 2.0 * profile[::-1, 1], profile[::-1, 0]
    return _poled(_superellipse(around, power), z, np.maximum(size, 0.0), np.zeros_like(z))


def fuselage(
    cells: tuple[int, int],
    nose: float,
    tail: float,
    upsweep: float = 0.0,
    power: float = 2.0,
) -> UnitShape:
    """A body along z with an elliptic nose in front (+z) and a tapering tail.

    Args:
        cells: number of faces around, a multiple of 4, and from the tail's end to the nose's.
        nose, tail: shares of the length that they take, one in sum at most.
        upsweep: where the tail's end lies: 0 on the axis, 1 at the height of the body's top.
        power: of the superellipse across.

    Returns:
        ``around (along - 1) + 2`` vertices.

    Raises:
        ValueError: when nose and tail leave no room for each other.
    """
    if min(nose, tail) <= 0.0 or nose + tail > 1.0:
        raise ValueError(f"nose {nose} and tail {tail} are not positive shares of one length")
    around, along = cells
    fine = np.linspace(-0.5, 0.5, 4001)
    arc = np.hypot(SLENDERNESS * np.diff(fine), np.diff(_girth(fine, nose, tail)) / 2)
    length = np.insert(np.cumsum(arc), 0, 0.0)
    z = np.interp(np.linspace(0.0, length[-1], along + 1), length, fine)
    # One ring exactly where the body is widest, however the others fall.
    z[1:-1][np.abs(z[1:-1] - (0.5 - nose)).argmin()] = 0.5 - nose
    size = _girth(z, nose, tail)
    rise = np.where(z < tail - 0.5, upsweep * (1.0 - size) / 2, 0.0)
    return _poled(_superellipse(around, power), z, size, rise)


def _girth(z: Array, nose: float, tail: float) -> Array:
    """Width of a fuselage over its greatest, from the tail at -1/2 to the nose at 1/2."""
    ahead = np.clip(1.0 - (0.5 - z) / nose, 0.0, 1.0)
    behind = np.clip(1.0 - (z + 0.5) / tail, 0.0, 1.0)
    girth: Array = np.where(behind > 0.0, 1.0 - behind**2, np.sqrt(1.0 - ahead**2))
    return girth


def _poled(outline: Array, z: Array, size: Array, rise: Array) -> UnitShape:
    """Rings of given sizes between two single points, lifted along y by `rise`."""
    around, along = len(outline), len(z) - 1
    rings = np.empty((along - 1, around, 3))
    rings[..., :2] = outline * size[1:-1, None, None]
    rings[..., 1] += rise[1:-1, None]
    rings[..., 2] = z[1:-1, None]
    ends = np.array([[0.0, rise[0], z[0]], [0.0, rise[-1], z[-1]]])
    count = around * (along - 1)
    last = np.arange(around) + around * (along - 2)
    faces = np.concatenate([
        _wall(around, along - 2),
        _fan(np.arange(around), count)[:, ::-1],
        _fan(last, count + 1),
    ])  # fmt: skip
    vertices = np.concatenate([rings.reshape(-1, 3), ends])
    return UnitShape(vertices, faces, np.full(len(faces), 2), ROUND_SIDES)


def _superellipse(count: int, power: float) -> Array:
    """``[count, 2]`` points of ``|2 x|^power + |2 y|^power = 1``, counter-clockwise from +x.

    Raises:
        ValueError: when the count would miss the ends of the axes, or there is no such curve.
    """
    if count % 4 or power <= 0.0:
        raise ValueError(
            f"{count} vertices around at power {power}: give a multiple of 4 and a positive power"
        )
    angle = 2 * np.pi * np.arange(count) / count
    ray = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    ray[np.abs(ray) < 1e-12] = 0.0
    return 0.5 * np.sign(ray) * np.abs(ray) ** (2.0 / power)


def _wall(around: int, along: int) -> NDArray[np.int64]:
    """Triangles between ``along + 1`` rings of ``around`` vertices, ring by ring from below."""
    a = (np.arange(around) + around * np.arange(along)[:, None]).ravel()
    b = (np.roll(np.arange(around), -1) + around * np.arange(along)[:, None]).ravel()
    return np.concatenate([
        np.stack([a, b, b + around], axis=1), np.stack([a, b + around, a + around], axis=1)
    ])  # fmt: skip


def _fan(ring: NDArray[np.int64], center: int) -> NDArray[np.int64]:
    """Triangles from a ring to one vertex above it."""
    return np.stack([ring, np.roll(ring, -1), np.full_like(ring, center)], axis=1)
