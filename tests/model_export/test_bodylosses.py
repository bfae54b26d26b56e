from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from model_export.bodies import BodyBatch, Garments, SyntheticBodies
from model_export.bodylosses import BodyAnswer, BodyLosses, draw_edits, geodesic_squared
from model_export.train_body import ordered
from service.encode.bodyoutputs import ANCHORS
from service.template.anatomy import JOINTS, PARENTS
from service.template.bodyfile import load_body
from service.template.skinning import pose_joints

COUNT = len(JOINTS)


@pytest.fixture(scope="module")
def batch() -> BodyBatch:
    return ordered(SyntheticBodies(load_body(), Garments.none(), 0).batch(4, 300))


@pytest.fixture(scope="module")
def losses() -> BodyLosses:
    return BodyLosses(load_body(), 0)


@pytest.fixture(scope="module")
def truth(batch: BodyBatch) -> BodyAnswer:
    turned, _ = pose_joints(batch.rotations, batch.joints, PARENTS)
    return BodyAnswer(batch.joints, turned, batch.rotations, batch.shape, batch.scale)


def votes_of(batch: BodyBatch) -> tuple[torch.Tensor, ...]:
    """What perfect anchors answer, and edits."""
    parts = 20.0 * torch.nn.functional.one_hot(batch.parts[:, :ANCHORS], COUNT).float()
    edits = draw_edits(len(batch.joints), torch.Generator().manual_seed(0))
    return parts, batch.joints[:, None].expand(-1, ANCHORS, -1, -1), edits


def test_outputs_are_taken_apart(batch: BodyBatch, truth: BodyAnswer) -> None:
    columns = truth.turned[..., :2].transpose(2, 3).flatten(1)
    outputs = torch.cat(
        [truth.votes.flatten(1), columns, truth.shape, truth.scale.log()[:, None]], dim=1
    )
    found = BodyAnswer.of(outputs)
    assert torch.allclose(found.rotations, batch.rotations, atol=1e-5)
    assert torch.allclose(found.turned, truth.turned, atol=1e-5)
    assert torch.allclose(found.scale, batch.scale, atol=1e-5)
    assert torch.equal(found.shape, batch.shape)


def test_the_truth_costs_nothing(losses: BodyLosses, batch: BodyBatch, truth: BodyAnswer) -> None:
    terms = losses.synthetic(truth, batch, *votes_of(batch))
    assert set(terms) == {"joint", "vote", "sem", "shape", "scale", "part", "rec"}
    assert all(value.item() < 1e-6 for value in terms.values())


@pytest.mark.parametrize(
    ("change", "terms"),
    [
        ("votes", {"joint", "rec"}),
        ("rotations", {"sem", "rec"}),
        ("shape", {"shape", "rec"}),
        ("scale", {"scale", "rec"}),
    ],
)
def test_each_error_costs_where_it_should(
    losses: BodyLosses, batch: BodyBatch, truth: BodyAnswer, change: str, terms: set[str]
) -> None:
    turn = torch.as_tensor(Rotation.from_rotvec([0.0, 0.0, 0.3]).as_matrix()).float()
    wrong = {
        "votes": truth.votes + 0.1,
        "rotations": truth.rotations @ turn,
        "shape": truth.shape + 1.0,
        "scale": 1.2 * truth.scale,
    }
    answer = replace(truth, **{change: wrong[change]})
    found = losses.synthetic(answer, batch, *votes_of(batch))
    assert {name for name, value in found.items() if value.item() > 1e-4} == terms


def test_the_surface_is_that_of_the_template(
    losses: BodyLosses, batch: BodyBatch, truth: BodyAnswer
) -> None:
    surface = losses.surface(truth.rotations, truth.shape, truth.scale, truth.votes[:, 0])
    assert surface.shape == (4, 400, 3)
    nearest = torch.cdist(surface, batch.points).amin(dim=2) / batch.scale[:, None]
    assert nearest.max() < 0.25
    assert nearest.mean() < 0.06


def test_bodies_are_near_their_own_clouds_and_far_from_others(
    losses: BodyLosses, batch: BodyBatch, truth: BodyAnswer
) -> None:
    own = losses.similarity(truth, batch.points)
    others = losses.similarity(truth, batch.points.roll(1, dims=0))
    assert own < 0.5 * others


def test_edits_leave_the_root_and_most_joints_as_they_are() -> None:
    edits = draw_edits(50, torch.Generator().manual_seed(0))
    kept = torch.isclose(edits, torch.eye(3), atol=1e-6).all(dim=3).all(dim=2)
    assert kept[:, 0].all()
    assert 0.6 < kept[:, 1:].float().mean() < 0.73


def test_geodesic_distance_is_the_angle() -> None:
    for degrees in (0.5, 20.0, 90.0, 170.0):
        turn = Rotation.from_rotvec(np.radians(degrees) * np.array([0.6, 0.0, 0.8])).as_matrix()
        angle = geodesic_squared(torch.eye(3), torch.as_tensor(turn).float()).sqrt()
        assert np.degrees(angle.item()) == pytest.approx(degrees, rel=0.01)


def test_geodesic_distance_has_a_derivative_everywhere() -> None:
    for turn in (torch.eye(3), torch.diag(torch.tensor([1.0, -1.0, -1.0]))):
        rotation = turn.clone().requires_grad_()
        geodesic_squared(torch.eye(3), rotation).backward()
        assert rotation.grad is not None
        assert torch.isfinite(rotation.grad).all()
