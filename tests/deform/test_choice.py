from __future__ import annotations

import numpy as np
import pytest
from ballots import votes_of
from boxes import ORIGIN, block, joined
from numpy.typing import NDArray
from planes import VALUES, of_part, on_wing, plane, plane_mesh, plane_values

from service.deform.groups import mirror_groups
from service.template.loader import load_template


def placed(at: np.ndarray, size: tuple[float, float, float]) -> tuple[np.ndarray, np.ndarray]:
    """A block of a size about a point of the airplane."""
    half = np.array(size) / 2
    return block(tuple(at - half), tuple(at + half), 2)


def chosen(mesh: tuple[np.ndarray, np.ndarray]) -> list[float]:
    """The shares of the groups: fuselage, wings, vertical and horizontal stabilizers."""
    _, result = votes_of(plane(), plane_values(), mesh)
    assert len(result.shares) == 1
    return result.shares[0].tolist()


def test_every_part_of_an_airplane_goes_with_its_group():
    vertices, faces = plane_mesh()
    welded, result = votes_of(plane(), plane_values(), (vertices, faces))
    group = {"fuselage": 0, "left_wing": 1, "vertical_stabilizer": 2}
    for part, expected in group.items():
        pieces = np.unique(welded.piece[welded.of[of_part(part)]])
        assert result.shares[pieces].tolist() == [np.eye(4)[expected].tolist()]


def test_an_engine_goes_with_the_wing_and_a_wheel_with_what_is_nearest():
    engine = placed(
        on_wing("left_wing", 0.4, 0, 0.5) - np.array([0, 0.04, -0.02]), (0.05, 0.05, 0.1)
    )
    assert chosen(engine) == [0, 1, 0, 0]
    side = np.array([VALUES["fuselage_width"] / 2 + 0.01, -0.09, 0.02])
    assert chosen(placed(side, (0.02, 0.04, 0.04))) == [1, 0, 0, 0]


def test_a_strut_from_the_fuselage_to_the_wing_is_left_to_its_vertices():
    high = on_wing("left_wing", 0.65, 0, 0)
    low = np.array([0.0, VALUES["fuselage_height"] / 2, high[2]])
    vertices, faces = block((-0.5, -0.5, -0.5), (0.5, 0.5, 0.5), 6)
    unit = vertices - ORIGIN
    strut = low + (unit[:, :1] + 0.5) * (high - low) + 0.008 * unit * np.array([0, 1, 1])
    assert np.isnan(chosen((strut + ORIGIN, faces))).all()


@pytest.mark.parametrize("at", [0.3, 0.7])
def test_a_fins_rudder_is_no_part_of_the_stabilizers_beside_it(at):
    v = VALUES
    y = v["fuselage_height"] / 2 + at * v["vertical_stabilizer_length"]
    z = v["vertical_stabilizer_position"] - v["fuselage_length"] / 2
    rudder = placed(np.array([0.0, y, z]), (0.004, 0.06, 0.03))
    assert chosen(rudder) == [0, 0, 1, 0]


def test_several_at_once_are_told_apart():
    flap = placed(on_wing("left_wing", 0.5, 0, -0.4), (0.1, 0.006, 0.02))
    door = placed(np.array([0.0, VALUES["fuselage_height"] / 2, 0.1]), (0.02, 0.004, 0.03))
    _, result = votes_of(plane(), plane_values(), joined(flap, door))
    assert sorted(result.shares[:, :2].tolist()) == [[0, 1], [1, 0]]


def test_the_rings_of_an_engine_beside_the_wings_root_go_together():
    # By itself the front ring is nearest to the wing, as the rear one is to the fuselage.
    rear = np.array([VALUES["fuselage_width"] / 2 + 0.05, 0.02, -0.11])
    ring = placed(rear, (0.03, 0.03, 0.08))
    front = placed(rear + np.array([0.0, 0.0, 0.06]), (0.034, 0.034, 0.04))
    assert chosen(ring) == [1, 0, 0, 0]
    assert chosen(front) == [0, 1, 0, 0]
    _, result = votes_of(plane(), plane_values(), joined(ring, front))
    assert result.shares.tolist() == [[1, 0, 0, 0], [1, 0, 0, 0]]


def armchair_votes(*meshes: tuple[np.ndarray, np.ndarray]) -> tuple[list[str], NDArray[np.float32]]:
    """Names of the groups of an armchair whose arms are boxes down to below the seat, and the
    shares of pieces in the order of their heights."""
    template = next(t for t in load_template("chair").variants if t.variant == "armchair")
    f = template.vector(
        {"back_height": 0.5, "back_thickness": 0.04, "seat_thickness": 0.05, "seat_depth": 0.45,
         "seat_width": 0.42, "leg_height": 0.4, "leg_depth": 0.04, "leg_width": 0.05,
         "arm_height": 0.2, "arm_thickness": 0.3, "arm_width": 0.05, "arm_gap": -0.025,
         "arm_length": 0.4, "leg_inset": 0.0}
    )  # fmt: skip
    welded, result = votes_of(template, f, joined(*meshes))
    low, high = welded.boxes()
    names = [template.parts[g.members[0]] for g in mirror_groups(template)]
    return names, result.shares[np.argsort((low + high)[:, 1])]


def test_what_is_in_a_tall_arm_and_reaches_from_leg_to_leg_goes_with_the_legs():
    legs = [
        block((x - 0.025, -0.425, z - 0.02), (x + 0.025, -0.025, z + 0.02))
        for x in (-0.185, 0.185)
        for z in (-0.2, 0.2)
    ]
    rail = block((-0.2, -0.07, -0.2), (-0.18, -0.03, 0.2))
    seat = block((-0.21, -0.024, -0.225), (0.21, 0.025, 0.225))
    rest = block((-0.21, 0.2, -0.2), (-0.17, 0.225, 0.19))
    names, shares = armchair_votes(*legs, rail, seat, rest)
    found = [names[int(row.argmax())] for row in shares]
    assert np.isfinite(shares).all()
    assert found == ["front_right_leg"] * 5 + ["seat", "right_arm"]


def test_a_board_at_the_underside_of_a_thick_seat_is_the_seat():
    board = block((-0.21, -0.05, -0.225), (0.21, -0.03, 0.225))
    names, shares = armchair_votes(board)
    assert shares[0].tolist() == np.eye(len(names))[names.index("seat")].tolist()
