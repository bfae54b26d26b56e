from __future__ import annotations

import numpy as np
import pytest
from boxes import ORIGIN, PARAMETERS, block, chair, change, joined, template_mesh
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from planes import (
    VALUES,
    of_part,
    on_wing,
    plane,
    plane_change,
    plane_mesh,
    plane_values,
)

from model_export.detailed import detailed_chair
from service.deform.binding import Binding
from service.deform.blend import bind
from service.deform.turning import count_flips


def bound(mesh: tuple[np.ndarray, np.ndarray]) -> Binding:
    return bind(*mesh, chair(), PARAMETERS, ORIGIN)


def detailed(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, float]:
    """A detailed chair's normalised vertices, faces, parameters, origin, and the scale."""
    it = detailed_chair(seed)
    x = it.mesh(it.parameters)
    center = x.mean(axis=0)
    scale = 0.6 / np.linalg.norm(x - center, axis=1).max()
    return (x - center) * scale, it.faces, it.parameters * scale, -center * scale, scale


def test_the_template_moves_as_it_decodes_itself():
    template = chair()
    vertices, faces = template_mesh()
    df = 0.2 * PARAMETERS * np.array([1, -1, 1, -1, 1, -1, 1, -1])
    moved = vertices + bound((vertices, faces)).displace(df)
    np.testing.assert_allclose(moved, template.decode(PARAMETERS + df) + ORIGIN, atol=1e-6)


def test_displacements_add_up_and_are_the_jacobian_times_the_change():
    binding = bound(template_mesh())
    a, b = change("seat_width", 0.1), change("leg_height", -0.07)
    np.testing.assert_allclose(
        binding.displace(a + b), binding.displace(a) + binding.displace(b), atol=1e-7
    )
    np.testing.assert_array_equal(
        binding.displace(change("seat_width", 1.0)), binding.jacobian[:, :, 4]
    )


def test_no_change_moves_nothing():
    assert not bound(template_mesh()).displace(np.zeros(8)).any()


@pytest.mark.parametrize(
    ("name", "still"),
    [
        ("seat_width", [1, 2]), ("seat_depth", [0, 1]), ("leg_height", [0, 2]),
        ("back_height", [0, 2]), ("back_thickness", [0, 1]), ("seat_thickness", [0, 2]),
    ],
)  # fmt: skip
@pytest.mark.parametrize("seed", [1, 2])
def test_an_edit_moves_nothing_along_other_axes_bit_for_bit(seed, name, still):
    x, faces, f, t, _ = detailed(seed)
    moved = bind(x, faces, chair(), f, t).displace(change(name, 0.13))
    assert not moved[:, still].any()
    assert moved.any()


def test_parts_that_an_edit_leaves_alone_stay_within_the_aim():
    x, faces, f, t, _ = detailed(4)
    still = x[:, 1] - t[1] > f[2] / 2 + 0.01
    moved = bind(x, faces, chair(), f, t).displace(change("leg_height", 0.4 * f[5]))
    assert np.linalg.norm(moved[still], axis=1).mean() < 5e-4 * np.linalg.norm(np.ptp(x, axis=0))


@pytest.mark.parametrize("seed", [0, 2, 7])
def test_detailed_chairs_follow_their_truth(seed):
    x, faces, f, t, scale = detailed(seed)
    it = detailed_chair(seed)
    binding = bind(x, faces, chair(), f, t)
    for name in ("seat_width", "seat_depth", "leg_height", "back_height", "leg_width"):
        df = change(name, 0.4) * f
        truth = it.mesh(it.parameters + df / scale) * scale + t
        error = np.linalg.norm(x + binding.displace(df) - truth, axis=1).mean()
        assert error < 0.15 * np.linalg.norm(truth - x, axis=1).mean(), name


@pytest.mark.parametrize("factor", [-0.3, 0.4])
def test_no_face_turns_inside_out(factor):
    x, faces, f, t, _ = detailed(2)
    binding = bind(x, faces, chair(), f, t)
    for name in chair().names:
        df = change(name, factor) * f
        assert count_flips(x, x + binding.displace(df), faces, binding.linear(df)) == 0, name


def test_vertices_at_one_place_move_together():
    vertices, faces = template_mesh()
    seam = vertices[faces].reshape(-1, 3)
    soup = np.arange(len(seam)).reshape(-1, 3)
    moved = bound((seam, soup)).displace(0.3 * PARAMETERS)
    np.testing.assert_array_equal(
        moved, bound((vertices, faces)).displace(0.3 * PARAMETERS)[faces.ravel()]
    )


def test_a_mirrored_mesh_moves_as_the_mirror_image():
    mirror = np.array([-1.0, 1.0, 1.0])
    x, faces, f, t, _ = detailed(2)
    moved = bind(x, faces, chair(), f, t).displace(0.3 * f)
    image = bind(x * mirror, faces[:, ::-1], chair(), f, t * mirror).displace(0.3 * f)
    assert np.abs(image * mirror - moved).max() < 1e-4


def test_a_small_piece_on_the_back_is_carried_without_stretch():
    w, d, bt = PARAMETERS[[4, 3, 1]]
    back = block((-w / 2, 0.025, -d / 2), (w / 2, 0.525, bt - d / 2))
    knob = block((-0.02, 0.4, bt - d / 2), (0.02, 0.44, bt - d / 2 + 0.04), cells=1)
    moved = bound(joined(back, knob)).displace(
        change("back_height", 0.2) + change("seat_width", 0.1)
    )
    own = moved[len(back[0]) :]
    np.testing.assert_allclose(own, np.broadcast_to(own[0], own.shape), atol=1e-6)
    assert 0.1 < own[0, 1] < 0.2


def test_a_splayed_leg_thickens_about_its_own_axis():
    vertices, faces = template_mesh()
    template = chair()
    legs = np.isin(template.part, [2, 3, 4, 5])
    down = np.where(legs, np.clip(-0.025 - (vertices - ORIGIN)[:, 1], 0.0, None), 0.0) / 0.4
    vertices[:, 0] += 0.1 * down * np.sign(vertices[:, 0] - ORIGIN[0])
    moved = bound((vertices, faces)).displace(change("leg_width", 0.02))
    straight = bound(template_mesh()).displace(change("leg_width", 0.02))
    np.testing.assert_allclose(moved[legs], straight[legs], atol=1e-3)


def test_a_stretcher_lengthens_evenly_from_leg_to_leg():
    w, d = PARAMETERS[[4, 3]]
    legs, _ = template_mesh()
    rail = block((-w / 2 + 0.05, -0.3, d / 2 - 0.03), (w / 2 - 0.05, -0.28, d / 2 - 0.01), cells=10)
    moved = bound(joined((legs, chair().faces), rail)).displace(change("seat_width", 0.1))[
        len(legs) :
    ]
    inner = w - 0.1
    expected = (rail[0][:, 0] - ORIGIN[0]) / inner * 0.1
    np.testing.assert_allclose(moved[:, 0], expected, atol=1e-6)


def test_beyond_a_thin_part_growth_is_bounded():
    thin = PARAMETERS.copy()
    thin[2] = 0.01
    w, d = PARAMETERS[[4, 3]]
    cushion = block((-w / 2, -0.005, -d / 2), (w / 2, 0.15, d / 2))
    moved = bind(*cushion, chair(), thin, ORIGIN).displace(change("seat_thickness", 0.04))
    assert np.abs(moved).max() <= 0.04 + 1e-6


def test_points_without_faces_and_a_part_without_size_are_bound():
    flat = PARAMETERS * np.array([1, 0, 0, 1, 1, 1, 0, 0])
    points = template_mesh()[0]
    moved = bind(points, np.empty((0, 3), np.int64), chair(), flat, ORIGIN).displace(
        0.2 * PARAMETERS
    )
    assert np.isfinite(moved).all()


@settings(max_examples=20, deadline=None)
@given(hnp.arrays(np.float64, (12, 3), elements=st.floats(-0.7, 0.7)), st.randoms())
def test_any_triangles_are_bound_to_finite_moves(points, random):
    faces = np.array([[random.randrange(12) for _ in range(3)] for _ in range(9)])
    binding = bound((points, faces))
    assert np.isfinite(binding.jacobian).all()
    assert np.isfinite(binding.linear(0.4 * PARAMETERS)).all()
    assert np.abs(binding.displace(0.4 * PARAMETERS)).max() < 2.0


def test_a_post_that_runs_from_the_floor_to_the_top_follows_leg_and_back():
    post = block((-0.21, -0.425, -0.225), (-0.17, 0.525, -0.185), cells=24)
    vertices, faces = joined(post, template_mesh())
    binding = bind(vertices, faces, chair(), PARAMETERS, ORIGIN)
    count = len(post[0])
    height = vertices[:count, 1] - ORIGIN[1]
    lowered = binding.displace(change("back_height", -0.15))[:count, 1]
    assert lowered[height > 0.5].max() < -0.12
    assert np.abs(lowered[height < -0.1]).max() < 0.01
    raised = binding.displace(change("leg_height", 0.1))[:count, 1]
    assert raised[height < -0.4].max() < -0.09
    assert np.abs(raised[height > 0.1]).max() < 0.01


def bound_plane(mesh: tuple[np.ndarray, np.ndarray]) -> Binding:
    return bind(*mesh, plane(), plane_values(), ORIGIN)


def skin(name: str) -> tuple[np.ndarray, np.ndarray]:
    """A wing's upper and lower side from the fuselage's side to the tip, at its own fine cells."""
    grid, faces = block((-0.5, -0.5, -0.5), (0.5, 0.5, 0.5), 8)
    span, across, chord = (grid - ORIGIN).T
    points = [on_wing(name, s + 0.5, y, z) for s, y, z in zip(span, across, chord, strict=True)]
    return np.array(points) + ORIGIN, faces if name == "left_wing" else faces[:, ::-1]


@pytest.mark.parametrize("factor", [0.8, 1.25])
@pytest.mark.parametrize("name", list(VALUES)[:6])
def test_an_airplane_outside_its_fuselage_moves_as_it_decodes_itself(name, factor):
    vertices, faces = plane_mesh()
    df = plane_change(name, factor)
    moved = bound_plane((vertices, faces)).displace(df)
    truth = plane().decode(plane_values() + df) + ORIGIN - vertices
    x = np.abs(vertices - ORIGIN)
    # Wings and fin are longer from the fuselage's side on, not from within it: exact at the tips.
    wing = of_part("left_wing") | of_part("right_wing")
    fin = of_part("vertical_stabilizer")
    tips = (x[:, 0] > x[:, 0].max() - 1e-9) | (x[:, 1] > x[fin, 1].max() - 1e-9)
    exact = tips | ~(wing | fin)
    if name == "vertical_stabilizer_length":
        # A fin keeps the angle of its sweep, where the template's gets a little steeper.
        back = -VALUES["vertical_stabilizer_length"] / 0.15 * 0.4 * moved[exact, 1]
        np.testing.assert_allclose(moved[exact, 2], back, atol=2e-4)
        moved[:, 2] = truth[:, 2] = 0.0
    np.testing.assert_allclose(moved[exact], truth[exact], atol=1e-6)
    inside = {"fuselage_width": 0.25, "fuselage_height": 0.2}.get(name, 0.15)
    assert np.abs(moved - truth).max() <= inside * np.abs(df).max() + 1e-6


def test_wings_of_their_own_move_as_worked_out_by_hand():
    wings = joined(skin("left_wing"), skin("right_wing"))
    binding = bound_plane(wings)
    span = (np.abs(wings[0] - ORIGIN)[:, 0] - VALUES["fuselage_width"] / 2) / VALUES["wing_length"]
    side = np.sign((wings[0] - ORIGIN)[:, 0])
    longer = binding.displace(plane_change("wing_length", 1.25))
    np.testing.assert_allclose(longer[:, 0], 0.1 * span * side, atol=1e-6)
    assert np.abs(longer[:, 1:]).max() < 1e-6
    wider = binding.displace(plane_change("fuselage_width", 1.5))
    np.testing.assert_allclose(wider[:, 0], 0.25 * VALUES["fuselage_width"] * side, atol=1e-6)
    stretched = binding.displace(plane_change("fuselage_length", 1.2))
    ahead = 0.2 * VALUES["wing_position"]
    np.testing.assert_allclose(stretched, np.tile([0, 0, ahead], (len(span), 1)), atol=1e-6)


def test_a_t_tail_rides_on_the_fin_and_the_rest_stays():
    vertices, faces = plane_mesh()
    moved = bound_plane((vertices, faces)).displace(
        plane_change("vertical_stabilizer_length", 1.25)
    )
    tail = of_part("left_horizontal_stabilizer") | of_part("right_horizontal_stabilizer")
    raised = 0.25 * (VALUES["horizontal_stabilizer_height"] - 0.2 * VALUES["fuselage_height"])
    np.testing.assert_allclose(moved[tail, 1], raised, atol=1e-6)
    back = -0.4 * VALUES["vertical_stabilizer_length"] / 0.15 * raised
    np.testing.assert_allclose(moved[tail, 2], back, atol=2e-4)
    still = of_part("fuselage") | of_part("left_wing") | of_part("right_wing")
    assert np.abs(moved[still]).max() < 1e-6


def test_an_airplane_in_one_piece_is_edited_evenly_without_folds():
    vertices, faces = plane_mesh()
    bridge = [[int(np.flatnonzero(of_part(part))[0]) for part in parts] for parts in BRIDGES]
    whole = vertices, np.concatenate([faces, np.array(bridge)])
    binding = bound_plane(whole)
    mirror = np.array([-1.0, 1.0, 1.0])
    image = (vertices - ORIGIN) * mirror
    other = np.linalg.norm(image[:, None] - (vertices - ORIGIN)[None], axis=2).argmin(axis=1)
    for name in list(VALUES)[:6]:
        df = plane_change(name, 1.25)
        moved = binding.displace(df)
        np.testing.assert_allclose(moved[other], moved * mirror, atol=2e-4, err_msg=name)
        after = vertices + moved
        assert count_flips(vertices, after, faces, binding.linear(df)) <= 0.002 * len(faces), name


BRIDGES = (
    ("fuselage", "left_wing", "right_wing"),
    ("fuselage", "left_horizontal_stabilizer", "right_horizontal_stabilizer"),
    ("fuselage", "vertical_stabilizer", "left_wing"),
)
"""Triangles that make the airplane one piece."""


@settings(max_examples=10, deadline=None)
@given(hnp.arrays(np.float64, (12, 3), elements=st.floats(-0.7, 0.7)), st.randoms())
def test_any_triangles_are_bound_to_an_airplane(points, random):
    faces = np.array([[random.randrange(12) for _ in range(3)] for _ in range(9)])
    binding = bound_plane((points, faces))
    assert np.isfinite(binding.jacobian).all()
    df = 0.25 * np.where(plane().public, plane_values(), 0.0)
    assert np.isfinite(binding.linear(df)).all()
    assert np.abs(binding.displace(df)).max() < 1.0
