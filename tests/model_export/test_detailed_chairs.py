from __future__ import annotations

import numpy as np
import pytest
import trimesh

from model_export.detailed import NAMES, detailed_chair
from service.deform.normals import face_crosses
from service.template.loader import load_template

SEEDS = [0, 1, 2, 4, 5, 9]


def test_the_parameters_are_the_templates():
    assert load_template("paper_chair").names == NAMES


@pytest.mark.parametrize("seed", SEEDS)
def test_it_is_a_closed_surface_of_the_promised_size(seed):
    chair = detailed_chair(seed)
    solid = trimesh.Trimesh(chair.mesh(chair.parameters), chair.faces, process=False)
    assert 4_000 < len(solid.vertices) < 40_000
    assert solid.is_watertight
    assert solid.is_winding_consistent
    assert solid.volume > 0
    assert (solid.body_count == 1) == chair.welded


@pytest.mark.parametrize("seed", SEEDS)
def test_a_seed_is_a_chair(seed):
    first, second = detailed_chair(seed), detailed_chair(seed)
    np.testing.assert_array_equal(first.mesh(first.parameters), second.mesh(second.parameters))
    assert not np.array_equal(first.parameters, detailed_chair(seed + 1).parameters)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize(
    ("name", "axis"), [("leg_height", 1), ("back_height", 1), ("seat_width", 0)]
)
def test_an_edit_changes_the_chair_by_as_much_and_along_one_axis(seed, name, axis):
    chair = detailed_chair(seed)
    index = NAMES.index(name)
    edited = chair.parameters.copy()
    edited[index] *= 1.2
    before, after = chair.mesh(chair.parameters), chair.mesh(edited)
    grown = np.ptp(after, axis=0) - np.ptp(before, axis=0)
    assert grown[axis] == pytest.approx(0.2 * chair.parameters[index], abs=0.003)


@pytest.mark.parametrize("seed", SEEDS)
def test_wider_means_farther_apart_not_thicker(seed):
    chair = detailed_chair(seed)
    wider = chair.parameters.copy()
    wider[4] += 0.1
    before, after = chair.mesh(chair.parameters), chair.mesh(wider)
    foot = before[:, 1] < before[:, 1].min() + 0.01
    moved = (after - before)[foot]
    np.testing.assert_allclose(moved[:, 0], 0.05 * np.sign(before[foot, 0]), atol=1e-9)
    np.testing.assert_allclose(moved[:, 1:], 0.0, atol=1e-9)


@pytest.mark.parametrize("seed", [0, 2])
def test_density_is_how_finely_a_chair_is_cut(seed):
    coarse, fine = detailed_chair(seed, density=1), detailed_chair(seed, density=10)
    np.testing.assert_array_equal(coarse.parameters, fine.parameters)
    assert len(coarse.mesh(coarse.parameters)) < 3_000
    assert len(fine.mesh(fine.parameters)) > 50_000
    extents = [np.ptp(chair.mesh(chair.parameters), axis=0) for chair in (coarse, fine)]
    np.testing.assert_allclose(*extents, rtol=0.03)


@pytest.mark.parametrize("seed", [2, 8, 11, 110])
def test_no_true_edit_of_a_welded_chair_folds_a_face(seed):
    chair = detailed_chair(seed, density=2)
    assert chair.welded
    before = face_crosses(chair.mesh(chair.parameters), chair.faces)
    for index in range(len(NAMES)):
        for factor in (0.7, 1.4):
            edited = chair.parameters.copy()
            edited[index] *= factor
            after = face_crosses(chair.mesh(edited), chair.faces)
            assert (np.einsum("fc,fc->f", before, after) > 0.0).all()


def test_a_panels_rounded_edges_keep_their_radius():
    chair = detailed_chair(6)
    taller = chair.parameters.copy()
    taller[NAMES.index("back_height")] *= 1.4
    before, after = chair.mesh(chair.parameters), chair.mesh(taller)
    high = before[:, 1] > before[:, 1].max() - 0.002
    moved = (after - before)[high, 1]
    assert np.ptp(before[high, 1]) > 0.001
    np.testing.assert_allclose(moved, moved[0], atol=1e-9)


def test_a_welded_leg_without_rails_stretches_evenly():
    chair = detailed_chair(2)
    taller = chair.parameters.copy()
    taller[NAMES.index("leg_height")] *= 1.4
    before, after = chair.mesh(chair.parameters), chair.mesh(taller)
    top = -chair.parameters[NAMES.index("seat_thickness")] / 2
    below = before[:, 1] < top - 1e-6
    np.testing.assert_allclose((after[below, 1] - top) / (before[below, 1] - top), 1.4)
