from __future__ import annotations

import numpy as np
import pytest
from boxes import PARAMETERS, chair
from planes import VALUES, airplane, of_part, plane, plane_change, plane_values

from service.deform.followers import following
from service.deform.roots import rooted

WIDTH, HEIGHT = VALUES["fuselage_width"], VALUES["fuselage_height"]


def root(name: str, f: np.ndarray) -> np.ndarray:
    """The middle of a part's root, as it is bound."""
    return root_after(name, f, np.zeros_like(f))


def root_after(name: str, f: np.ndarray, df: np.ndarray) -> np.ndarray:
    """The same after a change."""
    cut, _ = rooted(following(airplane(), f), f)
    u = np.zeros((6, 3))
    u[np.arange(6), cut.run] = -0.5
    return cut.maps(f + df).place(u[None])[0, airplane().parts.index(name)]


def test_wing_and_fin_begin_at_the_fuselages_side():
    f = plane_values()
    np.testing.assert_allclose(root("left_wing", f)[0], WIDTH / 2)
    np.testing.assert_allclose(root("right_wing", f)[0], -WIDTH / 2)
    fin = root("vertical_stabilizer", f)
    assert fin[1] < HEIGHT / 2, "it stands on the tail, which is slimmer"
    assert fin[1] == pytest.approx(top(fin[2]), abs=2e-3)


def top(z: float) -> float:
    """Height of the fuselage's top at `z`."""
    vertices = plane().decode(plane_values())[of_part("fuselage")]
    highest = {}
    for at in np.unique(vertices[:, 2].round(9)):
        highest[at] = vertices[np.isclose(vertices[:, 2], at), 1].max()
    return float(np.interp(z, list(highest), list(highest.values())))


@pytest.mark.parametrize(("height", "inside"), [(0.12, False), (-0.01, True)])
def test_a_tailplane_begins_at_the_skin_of_the_tail_unless_it_is_above_it(
    height: float, inside: bool
) -> None:
    f = plane_values()
    f[airplane().names.index("horizontal_stabilizer_height")] = height
    start = root("left_horizontal_stabilizer", f)[0]
    # Its length counts from the middle, wherever it comes out.
    assert (0.1 * WIDTH < start < 0.4 * WIDTH) if inside else start == 0.0
    wider = root_after("left_horizontal_stabilizer", f, plane_change("fuselage_width", 1.5))
    assert wider[0] == pytest.approx(1.5 * start)


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
    before, after = (
        root("left_wing", f),
        root_after("left_wing", f, plane_change("wing_length", 1.5)),
    )
    np.testing.assert_allclose(after, before)
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
