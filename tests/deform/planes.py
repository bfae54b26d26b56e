"""An airplane for the tests of this folder."""

from __future__ import annotations

import numpy as np
from boxes import ORIGIN
from numpy.typing import NDArray

from service.deform.followers import following
from service.template.affine import AffineTemplate
from service.template.loader import load_template

VALUES = {
    "fuselage_height": 0.10,
    "fuselage_length": 0.9,
    "fuselage_width": 0.09,
    "wing_length": 0.4,
    "vertical_stabilizer_length": 0.13,
    "horizontal_stabilizer_length": 0.15,
    "wing_root_chord": 0.18,
    "wing_tip_chord": 0.06,
    "wing_sweep": 0.12,
    "wing_position": 0.05,
    "wing_height": -0.02,
    "wing_dihedral": 0.03,
    "vertical_stabilizer_chord": 0.14,
    "vertical_stabilizer_position": 0.02,
    "horizontal_stabilizer_chord": 0.1,
    "horizontal_stabilizer_tip_chord": 0.06,
    "horizontal_stabilizer_sweep": 0.035,
    "horizontal_stabilizer_height": 0.12,
    "horizontal_stabilizer_position": 0.0,
}


def airplane() -> AffineTemplate:
    return load_template("airplane")


def plane_values() -> NDArray[np.float64]:
    """A T-tail of the size that the normalised frame has them."""
    return airplane().vector(VALUES)


def plane() -> AffineTemplate:
    """The airplane as edits move it."""
    return following(airplane(), plane_values())


def plane_change(name: str, factor: float) -> NDArray[np.float64]:
    """The change that scales one parameter."""
    df = np.zeros(len(airplane().names))
    df[airplane().names.index(name)] = (factor - 1.0) * VALUES[name]
    return df


def plane_mesh() -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """The airplane itself as an upload."""
    return airplane().decode(plane_values()) + ORIGIN, airplane().faces


def of_part(name: str) -> NDArray[np.bool_]:
    """``[V]`` the mesh's vertices of a part."""
    return np.asarray(airplane().part == airplane().parts.index(name))


def on_wing(name: str, span: float, across: float, chord: float) -> NDArray[np.float64]:
    """A point of the upload's wing, worked out by hand.

    Args:
        name: which of the two.
        span: from the fuselage's side, 0, to the tip, 1.
        across, chord: of the thickness and the chord, from -1/2 to 1/2.
    """
    v = VALUES
    start, tip = v["fuselage_width"] / 4, v["fuselage_width"] / 2 + v["wing_length"]
    x = v["fuselage_width"] / 2 + span * v["wing_length"]
    s = (x - start) / (tip - start)
    size = v["wing_root_chord"] + s * (v["wing_tip_chord"] - v["wing_root_chord"])
    thick = 0.12 * v["wing_root_chord"] * (1 - s) + 0.10 * v["wing_tip_chord"] * s
    y = v["wing_height"] + s * v["wing_dihedral"] + across * thick
    z = v["wing_position"] - s * v["wing_sweep"] + chord * size
    return np.array([x if name == "left_wing" else -x, y, z])
