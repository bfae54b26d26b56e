"""What is fitted to a detailed airplane: engines, propellers, gear, windows, pods and struts.

None of it changes its size in an edit: each piece goes with the place that it is fitted to.
"""

from __future__ import annotations

from collections.abc import Iterator
from types import SimpleNamespace

import numpy as np

from model_export.detailed import skin
from model_export.detailed.lofts import lofted, mirrored, turned
from model_export.detailed.surfaces import wing_sections
from model_export.primitives import Array, Mesh, slab, tube


def fittings(p: SimpleNamespace, s: SimpleNamespace) -> Iterator[Mesh]:
    """All of an airplane's."""
    left: list[Mesh] = [*_engines(p, s), *_pods(p, s), *_windows(p, s)]
    if s.gear:
        foot = feet(p, s)
        left += _wheel(s, foot["main"], s.legs["main"], 1.0)
        yield from _wheel(s, foot["nose"], s.legs["nose"], 0.7)
    if s.struts and s.level > 0.2:
        left += [_strut(p, s)]
    for piece in left:
        yield piece
        yield mirrored(piece)
    if s.engines == "nose":
        tip = np.array([0.0, skin.axis(p, s, 0.499), 0.499 * p.fuselage_length])
        yield from _propeller(s, tip, 0.9 * s.engine)


def _on_wing(p: SimpleNamespace, s: SimpleNamespace, share: float) -> tuple[Array, float, float]:
    """Middle, chord and thickness of the wing at a share of its length."""
    x, middle, chord, thick = wing_sections(p, s, np.array([share]))
    return np.array([x[0], *middle[0]]), float(chord[0]), float(thick[0])


def _engines(p: SimpleNamespace, s: SimpleNamespace) -> Iterator[Mesh]:
    if s.engines == "tail":
        at = -0.26
        out = skin.side(p, s, at, 0.3) + 1.45 * s.engine
        height = skin.axis(p, s, at) + 0.15 * p.fuselage_height
        center = np.array([out, height, at * p.fuselage_length])
        yield from _nacelle(s, center, 3.0 * s.engine)
        size = (1.6 * s.engine, 0.3 * s.engine, 1.8 * s.engine)
        yield slab(center - [1.1 * s.engine, 0, 0], size, 0.1 * s.engine, s.density)
    if s.engines in ("wing", "props"):
        for share in (0.27, 0.55)[: s.engine_count]:
            middle, chord, thick = _on_wing(p, s, share)
            lead = middle + np.array([0.0, 0.0, chord / 2])
            if s.engines == "props":
                yield from _turboprop(s, lead, chord, 0.6 * s.engine)
                continue
            low = np.array([0.0, -1.25 * s.engine - thick / 2, 0.5 * s.engine])
            yield from _nacelle(s, lead + low, 3.2 * s.engine)
            size = (0.25 * s.engine, 1.4 * s.engine, 2.2 * s.engine)
            yield slab(lead + low + [0, 0.75 * s.engine, -0.6 * s.engine], size, 0.05 * s.engine,
                       s.density)  # fmt: skip


def _nacelle(s: SimpleNamespace, center: Array, length: float) -> Iterator[Mesh]:
    """A hollow intake with a lip, and the spinner in it."""
    r, h = s.engine, length / 2
    z = np.array([-1.0, -0.97, -0.6, -0.2, 0.2, 0.55, 0.8, 0.93, 1.0, 0.97, 0.8, 0.5, 0.48]) * h
    size = r * np.array([0.5, 0.56, 0.8, 0.94, 1.0, 1.0, 0.97, 0.92, 0.86, 0.8, 0.77, 0.76, 0.1])
    yield turned(z, size, center, 8 * s.density)
    z = np.array([0.45, 0.52, 0.6, 0.68, 0.7]) * h
    yield turned(z, r * np.array([0.3, 0.28, 0.2, 0.08, 0.01]), center, 4 * s.density)


def _turboprop(s: SimpleNamespace, lead: Array, chord: float, r: float) -> Iterator[Mesh]:
    t = np.linspace(0.0, 1.0, 5 * s.density + 1)
    z = -0.9 * chord + (0.9 * chord + 3.5 * r) * t
    size = r * np.clip(np.sin(np.pi * np.minimum(0.06 + 0.8 * t, 0.86)), 0.05, 1.0) ** 0.6
    yield turned(z, size, lead, 7 * s.density)
    yield from _propeller(s, lead + np.array([0.0, 0.0, 3.5 * r]), 0.7 * r)


def _propeller(s: SimpleNamespace, tip: Array, r: float) -> Iterator[Mesh]:
    """A spinner ahead of `tip`, and blades."""
    t = np.linspace(0.0, 1.0, 3 * s.density + 1)
    size = r * np.sqrt(np.maximum(1.0 - t**2, 1e-4))
    yield turned(1.6 * r * t - 0.1 * r, size, tip, 5 * s.density)
    reach = np.linspace(0.5, 4.2, 4 * s.density + 1)[:, None]
    square = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    wide = r * 0.34 * np.sin(np.pi * np.clip(reach / 4.4, 0.15, 0.97)) ** 0.6
    for blade in range(s.blades):
        angle = 2 * np.pi * blade / s.blades + 0.3
        out, round_ = np.array([np.cos(angle), np.sin(angle), 0]), np.array(
            [-np.sin(angle), np.cos(angle), 0])  # fmt: skip
        pitch = np.radians(35)
        chord, normal = np.cos(pitch) * round_ + [0, 0, np.sin(pitch)], (
            -np.sin(pitch) * round_ + [0, 0, np.cos(pitch)])  # fmt: skip
        rings = (tip + [0.0, 0.0, 0.4 * r] + r * reach * out)[:, None] + (
            wide[:, None] * (square[:, :1] * chord + 0.2 * square[:, 1:] * normal))  # fmt: skip
        yield lofted(rings)


def _bottom(p: SimpleNamespace, s: SimpleNamespace, at: float) -> float:
    return 2 * skin.axis(p, s, at) - skin.top(p, s, at)


def feet(p: SimpleNamespace, s: SimpleNamespace) -> dict[str, Array]:
    """Where the legs of the gear are fixed: the nose's, and the main one's on the left."""
    middle, chord, thick = _on_wing(p, s, 0.14)
    main = middle - [0.0, thick / 4, 0.15 * chord]
    if s.level > 0.2:
        # A high wing's are on the fuselage.
        at = s.station - 0.03
        main = np.array([skin.side(p, s, at, -0.8), 0.0, at * p.fuselage_length])
        main[1] = -0.4 * p.fuselage_height
    bottom = _bottom(p, s, 0.28)
    return {"main": main, "nose": np.array([0.0, bottom, 0.28 * p.fuselage_length])}


def _wheel(s: SimpleNamespace, foot: Array, leg: float, size: float) -> Iterator[Mesh]:
    """A leg down from `foot`, and a wheel on it."""
    r = 0.3 * s.gear * size
    path = np.array([[0.0, 0.1 * leg, 0.0], [0.0, -leg + r, 0.0]])
    path = path[0] + (path[1] - path[0]) * np.linspace(0, 1, 3 * s.density + 1)[:, None]
    yield tube(foot + path, np.full((len(path), 2), 0.22 * r), 4 * s.density, False)
    angle = np.linspace(0.0, np.pi, 3 * s.density + 1)
    x = 0.4 * r * np.cos(angle)
    radius = r * (0.55 + 0.45 * np.sqrt(np.sin(angle).clip(0.0)))
    tyre, faces = turned(x, radius, np.zeros(3), 6 * s.density)
    yield tyre[:, [2, 1, 0]] * [1.0, 1.0, -1.0] + foot + [0.0, -leg + r, 0.0], faces


def _pods(p: SimpleNamespace, s: SimpleNamespace) -> Iterator[Mesh]:
    """Fairings of the flaps' tracks, below the trailing edge."""
    for share in (0.42, 0.62, 0.78)[: s.pods]:
        middle, chord, thick = _on_wing(p, s, share)
        t = np.linspace(-1.0, 1.0, 4 * s.density + 1)
        radius = 0.4 * thick * np.sqrt(np.maximum(1.0 - t**2, 1e-3))
        center = middle - np.array([0.0, 0.35 * thick, 0.35 * chord])
        yield turned(0.25 * chord * t, radius, center, 4 * s.density)


def _windows(p: SimpleNamespace, s: SimpleNamespace) -> Iterator[Mesh]:
    """Panes on the side, and one of the cockpit's."""
    if not s.windows:
        return
    level, size = 0.3, s.windows
    for at in np.linspace(-0.18, 0.5 - s.nose - 0.04, 9):
        x = skin.side(p, s, float(at), level)
        y = skin.axis(p, s, float(at)) + level * p.fuselage_height / 2
        yield _pane(s, np.array([x, y, at * p.fuselage_length]), size, 0.7 * size)
    at = 0.5 - 0.55 * s.nose
    x, y = skin.side(p, s, at, 0.45), skin.axis(p, s, at)
    y += 0.45 * (skin.top(p, s, at) - y)
    yield _pane(s, np.array([x, y, at * p.fuselage_length]), size, 1.6 * size)


def _pane(s: SimpleNamespace, center: Array, tall: float, wide: float) -> Mesh:
    path = center + np.array([[-0.15, 0, 0], [0.1, 0, 0], [0.15, 0, 0]]) * tall
    half = np.array([[1.0], [1.0], [0.85]]) * [tall / 2, wide / 2]
    return tube(path, half, 4 * s.density, True)


def _strut(p: SimpleNamespace, s: SimpleNamespace) -> Mesh:
    """From low on the fuselage's side to the underside of a high wing; it stretches between."""
    middle, _, thick = _on_wing(p, s, 0.45)
    low = np.array([0.9 * skin.side(p, s, s.station, -0.7), -0.3 * p.fuselage_height, 0.0])
    low[2] = s.station * p.fuselage_length
    t = np.linspace(0.0, 1.0, 5 * s.density + 1)[:, None]
    path = low + (middle - [0.0, thick / 4, 0.0] - low) * t
    half = np.full((len(path), 2), 1.0) * [0.2 * thick, 0.5 * thick]
    return tube(path, half, 5 * s.density, False)
