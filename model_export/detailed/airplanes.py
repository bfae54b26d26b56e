"""Detailed airplanes, and what a true edit of one does.

The truth is an airframe builder's:

- ``fuselage_length``: the skin stretches evenly from end to end.  What stands on it keeps its size
  and goes with its place: wings, windows, canopy panes and the nose gear with their station, the
  tail's surfaces with the tail's end, a propeller with the nose.
- ``fuselage_width``, ``fuselage_height``: the sections stretch about the axis.  Wings move out with
  the sides, and up or down with their place on them; so do engines on the tail, windows and gear.
- ``wing_length``: wings stretch along the span, from the fuselage's side to the tip; chord,
  thickness, sweep and dihedral, as distances, stay.  Engines, pods, wheels and struts slide out
  with their station, winglets with the tip; none of them changes.
- ``vertical_stabilizer_length``: the fin stretches above the fuselage and keeps its chords and its
  angle of sweep; a tailplane on it goes with its place.
- ``horizontal_stabilizer_length``: the tailplane stretches from its root, and keeps chords and
  sweep, as a distance.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from model_export.detailed import onepiece, skin
from model_export.detailed.fittings import feet, fittings
from model_export.detailed.shape import DetailedShape, named
from model_export.detailed.surfaces import (
    fin,
    fin_sections,
    side_fins,
    tail_level,
    tail_sections,
    tailplane,
    wing_sections,
    wings,
)
from model_export.primitives import Mesh, join

AIRPLANE_NAMES = (
    "fuselage_height", "fuselage_length", "fuselage_width",
    "wing_length", "vertical_stabilizer_length", "horizontal_stabilizer_length",
)  # fmt: skip


def detailed_airplane(seed: int, density: int | None = None, **style: Any) -> DetailedShape:
    """The airplane of a seed; every third is welded.

    Args:
        seed: of all that is drawn.
        density: how finely it is cut, from 1 (600 to 4 000 vertices) to 12 (60 000 to 150 000);
            drawn from 2 to 4 by default.
        style: what is not to be drawn, by its name in `_style`; lengths in metres.
    """
    rng = np.random.default_rng([2021, seed])
    length = np.exp(rng.uniform(np.log(7.0), np.log(45.0)))
    width = rng.uniform(0.085, 0.13)
    height = width * rng.uniform(0.95, 1.25)
    share = [height, 1.0, width, *rng.uniform([0.33, 0.09, 0.14], [0.52, 0.15, 0.20])]
    parameters = length * np.array(share)
    welded = seed % 3 == 2
    p = named(AIRPLANE_NAMES, parameters)
    s = _style(rng, p, welded)
    vars(s).update(style)
    s.density = density or s.density
    # Legs are of one length for all parameters, and their wheels stand on one floor for these.
    floor = -p.fuselage_height / 2 - s.gear
    s.legs = {name: float(foot[1] - floor) for name, foot in feet(p, s).items()}
    builder = onepiece.airplane if welded else _assembled

    def build(p: SimpleNamespace) -> Mesh:
        return builder(p, s)

    return DetailedShape(
        "airplane", AIRPLANE_NAMES, parameters, build(p)[1], welded, _nuisances(p, s), "", build
    )


def _style(rng: np.random.Generator, p: SimpleNamespace, welded: bool) -> SimpleNamespace:
    """What no parameter says: lengths in metres, and places as shares of what they lie on."""
    swept = bool(rng.random() < 0.5)
    chord = rng.uniform(0.15, 0.22) if swept else rng.uniform(0.11, 0.16)
    chord *= p.fuselage_length
    tail = str(rng.choice(["low", "low", "cross", "tee"]))
    if welded:
        tail = "low"
    span, fin = p.wing_length, p.vertical_stabilizer_length
    fin_chord = min(rng.uniform(1.1, 1.6) * fin, 0.2 * p.fuselage_length)
    tail_chord = rng.uniform(0.5, 0.75) * p.horizontal_stabilizer_length
    tip_chord = chord * (rng.uniform(0.22, 0.45) if swept else rng.uniform(0.5, 1.0))
    thick = rng.uniform(0.10, 0.15)
    winglet = 0.0 if welded else rng.choice([0.0, 1.0]) * span * rng.uniform(0.07, 0.13)
    # What a tip's rounding or a winglet adds is part of the wing's length.
    tip = 0.25 * winglet + 0.4 * tip_chord * thick if winglet else 0.39 * tip_chord * thick
    return SimpleNamespace(
        power=rng.uniform(2.0, 3.0),
        nose=rng.uniform(0.10, 0.22),
        point=str(rng.choice(["blunt", "ogive", "cone"])),
        droop=rng.uniform(0.0, 0.5),
        tail=rng.uniform(0.32, 0.48),
        tail_power=rng.uniform(1.4, 2.2),
        tail_end=rng.uniform(0.08, 0.25),
        upsweep=rng.uniform(0.3, 0.9),
        canopy=rng.choice([0.0, 1.0]) * rng.uniform(0.12, 0.25),
        windows=rng.choice([0.0, 1.0]) * rng.uniform(0.1, 0.16) * p.fuselage_height,
        swept=swept,
        chord=chord,
        wing_share=chord / p.fuselage_length,
        tip_chord=tip_chord,
        kink=rng.choice([0.0, 1.0]) * swept * rng.uniform(0.28, 0.4),
        sweep=span * (rng.uniform(0.35, 0.6) if swept else rng.uniform(-0.02, 0.08)),
        thick=thick,
        dihedral=span * rng.uniform(0.0, 0.11),
        station=rng.uniform(0.0, 0.09),
        level=rng.choice([-0.3, 0.0, 0.36]) + rng.uniform(-0.05, 0.05),
        through=bool(rng.random() < 0.5),
        winglet=winglet,
        beyond=0.0 if welded else tip,
        fin_chord=fin_chord,
        fin_share=fin_chord / p.fuselage_length,
        fin_station=-0.5 + 0.5 * fin_chord / p.fuselage_length,
        fin_tip=fin_chord * rng.uniform(0.35, 0.6),
        fin_sweep=rng.uniform(0.25, 0.6),
        dorsal=rng.choice([0.0, 1.0]) * rng.uniform(0.2, 0.5),
        on_fin={"low": 0.0, "cross": rng.uniform(0.3, 0.55), "tee": 1.0}[tail],
        tail_chord=tail_chord,
        tail_tip=tail_chord * rng.uniform(0.4, 0.75),
        tail_sweep=tail_chord * rng.uniform(0.1, 0.9),
        engines=str(rng.choice(["wing", "wing", "tail", "props", "nose", "none"])),
        engine_count=int(rng.integers(1, 3)),
        engine=rng.uniform(0.24, 0.34) * p.fuselage_width,
        blades=int(rng.integers(2, 6)),
        gear=rng.choice([0.0, 1.0]) * rng.uniform(0.35, 0.6) * p.fuselage_height,
        pods=int(rng.choice([0, 2, 3])),
        struts=bool(rng.random() < 0.4),
        tailplane=True,
        side_fins=False,
        density=int(rng.integers(2, 5)),
        inset=0.3 * p.fuselage_width,
    )


def _assembled(p: SimpleNamespace, s: SimpleNamespace) -> Mesh:
    pieces = [skin.fuselage(p, s), *wings(p, s), fin(p, s), *fittings(p, s)]
    if s.tailplane:
        pieces += tailplane(p, s)
    if s.side_fins:
        pieces += side_fins(p, s)
    return join(pieces)


def _nuisances(p: SimpleNamespace, s: SimpleNamespace) -> dict[str, float]:
    """The template's other parameters, read off the airplane where the template has them."""
    width, height, length = p.fuselage_width, p.fuselage_height, p.fuselage_length
    tail, nose = skin.girth(s, np.array([-0.28, 0.42])) - [0.739, 0.831]
    end = skin.girth(s, np.array([-0.5]))[0]
    _, (root, tip), chord, _ = wing_sections(p, s, np.array([0.0, 1.0]))
    _, fin_z, fin_chord = fin_sections(p, s, np.array([0.5]))
    fin_root = float(fin_chord[0]) / 0.75
    middle = fin_z[0] + 0.2 * p.vertical_stabilizer_length
    level, _ = tail_level(p, s)
    _, tail_z, tail_chord = tail_sections(p, s, np.array([0.0, 1.0]))
    return {
        "nose_size": nose * (width + height) / 2, "nose_rise": skin.axis(p, s, 0.45) / 1.2,
        "tail_width": tail * width, "tail_height": tail * height,
        "tail_rise": skin.axis(p, s, -0.5) - 0.3 * height, "tail_end": end * (width + height) / 2,
        "wing_root_chord": chord[0], "wing_tip_chord": chord[1],
        "wing_sweep": root[1] - tip[1], "wing_position": root[1], "wing_height": root[0],
        "wing_dihedral": tip[0] - root[0],
        "vertical_stabilizer_chord": fin_root,
        "vertical_stabilizer_position": middle - fin_root / 2 + length / 2,
        "horizontal_stabilizer_chord": tail_chord[0],
        "horizontal_stabilizer_tip_chord": tail_chord[1],
        "horizontal_stabilizer_sweep": tail_z[0] - tail_z[1],
        "horizontal_stabilizer_height": level - 0.3 * height,
        "horizontal_stabilizer_position": tail_z[0] - tail_chord[0] / 2 + length / 2,
    }  # fmt: skip
