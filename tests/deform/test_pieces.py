from __future__ import annotations

import numpy as np
from ballots import votes_of
from boxes import PARAMETERS, block, chair, joined, template_mesh
from planes import on_wing, plane, plane_values

from service.deform.pieces import Votes
from service.deform.weld import Welded

W, D = PARAMETERS[[4, 3]]


def votes(*meshes: tuple[np.ndarray, np.ndarray]) -> tuple[Welded, Votes]:
    return votes_of(chair(), PARAMETERS, joined(*meshes))


def beside_wing(at: np.ndarray, size: tuple[float, float, float]) -> Votes:
    half = np.array(size) / 2
    return votes_of(plane(), plane_values(), block(tuple(at - half), tuple(at + half)))[1]


def test_each_box_of_the_template_goes_with_its_part():
    welded, result = votes(template_mesh())
    assert result.whole.all()
    part = chair().part
    for piece in range(welded.pieces):
        own = np.unique(part[np.isin(welded.of, np.flatnonzero(welded.piece == piece))])
        assert result.shares[piece].tolist() == np.eye(3)[min(own[0], 2)].tolist()
        np.testing.assert_array_equal(result.keep[piece, own[0]], 1.0)


def test_a_timber_from_floor_to_top_is_left_to_its_vertices():
    post = block((-W / 2, -0.42, -D / 2), (-W / 2 + 0.05, 0.5, -D / 2 + 0.04))
    _, result = votes(post)
    assert not result.whole.any()
    np.testing.assert_array_equal(result.keep, 1.0)


def test_a_rail_goes_with_the_legs_and_a_cushion_with_the_seat():
    rail = block((-W / 2 + 0.02, -0.3, D / 2 - 0.03), (W / 2 - 0.02, -0.28, D / 2 - 0.01))
    seat = block((-W / 2, -0.025, -D / 2), (W / 2, 0.025, D / 2))
    cushion = block((-0.18, 0.026, -0.15), (0.18, 0.09, 0.2))
    welded, result = votes(rail, seat, cushion)
    lowest, middle, top = np.argsort(welded.boxes()[0][:, 1])
    assert result.shares[[lowest, middle, top]].tolist() == [[0, 0, 1], [1, 0, 0], [1, 0, 0]]
    # The cushion lies on the seat: it is lifted with the top, not thickened.
    keep, shift = result.keep[top, 0], result.shift[top, 0]
    assert (keep[1], shift[1]) == (0.0, 0.5)
    # It keeps its margins: its ends go with the seat's.
    u = np.array([-0.18, 0.18]) / W
    np.testing.assert_allclose(keep[0] * u + shift[0], [-0.5, 0.5], atol=1e-5)


def test_a_spindle_is_stretched_along_itself_and_a_slat_is_carried_up():
    z = PARAMETERS[1] / 2 - D / 2
    spindle = block((-0.01, 0.3, z - 0.01), (0.01, 0.42, z + 0.01))
    slat = block((-W / 2, 0.1, z - 0.01), (W / 2, 0.15, z + 0.01))
    welded, result = votes(spindle, slat)
    upper = welded.boxes()[0][:, 1].argmax()
    assert result.keep[upper, 1, :2].tolist() == [0, 1]
    assert result.keep[1 - upper, 1, :2].tolist() == [1, 0]


def test_a_bar_between_posts_goes_where_they_go():
    z = PARAMETERS[1] / 2 - D / 2
    posts = [block((x - 0.015, 0.03, z - 0.02), (x + 0.015, 0.5, z + 0.02)) for x in (-0.21, 0.21)]
    bar = block((-0.19, 0.4, z - 0.02), (0.19, 0.44, z + 0.02))
    welded, result = votes(*posts, bar)
    low, high = welded.boxes()
    n = int((high - low)[:, 0].argmax())
    ends = result.keep[n, 1, 0] * np.array([-0.19, 0.19]) / W + result.shift[n, 1, 0]
    for side, end in ((-1, ends[0]), (1, ends[1])):
        post = int((side * low[:, 0]).argmax())
        assert result.keep[post, 1, 0] == 0.0
        np.testing.assert_allclose(end, result.shift[post, 1, 0], atol=1e-5)


def test_a_bar_between_timbers_goes_where_they_go():
    z = PARAMETERS[1] / 2 - D / 2
    timbers = [
        block((x - 0.015, -0.42, z - 0.02), (x + 0.015, 0.5, z + 0.02)) for x in (-0.195, 0.195)
    ]
    bar = block((-0.18, 0.4, z - 0.02), (0.18, 0.44, z + 0.02))
    welded, result = votes(*timbers, bar)
    low, high = welded.boxes()
    n = int((high - low)[:, 0].argmax())
    ends = result.keep[n, 1, 0] * np.array([-0.18, 0.18]) / W + result.shift[n, 1, 0]
    np.testing.assert_allclose(ends, [-0.5, 0.5], atol=1e-5)


def test_posts_thicken_with_the_back_and_spindles_do_not():
    thick = PARAMETERS[1]
    z = thick / 2 - D / 2
    post = block((-0.2, 0.03, z - thick / 2), (-0.17, 0.5, z + thick / 2))
    spindle = block((-0.01, 0.03, z - thick / 8), (0.01, 0.5, z + thick / 8))
    welded, result = votes(post, spindle)
    first = int(welded.boxes()[0][:, 0].argmin())
    assert result.keep[first, 1, 2] == 1.0
    assert result.keep[1 - first, 1, 2] == 0.0
    assert abs(result.shift[1 - first, 1, 2]) < 1e-5


def test_a_leaning_cushion_is_in_front_of_the_back_it_touches():
    thick = PARAMETERS[1]
    front = thick - D / 2
    panel = block((-W / 2, 0.03, front - thick), (W / 2, 0.5, front))
    points, faces = block((-0.18, 0.06, front), (0.18, 0.44, front + 0.05))
    points[:, 2] += 0.3 * (points[:, 1] - points[:, 1].mean())
    welded, result = votes(panel, (points, faces))
    cushion = int(welded.boxes()[0][:, 0].argmax())
    assert result.keep[1 - cushion, 1, 2] == 1.0
    assert result.keep[cushion, 1, 2] == 0.0
    assert abs(result.shift[cushion, 1, 2] - 0.5) < 5e-3


def test_touching_pieces_are_carried_together():
    spoke = block((-0.2, -0.40, -0.02), (0.2, -0.36, 0.02))
    castor = block((-0.21, -0.43, -0.01), (-0.16, -0.39, 0.01))
    _, apart = votes(block((-0.2, -0.30, -0.02), (0.2, -0.26, 0.02)), castor)
    _, result = votes(spoke, castor)
    np.testing.assert_array_equal(result.shift[0, 2, 1], result.shift[1, 2, 1])
    assert apart.shift[0, 2, 1] != apart.shift[1, 2, 1]


def test_a_flap_stretches_with_the_wing_and_an_engine_is_carried():
    flap = beside_wing(on_wing("left_wing", 0.5, 0.0, -0.4), (0.1, 0.004, 0.02))
    np.testing.assert_array_equal(flap.keep[0, 1], 1.0)
    engine = beside_wing(
        on_wing("left_wing", 0.4, 0.0, 0.5) - np.array([0, 0.04, 0]), (0.05, 0.05, 0.1)
    )
    np.testing.assert_array_equal(engine.keep[0, 1], 0.0)


def test_a_propellers_blade_is_no_spindle():
    ahead = np.array([0.0, 0.0, 0.08])
    blade = beside_wing(on_wing("left_wing", 0.5, 0.0, 0.5) + ahead, (0.12, 0.02, 0.004))
    assert blade.shares[0].tolist() == [0, 1, 0, 0]
    assert blade.keep[0, 1, 0] == 0.0


def hanging(*boxes: tuple[list[float], list[float]]) -> tuple[Welded, Votes]:
    """Blocks with ends in the fuselage's half sizes from its middle, but ahead in its length."""
    half = 0.5 * plane().maps(plane_values()).frames[0, :, :3].diagonal() * [1, 1, 2]
    return votes_of(
        plane(),
        plane_values(),
        joined(*(block(tuple(half * low), tuple(half * high)) for low, high in boxes)),
    )


def test_a_gears_leg_and_wheel_go_with_the_spot_where_the_leg_is_fixed():
    leg = ([-0.1, -1.8, 0.20], [0.1, -0.9, 0.21])
    wheel = ([-0.15, -2.3, 0.19], [0.15, -1.75, 0.23])
    _, alone = hanging(wheel)
    welded, result = hanging(leg, wheel)
    upper = welded.boxes()[0][:, 1].argmax()
    assert (result.shares[:, 0] == 1.0).all()
    np.testing.assert_array_equal(result.keep[:, 0], 0.0)
    np.testing.assert_array_equal(result.shift[0, 0], result.shift[1, 0])
    assert result.shift[upper, 0, 1] > alone.shift[0, 0, 1] == -0.5


def test_a_strut_in_the_belly_is_its_wheels_and_a_hatch_is_the_skins():
    strut = ([-0.05, -1.25, 0.20], [0.05, -0.8, 0.21])
    wheel = ([-0.1, -1.9, 0.19], [0.1, -1.2, 0.23])
    _, hatch = hanging(strut)
    np.testing.assert_array_equal(hatch.keep[0, 0], 1.0)
    _, result = hanging(strut, wheel)
    np.testing.assert_array_equal(result.keep[:, 0], 0.0)
    np.testing.assert_array_equal(result.shift[0, 0], result.shift[1, 0])


def test_a_wheel_goes_with_its_leg_on_the_wing():
    foot = on_wing("left_wing", 0.12, 0.0, 0.2)
    leg = block(tuple(foot - np.array([0.004, 0.08, 0.004])), tuple(foot + 0.004))
    low, high = foot - np.array([0.09, 0.10, 0.01]), foot + np.array([0.0, -0.075, 0.01])
    wheel = block(tuple(low), tuple(high))
    _, alone = votes_of(plane(), plane_values(), wheel)
    assert alone.shares[0, 0] == 1.0, "the fuselage is nearer"
    _, result = votes_of(plane(), plane_values(), joined(leg, wheel))
    assert result.shares[:, 1].tolist() == [1.0, 1.0]
