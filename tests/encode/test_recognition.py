from __future__ import annotations

import numpy as np
import pytest

from service.encode.model import Model
from service.encode.recognition import PRIOR, Candidate, recognise, turned
from service.mesh.frame import CANONICAL, Orientation, orientations
from service.mesh.surface import Samples

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
    np.testing.assert_allclose(metres, plain, atol=0.006)
    assert len(found) > 1
    assert len({candidate.orientation for candidate in found}) == len(found)
    ranks = [candidate.rank for candidate in found[1:]]
    assert ranks == sorted(ranks)
    assert best.estimate.distance < 0.5 * found[1].estimate.distance


def test_a_canonical_chair_is_taken_at_once(chair_model: Model, chair_samples: Samples) -> None:
    (only,) = recognise([chair_model], {2840: chair_samples}, orientations(), refined=True)
    assert only.orientation == CANONICAL


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
            best.estimate.parameters, chair_model.encode(points)[0], atol=1e-5
        )


def test_the_canonical_orientation_wins_a_close_call(
    chair_model: Model, chair_samples: Samples
) -> None:
    (found,) = recognise([chair_model], {2840: chair_samples}, [CANONICAL], refined=True)
    other = Candidate(chair_model, Orientation("+y", "-z"), chair_samples, found.estimate)
    assert 0 < PRIOR < 1
    assert found.rank == pytest.approx(PRIOR * other.rank)
    assert other.rank == found.estimate.distance / chair_model.usual_distance
