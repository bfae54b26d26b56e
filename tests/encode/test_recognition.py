from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from service.encode import recognition
from service.encode.model import Model, load_models
from service.encode.recognition import LISTED, recognise, settled, straightened, turned
from service.mesh.frame import CANONICAL, Orientation, orientations
from service.mesh.surface import Samples, sample_surface
from service.template.affine import AffineTemplate
from service.template.skinned import Body, SkinnedTemplate

SEVERAL = [
    Orientation("+z", "-y"),
    Orientation("-y", "+z"),
    Orientation("+x", "+y"),
    Orientation("+y", "-z"),
]


def laid(samples: Samples, orientation: Orientation) -> Samples:
    """Canonical samples as a file with these axes has them."""
    turn = orientation.rotation
    return Samples(
        samples.points @ turn, samples.normals @ turn, samples.faces, samples.barycentric
    )


@pytest.mark.parametrize("orientation", orientations(), ids=lambda o: f"{o.up}{o.front}")
def test_turning_undoes_the_files_orientation(
    chair_samples: Samples, orientation: Orientation
) -> None:
    back = turned(laid(chair_samples, orientation), orientation)
    np.testing.assert_allclose(back.points, chair_samples.points, atol=1e-15)
    np.testing.assert_allclose(back.normals, chair_samples.normals, atol=1e-15)
    assert back.faces is chair_samples.faces


@pytest.mark.parametrize("orientation", SEVERAL, ids=lambda o: f"{o.up}{o.front}")
def test_a_chair_is_recognised_whichever_way_it_lies(
    chair_model: Model, chair_samples: Samples, plain: np.ndarray, orientation: Orientation
) -> None:
    lying = laid(chair_samples, orientation)
    found = recognise([chair_model], {2840: lying}, orientations(), refined=True)
    best = found[0]
    assert best.orientation == orientation
    assert best.model is chair_model
    np.testing.assert_allclose(best.samples.points, chair_samples.points, atol=1e-12)
    metres = best.estimate.parameters / best.estimate.normalization.scale
    np.testing.assert_allclose(metres[:8], plain, atol=0.006)
    assert len(found) >= LISTED
    assert len({candidate.orientation for candidate in found}) == len(found)
    assert best.probability > 0.9 > 0.1 > found[1].probability
    assert best.score > 0.5


def test_the_readings_come_with_falling_probabilities(
    chair_model: Model, chair_samples: Samples
) -> None:
    found = recognise([chair_model], {2840: chair_samples}, orientations(), refined=True)
    assert found[0].orientation == CANONICAL
    probabilities = [candidate.probability for candidate in found]
    assert probabilities == sorted(probabilities, reverse=True)
    assert 0.99 < sum(probabilities) <= 1.0 + 1e-9
    assert len({candidate.estimate.distance for candidate in found}) == len(found)


def test_what_looks_the_same_from_all_sides_is_read_as_files_mostly_are(
    chair_model: Model, chair: AffineTemplate, plain: np.ndarray
) -> None:
    template = chair
    stool = dict(zip(template.names, plain, strict=True))
    stool |= {"back_height": 0.02, "back_thickness": 0.02, "seat_depth": 0.48}
    vertices = template.decode(np.array(list(stool.values())))
    faces = template.faces[(template.part != template.parts.index("back"))[template.faces[:, 0]]]
    samples = sample_surface(vertices, faces, 2840, np.random.default_rng(0))
    found = recognise([chair_model], {2840: samples}, orientations(), refined=False)
    assert found[0].orientation == CANONICAL
    assert {candidate.orientation.up for candidate in found} == {"+y"}
    assert found[1].probability > 0.1
    lying = laid(samples, Orientation("+z", "-y"))
    found = recognise([chair_model], {2840: lying}, orientations(), refined=False)
    assert found[0].orientation.up == "+z"


def test_a_single_orientation_is_not_questioned(chair_model: Model, chair_samples: Samples) -> None:
    upside_down = Orientation("-y", "+z")
    for refined in (True, False):
        (only,) = recognise([chair_model], {2840: chair_samples}, [upside_down], refined)
        assert only.orientation == upside_down
        np.testing.assert_array_equal(only.samples.points[:, 1], -chair_samples.points[:, 1])


def test_what_is_known_of_the_axes_narrows_the_search(
    chair_model: Model, chair_samples: Samples
) -> None:
    lying = laid(chair_samples, Orientation("+z", "-y"))
    found = recognise([chair_model], {2840: lying}, orientations(up="+z"), refined=False)
    assert found[0].orientation == Orientation("+z", "-y")
    assert {candidate.orientation.up for candidate in found} == {"+z"}


def test_unrefined_the_answer_is_the_encoders(chair_model: Model, chair_samples: Samples) -> None:
    for orientation in (CANONICAL, Orientation("+z", "-y")):
        lying = laid(chair_samples, orientation)
        best = recognise([chair_model], {2840: lying}, orientations(), refined=False)[0]
        assert best.orientation == orientation
        assert best.estimate.distance == best.estimate.encoder_distance
        points = best.estimate.normalization.apply(best.samples.points)
        np.testing.assert_allclose(
            best.estimate.parameters, chair_model.encode(points).parameters, atol=1e-5
        )


def leaning(samples: Samples, lean: np.ndarray) -> Samples:
    turn = CANONICAL.leaning(lean).rotation
    return Samples(
        samples.points @ turn.T, samples.normals @ turn.T, samples.faces, samples.barycentric
    )


def test_a_leaning_chair_is_straightened(
    chair_model: Model, chair_samples: Samples, plain: np.ndarray
) -> None:
    lean = np.radians([7.0, 9.0, -4.0])
    samples = leaning(chair_samples, lean)
    best = recognise([chair_model], {2840: samples}, orientations(), refined=True)[0]
    assert (best.orientation.up, best.orientation.front) == ("+y", "+z")
    assert best.orientation.degrees == pytest.approx(np.degrees(np.linalg.norm(lean)), abs=1.5)
    metres = best.estimate.parameters / best.estimate.normalization.scale
    np.testing.assert_allclose(metres[:8], plain, atol=0.012)
    np.testing.assert_allclose(best.samples.points, chair_samples.points, atol=0.02)


def test_a_lean_that_fits_worse_is_not_believed(
    chair_model: Model, chair_samples: Samples, monkeypatch: pytest.MonkeyPatch
) -> None:
    (best,) = recognise([chair_model], {2840: chair_samples}, [CANONICAL], refined=True)
    monkeypatch.setattr(recognition, "leans", lambda *_, **__: iter([np.array([0.3, 0.0, 0.0])]))
    assert straightened(best) is best


def test_faces_that_are_wound_the_wrong_way_round_do_no_harm(
    chair_model: Model, chair_samples: Samples
) -> None:
    turned_out = Samples(
        chair_samples.points,
        -chair_samples.normals,
        chair_samples.faces,
        chair_samples.barycentric,
    )
    (right,) = recognise([chair_model], {2840: chair_samples}, [CANONICAL], refined=True)
    (wrong,) = recognise([chair_model], {2840: turned_out}, [CANONICAL], refined=True)
    assert wrong.estimate.inside_out
    assert not right.estimate.inside_out
    np.testing.assert_array_equal(wrong.estimate.parameters, right.estimate.parameters)


@pytest.mark.parametrize("orientation", SEVERAL[:2], ids=lambda o: f"{o.up}{o.front}")
def test_all_ways_of_turning_a_body_are_one_reading(
    human: SkinnedTemplate, strider: Body, body_folder: Path, orientation: Orientation
) -> None:
    model = load_models(body_folder)["human"]
    rng = np.random.default_rng(0)
    samples = sample_surface(human.decode(strider), human.faces, model.points, rng)
    lying = laid(samples, orientation)
    (only,) = recognise([model], {model.points: lying}, orientations(), refined=False)
    assert only.orientation == orientation
    assert only.probability == pytest.approx(1.0)
    assert straightened(only) is only


def test_a_body_is_told_of_in_the_orientation_that_it_stands_upright_in(
    human: SkinnedTemplate, strider: Body, body_folder: Path
) -> None:
    model = load_models(body_folder)["human"]
    rng = np.random.default_rng(0)
    samples = sample_surface(human.decode(strider), human.faces, model.points, rng)
    (right,) = recognise([model], {model.points: samples}, orientations(), refined=False)
    lying = Orientation("+z", "-y")
    mistaken = replace(right, orientation=lying, samples=turned(samples, lying))
    fit = model.estimate(mistaken.samples, refined=False)
    mistaken = replace(mistaken, estimate=fit)
    assert np.trace(fit.turn) < 2.0
    mended = settled(mistaken, {model.points: samples}, orientations())
    assert mended.orientation == right.orientation
    np.testing.assert_allclose(mended.samples.points, right.samples.points)
    assert settled(right, {model.points: samples}, orientations()) is right
    assert settled(mistaken, {model.points: samples}, [lying]) is mistaken


def test_a_body_that_lies_in_the_clients_frame_is_as_much_a_body(
    human: SkinnedTemplate, strider: Body, body_folder: Path
) -> None:
    model = load_models(body_folder)["human"]
    rng = np.random.default_rng(0)
    samples = sample_surface(human.decode(strider), human.faces, model.points, rng)
    found = [
        recognise([model], {model.points: samples}, [way], refined=True)[0]
        for way in (CANONICAL, Orientation("+z", "-y"))
    ]
    assert found[0].odds == found[1].odds
    assert found[1].estimate.distance == pytest.approx(found[0].estimate.distance, rel=0.2)
    assert np.trace(found[1].estimate.turn) < 2.0 < np.trace(found[0].estimate.turn)
