from __future__ import annotations

import numpy as np
import pytest
from ballots import votes_of
from boxes import ORIGIN, block, joined
from planes import VALUES, of_part, on_wing, plane, plane_mesh, plane_values


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
