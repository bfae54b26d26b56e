"""A detailed airplane's fuselage."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from model_export.detailed.lofts import lofted
from model_export.primitives import Array, Mesh

CANOPY = (0.31, 0.09)
"""Where the canopy is highest, and how far it reaches ahead and behind."""
POINTS = {"blunt": (2.4, 2.0), "ogive": (2.0, 1.0), "cone": (1.3, 1.2)}


def girth(s: SimpleNamespace, t: Array) -> Array:
    """``[n]`` size of the sections at ``t [n]``, from -1/2 at the tail's end to 1/2, over the
    greatest."""
    ahead = np.clip(1.0 - (0.5 - t) / s.nose, 0.0, 1.0)
    behind = np.clip(1.0 - (t + 0.5) / s.tail, 0.0, 1.0)
    power, root = POINTS[s.point]
    size: Array = np.maximum(1.0 - ahead**power, 0.0) ** (1.0 / root)
    return size * (1.0 - (1.0 - s.tail_end) * behind**s.tail_power)


def axis(p: SimpleNamespace, s: SimpleNamespace, t: float) -> float:
    """Height of the sections' middle at `t`."""
    return float(_axis(p, s, np.array([t]))[0])


def _axis(p: SimpleNamespace, s: SimpleNamespace, t: Array) -> Array:
    rise = np.where(t < 0.0, s.upsweep, -s.droop) * (1.0 - girth(s, t)) / 2
    return p.fuselage_height * rise


def top(p: SimpleNamespace, s: SimpleNamespace, t: float) -> float:
    """Height of the fuselage's top at `t`, without the canopy."""
    return axis(p, s, t) + p.fuselage_height / 2 * float(girth(s, np.array([t]))[0])


def side(p: SimpleNamespace, s: SimpleNamespace, t: float, level: float) -> float:
    """Half the fuselage's width at `t`, `level` half heights above the sections' middle."""
    round_off = max(1.0 - abs(level) ** s.power, 0.0) ** (1.0 / s.power)
    return p.fuselage_width / 2 * float(girth(s, np.array([t]))[0]) * round_off


def rings(p: SimpleNamespace, s: SimpleNamespace, t: Array, sides: int) -> Array:
    """``[n, sides, 3]`` sections at ``t [n]``; the first vertex is on the left, the next above."""
    angle = 2 * np.pi * np.arange(sides) / sides
    ray = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    outline = np.sign(ray) * np.abs(np.where(abs(ray) < 1e-12, 0, ray)) ** (2.0 / s.power)
    size = girth(s, t)[:, None]
    hump = np.clip(1.0 - ((t - CANOPY[0]) / CANOPY[1]) ** 2, 0.0, 1.0)[:, None] ** 1.5
    bump = s.canopy * hump * np.maximum(ray[:, 1], 0.0) ** 2.5
    y = p.fuselage_height * (outline[:, 1] * size / 2 + bump) + _axis(p, s, t)[:, None]
    x = p.fuselage_width * outline[:, 0] * size / 2
    z = np.repeat(t[:, None] * p.fuselage_length, sides, axis=1)
    return np.stack([x, y, z], axis=2)


def fuselage(p: SimpleNamespace, s: SimpleNamespace) -> Mesh:
    """The fuselage by itself."""
    d = s.density
    ends = 0.5 * np.pi * np.arange(1, 6 * d + 1) / (6 * d)
    nose = 0.5 - s.nose + s.nose * np.sin(ends)
    nose[-1] = 0.5 - 1e-3
    body = np.linspace(-0.5, 0.5 - s.nose, 12 * d + 1)
    return lofted(rings(p, s, np.concatenate([body, nose]), 8 * d))
