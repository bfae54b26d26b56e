from __future__ import annotations

import numpy as np
from boxes import PARAMETERS, chair
from planes import VALUES, airplane, plane, plane_change, plane_values

from service.deform.roots import rooted

WIDTH, HEIGHT = VALUES["fuselage_width"], VALUES["fuselage_height"]


def root(name: str, f: np.ndarray) -> np.ndarray:
    """The middle of a part's root."""
    cut, _ = rooted(plane(), plane_values())
    u = np.zeros((6, 3))
    u[np.arange(6), cut.run] = -0.5
    return cut.maps(f).place(u[None])[0, airplane().parts.index(name)]


def test_wing_and_fin_begin_at_the_fuselages_side():
    f = plane_values()
    np.testing.assert_allclose(root("left_wing", f)[0], WIDTH / 2)
    np.testing.assert_allclose(root("right_wing", f)[0], -WIDTH / 2)
    np.testing.assert_allclose(root("vertical_stabilizer", f)[1], HEIGHT / 2)
    # The horizontal stabilizer's length counts from the middle.
    assert root("left_horizontal_stabilizer", f)[0] == 0.0


def test_at_the_fit_a_part_is_where_it_was():
    f = plane_values()
    cut, starts = rooted(plane(), f)
    rng = np.random.default_rng(0)
    u = rng.uniform(-0.5, 0.5, (20, 6, 3))
    own = u.copy()
    along = own[:, np.arange(6), cut.run]
    own[:, np.arange(6), cut.run] = starts + (along + 0.5) * (0.5 - starts)
    np.testing.assert_allclose(cut.maps(f).place(u), plane().maps(f).place(own), atol=1e-12)


def test_a_longer_wing_keeps_its_root_and_a_wider_fuselage_moves_all_of_it():
    f = plane_values()
    before = root("left_wing", f)
    np.testing.assert_allclose(root("left_wing", f + plane_change("wing_length", 1.5)), before)
    wider = plane_change("fuselage_width", 1.5)
    cut, _ = rooted(plane(), f)
    u = np.random.default_rng(1).uniform(-0.5, 0.5, (9, 6, 3))
    moved = (cut.maps(f + wider).place(u) - cut.maps(f).place(u))[:, 1]
    np.testing.assert_allclose(moved, np.tile([0.25 * WIDTH, 0, 0], (9, 1)), atol=1e-12)


def test_what_stands_on_the_hub_is_left_alone():
    cut, starts = rooted(chair(), PARAMETERS)
    np.testing.assert_array_equal(starts, -0.5)
    np.testing.assert_array_equal(cut.frame_jacobian, chair().frame_jacobian)
    np.testing.assert_array_equal(cut.frame_base, chair().frame_base)
