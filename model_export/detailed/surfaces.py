"""A detailed airplane's wings, fin and tailplane: their sections, and the pieces through them."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from model_export.detailed import skin
from model_export.detailed.lofts import aerofoil, mirrored, wing
from model_export.primitives import Array, Mesh


def wings(p: SimpleNamespace, s: SimpleNamespace) -> list[Mesh]:
    d = s.density
    outer = _stations(8 * d, s.kink)
    outline = aerofoil(5 * d)
    x, middle, chord, thick = wing_sections(p, s, outer)
    up = np.tile([0.0, 1.0, 0.0], (len(outer), 1))
    middle = np.column_stack([x, middle])
    if s.winglet:
        middle, up, chord, thick = _with_winglet(s, middle, up, chord, thick)
    else:
        middle, up, chord, thick = _rounded(middle, up, chord, thick)
    if not s.through:
        root = middle[:1] - [s.inset, 0.0, 0.0]
        sections = [np.concatenate([a[:1], a]) for a in (middle, up, chord, thick)]
        sections[0][:1] = root
        half = wing(*sections, outline)
        return [half, mirrored(half)]
    inner = np.linspace(-1.0, 1.0, 4 * d + 1)[1:-1, None]
    between = np.concatenate([inner * p.fuselage_width / 2, 0 * inner + middle[0, 1],
                              0 * inner + middle[0, 2]], axis=1)  # fmt: skip
    flip = np.array([-1.0, 1.0, 1.0])
    left = [(middle * flip)[::-1], (up * flip)[::-1], chord[::-1], thick[::-1]]
    rest = [between, np.tile([0.0, 1.0, 0.0], (len(inner), 1)), np.full(len(inner), chord[0]),
            np.full(len(inner), thick[0])]  # fmt: skip
    whole = [np.concatenate(three) for three in zip(left, rest, (middle, up, chord, thick),
             strict=True)]  # fmt: skip
    return [wing(*whole, outline)]


def _stations(count: int, kink: float) -> Array:
    """``[count + 1]`` places from the root at 0 to the tip at 1, closer at both; one is at the
    kink."""
    s = 0.5 - 0.5 * np.cos(np.pi * np.arange(count + 1) / count)
    if kink:
        s[np.abs(s - kink).argmin()] = kink
    return s


def wing_sections(
    p: SimpleNamespace, s: SimpleNamespace, out: Array
) -> tuple[Array, Array, Array, Array]:
    """Sections of the wing ``out [n]`` from the fuselage's side to the tip: x, ``[n, 2]`` y and z
    of their middles, chord and thickness."""
    x = p.fuselage_width / 2 + (p.wing_length - s.beyond) * out
    at = [0.0, s.kink or 0.5, 1.0]
    bend = 0.62 if s.kink else 1.0 - at[1] * (1.0 - s.tip_chord / s.chord)
    chord = np.interp(out, at, [s.chord, bend * s.chord, s.tip_chord])
    # The leading edge is straight; the kink is the trailing edge's.
    lead = s.chord / 2 - (s.sweep + (s.chord - s.tip_chord) / 2) * out
    y = s.level * p.fuselage_height + s.dihedral * out
    z = s.station * p.fuselage_length + lead - chord / 2
    thick = chord * s.thick * (1.0 - 0.2 * out)
    return x, np.stack([y, z], axis=1), chord, thick


def _rounded(middle: Array, up: Array, chord: Array, thick: Array) -> tuple[Array, ...]:
    """With a rounded tip."""
    shrink = np.array([1.0, 0.93, 0.75, 0.4])
    tip = [np.repeat(a[-1:], 3, axis=0) for a in (middle, up, chord, thick)]
    tip[0][:, 0] += thick[-1] * np.array([0.25, 0.4, 0.48])
    tip[2], tip[3] = tip[2] * (0.6 + 0.4 * shrink[1:]), tip[3] * shrink[1:]
    middle, up, chord, thick = (
        np.concatenate([a, b]) for a, b in zip((middle, up, chord, thick), tip, strict=True)
    )
    return middle, up, chord, thick


def _with_winglet(
    s: SimpleNamespace, middle: Array, up: Array, chord: Array, thick: Array
) -> tuple[Array, ...]:
    """Rings that go on from the tip and turn upright."""
    t = np.linspace(0.0, 1.0, 3 * s.density + 2)[1:]
    turn = np.minimum(t / 0.4, 1.0) * np.radians(80)
    radius = 0.25 * s.winglet
    x = radius * np.sin(turn)
    y = radius * (1 - np.cos(turn)) + s.winglet * np.maximum(t - 0.4, 0.0) / 0.6
    own = chord[-1] * (1.0 - 0.55 * t)
    z = -0.35 * s.winglet * t - 0.3 * (chord[-1] - own)
    rings = middle[-1] + np.stack([x, y, z], axis=1)
    across = np.stack([-np.sin(turn), np.cos(turn), 0.0 * turn], axis=1)
    middle, up = np.concatenate([middle, rings]), np.concatenate([up, across])
    return (
        middle,
        up,
        np.concatenate([chord, own]),
        np.concatenate([thick, thick[-1] * own / own[0]]),
    )


def fin_sections(p: SimpleNamespace, s: SimpleNamespace, out: Array) -> tuple[Array, Array, Array]:
    """Sections of the fin ``out [n]`` from the fuselage's top to the tip: y, z of their middles and
    chord."""
    foot = skin.top(p, s, s.fin_station)
    y = foot + (p.fuselage_height / 2 + p.vertical_stabilizer_length - foot) * out
    chord = np.interp(out, [0.0, 1.0], [s.fin_chord, s.fin_tip])
    back = s.fin_sweep * (p.vertical_stabilizer_length * out)
    z = -p.fuselage_length / 2 + 0.02 * s.fin_chord + s.fin_chord / 2 - back
    if s.dorsal:
        more = s.dorsal * s.fin_chord * np.maximum(1.0 - out / 0.22, 0.0) ** 1.5
        chord, z = chord + more, z + more / 2
    return y, z, chord


def fin(p: SimpleNamespace, s: SimpleNamespace) -> Mesh:
    out = _stations(6 * s.density, 0.0)
    y, z, chord = fin_sections(p, s, out)
    y, z, chord = (np.concatenate([a[:1], a]) for a in (y, z, chord))
    y[0] -= 0.12 * s.inset / 0.3
    thick = 0.1 * chord.clip(max=s.fin_chord)
    middle = np.stack([0.0 * y, y, z], axis=1)
    up = np.tile([1.0, 0.0, 0.0], (len(y), 1))
    thick[-1] *= 0.5
    return wing(middle, up, chord, thick, aerofoil(4 * s.density, 0.0))


def side_fins(p: SimpleNamespace, s: SimpleNamespace) -> list[Mesh]:
    """Two more, on the tailplane's tips; they are two thirds as large."""
    vertices, faces = fin(p, s)
    x, z, _ = tail_sections(p, s, np.array([0.9]))
    low = vertices.min(axis=0)
    small = (vertices - [0.0, low[1], low[2]]) * 0.67
    small += [x[0], tail_level(p, s)[0] - 0.1 * s.fin_chord, z[0] - s.tail_tip / 2]
    return [(small, faces), mirrored((small, faces))]


def tail_level(p: SimpleNamespace, s: SimpleNamespace) -> tuple[float, float]:
    """Height of the tailplane, and half the width of what it leaves there."""
    if s.on_fin:
        foot = fin_sections(p, s, np.array([s.on_fin]))[0][0]
        return float(foot), 0.03 * s.fin_chord
    girth = float(skin.girth(s, np.array([s.fin_station]))[0])
    return skin.axis(p, s, s.fin_station), 0.45 * p.fuselage_width * girth


def tail_sections(p: SimpleNamespace, s: SimpleNamespace, out: Array) -> tuple[Array, Array, Array]:
    """Sections of the tailplane ``out [n]`` from its root to the tip: x, z of their middles and
    chord."""
    _, root = tail_level(p, s)
    x = root + (p.horizontal_stabilizer_length - root) * out
    chord = np.interp(out, [0.0, 1.0], [s.tail_chord, s.tail_tip])
    start = -p.fuselage_length / 2 + s.tail_chord / 2 + 0.01 * s.fin_chord
    if s.on_fin:
        start = fin_sections(p, s, np.array([s.on_fin]))[1][0] - 0.1 * s.fin_chord
    return x, start - s.tail_sweep * out, chord


def tailplane(p: SimpleNamespace, s: SimpleNamespace) -> list[Mesh]:
    out = _stations(5 * s.density, 0.0)
    x, z, chord = tail_sections(p, s, out)
    y, root = tail_level(p, s)
    # It goes on into what it stands on, to just short of the middle.
    x, z, chord = (np.concatenate([a[:1], a]) for a in (x, z, chord))
    x[0] = 0.1 * root
    middle = np.stack([x, 0.0 * x + y, z], axis=1)
    thick = 0.1 * chord
    thick[-1] *= 0.5
    up = np.tile([0.0, 1.0, 0.0], (len(x), 1))
    half = wing(middle, up, chord, thick, aerofoil(4 * s.density, 0.0))
    return [half, mirrored(half)]
