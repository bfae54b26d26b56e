"""Detailed chairs, and what a true edit of one does.

The truth is a carpenter's: a wider chair has a wider seat, cushion, apron and rails, while legs,
posts and arms move apart and keep their thickness; stretchers lengthen, slats and spindles spread
and keep their number and section; a leg's or a back's lean, as a distance, stays.  Rounded edges
keep their radius, and a leg without rails stretches evenly.  A thicker back has thicker posts,
slats or panel, and the same spindles.  No true edit folds a face.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from model_export.detailed.shape import DetailedShape, named
from model_export.primitives import (
    Array,
    Faces,
    Mesh,
    bar,
    join,
    lattice_surface,
    slab,
    tube,
)

NAMES = (
    "back_height", "back_thickness", "seat_thickness", "seat_depth",
    "seat_width", "leg_height", "leg_depth", "leg_width",
)  # fmt: skip

ROOM = 1.45
"""How much of a welded seat's underside a leg has to grow into, over its width and depth."""
ARM_HALF = (0.022, 0.014)
"""Half an arm's width and thickness,"""
ARM_SHORT = 0.05
"""and how far behind the seat's front edge it ends."""


@dataclass(frozen=True)
class DetailedChair(DetailedShape):
    """A chair; its origin is the centre of the seat."""

    @property
    def arms(self) -> bool:
        """Whether it has any."""
        return self.variant == "armchair"


def detailed_chair(seed: int, density: int | None = None) -> DetailedChair:
    """The chair of a seed; every third is welded.

    Args:
        seed: of all that is drawn.
        density: how finely it is cut, from 1 (1 000 to 3 000 vertices) to 10 (100 000); drawn from
            2 to 4 by default.
    """
    rng = np.random.default_rng([2020, seed])
    low = [0.36, 0.018, 0.025, 0.38, 0.38, 0.30, 0.028, 0.028]
    high = [0.62, 0.050, 0.080, 0.52, 0.56, 0.50, 0.055, 0.055]
    parameters = rng.uniform(low, high)
    welded = seed % 3 == 2
    style = _style(rng)
    style.density = density or style.density
    style.room = ROOM * parameters[[7, 6]]
    builder = _welded if welded else _assembled

    def build(p: SimpleNamespace) -> Mesh:
        return builder(p, style)

    p = named(NAMES, parameters)
    nuisances = _nuisances(p, style, 0.0 if welded else style.inset)
    variant = "armchair" if style.arms and not welded else "chair"
    return DetailedChair("chair", NAMES, parameters, build(p)[1], welded, nuisances, variant, build)


def _nuisances(p: SimpleNamespace, s: SimpleNamespace, inset: float) -> dict[str, float]:
    sideways, lengthways = s.splay
    return {
        "leg_splay": sideways, "front_splay": lengthways, "rear_splay": lengthways,
        "leg_inset": inset, "front_inset": inset, "rear_inset": inset, "back_recline": s.recline,
        "arm_height": s.arms + ARM_HALF[1], "arm_gap": s.arm_out - ARM_HALF[0],
        "arm_width": 2 * ARM_HALF[0], "arm_thickness": 2 * ARM_HALF[1],
        "arm_length": p.seat_depth - ARM_SHORT,
    }  # fmt: skip


def _style(rng: np.random.Generator) -> SimpleNamespace:
    """What no parameter says; lengths in metres."""
    return SimpleNamespace(
        leg=rng.choice(["square", "tapered", "turned"]),
        splay=rng.choice([0.0, 1.0]) * rng.uniform(0.01, 0.07, 2),
        inset=rng.choice([0.0, 1.0]) * rng.uniform(0.0, 0.05),
        posts_are_legs=bool(rng.random() < 0.4),
        recline=rng.uniform(0.0, 0.12),
        bow=rng.choice([0.0, 1.0]) * rng.uniform(0.0, 0.03),
        back=rng.choice(["slats", "spindles", "panel"]),
        slats=int(rng.integers(2, 6)),
        spindles=int(rng.integers(4, 9)),
        fillet=rng.uniform(0.002, 0.01),
        cushion=rng.choice([0.0, 1.0]) * rng.uniform(0.03, 0.07),
        back_cushion=rng.choice([0.0, 0.0, 1.0]) * rng.uniform(0.03, 0.06),
        apron=rng.choice([0.0, 1.0]) * rng.uniform(0.04, 0.08),
        stretcher=rng.choice([0.0, 1.0]) * rng.uniform(0.2, 0.6),
        arms=rng.choice([0.0, 1.0]) * rng.uniform(0.16, 0.24),
        arm_out=rng.uniform(0.0, 0.04),
        density=int(rng.integers(2, 5)),
    )


def _assembled(p: SimpleNamespace, s: SimpleNamespace) -> Mesh:
    top = p.seat_thickness / 2
    seat = (p.seat_width, p.seat_thickness, p.seat_depth)
    pieces = [slab((0, 0, 0), seat, s.fillet, s.density)]
    pieces += [_leg(p, s, x, z) for x in (-1, 1) for z in (-1, 1)]
    pieces += _back(p, s)
    if s.cushion:
        size = (p.seat_width - 0.03, s.cushion, p.seat_depth - 0.07)
        center = (0, top + s.cushion / 2, 0.02)
        pieces.append(slab(center, size, 0.02, s.density))
    if s.apron:
        pieces += _rails(p, s, -top - s.apron / 2, (0.01, s.apron / 2), 0.0)
    if s.stretcher:
        y = -top - p.leg_height * (1 - s.stretcher)
        pieces += _rails(p, s, y, (0.009, 0.009), 1 - s.stretcher)
    if s.arms:
        pieces += [piece for side in (-1, 1) for piece in _arm(p, s, side)]
    return join(pieces)


def _leg_center(p: SimpleNamespace, s: SimpleNamespace, x: int, z: int, down: ArrayLike) -> Array:
    """Points ``[n, 3]`` of a leg's axis, `down` from 0 at the seat to 1 at the floor."""
    down = np.asarray(down, np.float64)
    return np.stack(
        [
            x * (p.seat_width / 2 - p.leg_width / 2 - s.inset + s.splay[0] * down),
            -p.seat_thickness / 2 - p.leg_height * down,
            z * (p.seat_depth / 2 - p.leg_depth / 2 - s.inset + s.splay[1] * down),
        ],
        axis=-1,
    )


def _leg(p: SimpleNamespace, s: SimpleNamespace, x: int, z: int) -> Mesh:
    down = np.linspace(0.0, 1.0, 12 * s.density)
    profile = np.ones_like(down)
    if s.leg == "tapered":
        profile = 1.1 - 0.4 * down
    if s.leg == "turned":
        profile = 1.0 + 0.2 * np.sin(25 * down) * np.sin(np.pi * down)
    half = profile[:, None] * np.array([p.leg_width, p.leg_depth]) / 2
    path = _leg_center(p, s, x, z, down)
    if s.posts_are_legs and z < 0:
        # One timber from the floor to the back's top; its section passes into the post's.
        up, post = _post(p, s, x)
        path = np.concatenate([up[::-1], path])
        half = np.concatenate([np.broadcast_to(post, (len(up), 2)), half])
    return tube(path, half, 6 * s.density, s.leg != "turned")


def _post(p: SimpleNamespace, s: SimpleNamespace, x: int) -> tuple[Array, Array]:
    up = np.linspace(0.0, 1.0, 12 * s.density)
    return _back_point(p, s, x * (p.seat_width / 2 - 0.016), up), np.array(
        [0.016, p.back_thickness / 2]
    )


def _back_point(p: SimpleNamespace, s: SimpleNamespace, x: ArrayLike, up: ArrayLike) -> Array:
    """Points ``[n, 3]`` of the back's middle surface, `up` from 0 at the seat to 1 at the top."""
    x, up = np.broadcast_arrays(np.asarray(x, np.float64), np.asarray(up, np.float64))
    bow = s.bow * (1 - (2 * x / p.seat_width) ** 2)
    z = (p.back_thickness - p.seat_depth) / 2 - s.recline * up - bow * up
    return np.stack([x, p.seat_thickness / 2 + p.back_height * up, z], axis=-1)


def _back(p: SimpleNamespace, s: SimpleNamespace) -> Iterator[Mesh]:
    thick = p.back_thickness
    if s.back == "panel":
        size = (p.seat_width, p.back_height, thick)
        flat, faces = slab((0, 0, 0), size, s.fillet, 2 * s.density)
        # The panel follows the back's lean and bow.
        middle = _back_point(p, s, flat[:, 0], flat[:, 1] / p.back_height + 0.5)
        middle[:, 2] += flat[:, 2]
        yield middle, faces
    else:
        if not s.posts_are_legs:
            for x in (-1, 1):
                path, half = _post(p, s, x)
                yield tube(path, np.broadcast_to(half, (len(path), 2)), 6 * s.density, True)
        yield _crossbar(p, s, 1.0, 0.03)
        if s.back == "slats":
            for up in (np.arange(s.slats) + 0.7) / (s.slats + 0.7):
                yield _crossbar(p, s, up, 0.018)
        else:
            span = p.seat_width / 2 - 0.032
            up = np.linspace(0.0, 1.0, 8 * s.density)
            for x in np.linspace(-span, span, s.spindles + 2)[1:-1]:
                half = np.broadcast_to([0.007, 0.007], (len(up), 2))
                yield tube(_back_point(p, s, x, up), half, 4 * s.density, False)
    if s.back_cushion:
        size = (p.seat_width - 0.05, p.back_height - 0.08, s.back_cushion)
        center = _back_point(p, s, 0.0, 0.5)
        center[2] += (thick + s.back_cushion) / 2
        yield slab(center, size, 0.02, s.density)


def _crossbar(p: SimpleNamespace, s: SimpleNamespace, up: float, half: float) -> Mesh:
    """A horizontal bar of the back, hung below the height `up`."""
    x = np.linspace(-1.0, 1.0, 10 * s.density + 1) * (p.seat_width / 2 - 0.03)
    path = _back_point(p, s, x, up)
    path[:, 1] -= half
    section = np.broadcast_to([half, 0.4 * p.back_thickness], (len(x), 2))
    return tube(path, section, 6 * s.density, True)


def _rails(
    p: SimpleNamespace, s: SimpleNamespace, y: float, half: ArrayLike, down: float
) -> Iterator[Mesh]:
    """Four bars from leg to leg; `half` is (across, up), `down` where on the legs they end."""
    across, up = np.asarray(half)
    square = bool(up > 2 * across)
    leg = {(x, z): _leg_center(p, s, x, z, down) for x in (-1, 1) for z in (-1, 1)}
    for side in (-1, 1):
        ends = leg[-1, side], leg[1, side]
        yield bar(*(np.array([e[0], y, e[2]]) for e in ends), (up, across), s.density, square)
        ends = leg[side, -1], leg[side, 1]
        yield bar(*(np.array([e[0], y, e[2]]) for e in ends), (across, up), s.density, square)


def _arm(p: SimpleNamespace, s: SimpleNamespace, side: int) -> Iterator[Mesh]:
    x = side * (p.seat_width / 2 + s.arm_out)
    y = p.seat_thickness / 2 + s.arms
    front = p.seat_depth / 2 - ARM_SHORT
    rear = (p.back_thickness - p.seat_depth) / 2 - s.recline * s.arms / 0.5
    yield bar((x, y, rear), (x, y, front), ARM_HALF, s.density, True)
    yield bar((x, 0, front - 0.03), (x, y, front - 0.03), (0.013, 0.013), s.density, False)


# --- a chair of one piece -------------------------------------------------------------------------


def _lines(stops: list[float], cells: list[int]) -> Array:
    """Lattice lines through `stops`, each interval cut into its number of `cells`."""
    intervals = zip(stops[:-1], stops[1:], cells, strict=True)
    runs = [np.linspace(a, b, count, endpoint=False) for a, b, count in intervals]
    return np.concatenate([*runs, stops[-1:]])


def _welded(p: SimpleNamespace, s: SimpleNamespace) -> Mesh:
    """Cells of a lattice are wood or air; legs and rails have lines of their own."""
    k = s.density
    w, d, st = p.seat_width / 2, p.seat_depth / 2, p.seat_thickness / 2
    x_cells = z_cells = [k, 2 * k, 4 * k, 2 * k, k]
    y_cells = [5 * k, k, 5 * k, k, k] + [3 * k, k] * s.slats
    rail = -st - p.leg_height * (1 - (s.stretcher or 0.4))
    # Where there are no rails, legs stretch evenly.
    low = rail - (0.02 if s.stretcher else 0.05 * p.leg_height)
    apron = s.apron or 0.12 * p.leg_height
    stops = [-st - p.leg_height, low, rail, -st - apron, -st, st]
    up = (np.arange(s.slats)[:, None] + [0.6, 1.0]) / s.slats
    y = _lines([*stops, *(st + p.back_height * up.ravel())], y_cells)
    post, lw, ld = 0.03, p.leg_width, p.leg_depth
    # At its underside the seat leaves room around the legs, so that thicker ones don't fold it.
    under = s.room
    across = _columns(w, x_cells, [(lw, lw), (under[0], under[0]), (post, post)])
    along = _columns(d, z_cells, [(ld, ld), (under[1], under[1]), (p.back_thickness, post)])
    at = [np.repeat(np.arange(len(c)), c) for c in (x_cells, y_cells, z_cells)]
    nodes, faces = lattice_surface(_chair_cells(*np.meshgrid(*at, indexing="ij"), s))
    i, j, h = nodes.T
    corner = ((i <= k) | (i >= 9 * k)) & ((h <= k) | (h >= 9 * k))
    # Legs and rails, the seat down to its underside between them, the back from the seat's top.
    level = np.where((j < 12 * k) | ((j == 12 * k) & corner), 0, np.where(j < 13 * k, 1, 2))
    return _bent(np.stack([across[level, i], y[j], along[level, h]], axis=1), p, s), faces


def _columns(half: float, cells: list[int], ends: list[tuple[float, float]]) -> Array:
    """Lattice lines of the three levels between ``-half`` and ``half``, which have columns of
    widths `ends` at their sides.

    Lines nearer to the middle hold it still when a leg or the back thickens; rails between legs
    stretch evenly.
    """
    quarters = [(half - ends[0][0]) / 2, half / 4, half / 2]
    lines = [
        _lines([-half, -half + low, -quarter, quarter, half - high, half], cells)
        for quarter, (low, high) in zip(quarters, ends, strict=True)
    ]
    return np.stack(lines)


def _chair_cells(i: Faces, j: Faces, h: Faces, s: SimpleNamespace) -> NDArray[np.bool_]:
    """Which cells are wood, from the intervals that they lie in along x, y and z."""
    side, end, rear = (i == 0) | (i == 4), (h == 0) | (h == 4), h == 0
    occupied = j == 4
    occupied |= (j < 4) & side & end
    occupied |= (j == 3) & (side | end) & bool(s.apron)
    occupied |= (j == 1) & (side | end) & bool(s.stretcher)
    occupied |= (j > 4) & rear & (side | (j % 2 == 0) | (s.back == "panel"))
    return occupied


def _bent(v: Array, p: SimpleNamespace, s: SimpleNamespace) -> Array:
    """Turn and splay the legs of a straight chair, and lean its back."""
    st = p.seat_thickness / 2
    down = np.maximum(-st - v[:, 1], 0.0) / p.leg_height
    up = np.maximum(v[:, 1] - st, 0.0) / p.back_height
    bent = v.copy()
    turned = 0.2 * np.sin(25 * down) * np.sin(np.pi * down) * (s.leg == "turned")
    half = np.array([p.seat_width, p.seat_depth]) / 2
    leg = np.array([p.leg_width, p.leg_depth])
    flat = v[:, [0, 2]]
    axis = np.sign(flat) * (half - leg / 2)
    of_leg = (np.abs(flat) >= half - leg - 1e-9).all(axis=1) & (down > 0)
    shift = np.clip(flat / (half - leg), -1.0, 1.0) * s.splay * down[:, None]
    bent[:, [0, 2]] += shift + (flat - axis) * (turned * of_leg)[:, None]
    rear = np.clip((half[1] - v[:, 2]) / (p.seat_depth - p.back_thickness), 0.0, 1.0)
    bent[:, 2] -= s.recline * up * rear
    return bent
