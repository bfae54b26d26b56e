from __future__ import annotations

import importlib.util

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

from model_export.benchmark.case import Case
from model_export.benchmark.known import told
from model_export.detailed import detailed_airplane, detailed_chair
from model_export.rivals.cage import caged, mean_value_coordinates
from model_export.rivals.registry import RIVALS
from model_export.rivals.rigid import spread
from model_export.rivals.scaling import axes
from model_export.rivals.subject import Edit, Subject
from service.mesh.surface import Normalization
from service.template.loader import load_template

IGL = importlib.util.find_spec("igl") is not None
NEED_IGL = {"as-rigid-as-possible", "re-synthesis (bound)"}


@pytest.fixture(scope="module")
def case() -> Case:
    """A coarse chair, and its true edits."""
    shape, category = detailed_chair(1, 1), load_template("chair")
    vertices = shape.mesh(shape.parameters)
    frame = Normalization.of(vertices)
    truths = {}
    for index, name in enumerate(shape.names):
        f = shape.parameters.copy()
        f[index] *= 1.4
        truths[name, 1.4] = frame.apply(shape.mesh(f))
    known = {"true": told(shape, category, frame, np.ones(8))}
    return Case("D", "chair", category, frame.apply(vertices), shape.faces, known, truths)


def wider(case: Case) -> Edit:
    return next(e for e in case.edits("true") if (e.name, e.factor) == ("seat_width", 1.4))


@pytest.mark.parametrize("name", RIVALS)
def test_each_rival_answers_an_edit_nearer_to_the_truth_than_nothing(name: str, case: Case) -> None:
    if name in NEED_IGL and not IGL:
        pytest.skip("libigl is not installed")
    edit = wider(case)
    assert edit.truth is not None
    outcome = RIVALS[name].rule(case.subject("true"))(edit)
    if RIVALS[name].makes_anew:
        assert outcome.faces is not None
        far, _ = cKDTree(outcome.vertices).query(edit.truth)
        assert np.median(far) < 0.005
        np.testing.assert_allclose(
            np.ptp(outcome.vertices, axis=0), np.ptp(edit.truth, axis=0), atol=0.02
        )
        return
    assert outcome.faces is None
    error = np.linalg.norm(outcome.vertices - edit.truth, axis=1).mean()
    assert error < 0.35 * np.linalg.norm(case.vertices - edit.truth, axis=1).mean()


@pytest.mark.parametrize("name", ["cage (bound)", "re-synthesis (bound)"])
def test_a_bound_needs_the_truth(name: str, case: Case) -> None:
    edit = Edit("seat_width", 0, 1.4, np.zeros(len(case.category.parameters)))
    with pytest.raises(ValueError, match="true edit"):
        RIVALS[name].rule(case.subject("true"))(edit)


def test_parameters_lie_along_the_axes_that_their_names_say(case: Case) -> None:
    chair = case.subject("true")
    found = dict(zip(chair.template.names, axes(chair).tolist(), strict=True))
    assert [found[name] for name in detailed_chair(0).names] == [1, 2, 1, 2, 0, 1, 2, 0]
    shape, category = detailed_airplane(1, 1), load_template("airplane")
    known = told(shape, category, Normalization.of(shape.mesh(shape.parameters)), np.ones(6))
    plane = Subject(np.zeros((1, 3)), np.zeros((0, 3), int), known.template, known.f, known.t)
    found = dict(zip(category.names, axes(plane).tolist(), strict=True))
    assert [found[name] for name in shape.names] == [1, 2, 0, 0, 1, 0]


def test_global_scale_scales_about_the_origin_of_the_template(case: Case) -> None:
    subject, edit = case.subject("true"), wider(case)
    y = RIVALS["global scale"].rule(subject)(edit).vertices - subject.t
    x = case.vertices - subject.t
    np.testing.assert_allclose(y, x * [1.4, 1.0, 1.0], atol=1e-12)


def test_nine_slice_keeps_what_lies_beyond_a_cut_and_stretches_between(case: Case) -> None:
    edit = next(e for e in case.edits("true") if (e.name, e.factor) == ("leg_height", 1.4))
    moved = RIVALS["nine-slice"].rule(case.subject("true"))(edit).vertices - case.vertices
    np.testing.assert_allclose(moved[:, [0, 2]], 0.0, atol=1e-12)
    low = case.vertices[:, 1] < case.vertices[:, 1].min() + 1e-3
    grown = edit.df[edit.index]
    np.testing.assert_allclose(moved[low, 1], -grown, rtol=0.05)
    high = case.vertices[:, 1] > case.subject("true").t[1] + 0.1
    np.testing.assert_allclose(moved[high, 1], 0.0, atol=0.02 * grown)


def test_mean_value_coordinates_are_linear_within_the_cage() -> None:
    sphere = trimesh.creation.icosphere(subdivisions=1)
    points = np.random.default_rng(0).uniform(-0.45, 0.45, (50, 3))
    weights = mean_value_coordinates(points, np.array(sphere.vertices), np.array(sphere.faces))
    assert len(sphere.vertices) == weights.shape[1] == 42
    np.testing.assert_allclose(weights.sum(axis=1), 1.0)
    np.testing.assert_allclose(weights @ sphere.vertices, points, atol=1e-9)


def test_a_cage_follows_an_affine_edit_to_the_letter(case: Case) -> None:
    truth = case.vertices @ np.array([[1.2, 0.1, 0], [0, 0.9, 0], [0, 0.2, 1.0]]) + 0.1
    edit = Edit("seat_width", 0, 1.0, np.zeros(1), truth)
    np.testing.assert_allclose(caged(case.subject("true"))(edit).vertices, truth, atol=1e-6)


def test_handles_are_spread_over_all_of_a_mesh() -> None:
    line = np.linspace(0.0, 1.0, 101)[:, None] * [1.0, 0.0, 0.0]
    assert spread(line, 3).tolist() == [0, 100, 50]
    assert spread(line[:2], 5).tolist() == [0, 1]
