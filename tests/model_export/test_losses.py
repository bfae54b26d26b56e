from __future__ import annotations

import numpy as np
import pytest
import torch
from torch import Tensor

from model_export.losses import Losses, Weights, draw_edit, total
from model_export.synthetic import Batch
from service.template.affine import AffineTemplate

ONLY = torch.zeros(4, dtype=torch.int64)
"""Four times the only variant."""


@pytest.fixture(scope="module")
def losses(chair: AffineTemplate) -> Losses:
    return Losses(chair, torch.linspace(0.05, 0.3, 11))


@pytest.fixture(scope="module")
def labels(chair: AffineTemplate) -> Tensor:
    """``[4, 11]`` parameters and translations."""
    rng = np.random.default_rng(0)
    f, t = rng.uniform(chair.low, chair.high, (4, 8)), rng.normal(0, 0.1, (4, 3))
    return torch.tensor(np.hstack([f, t]), dtype=torch.float32)


@pytest.fixture(scope="module")
def predicted(labels: Tensor) -> Tensor:
    return labels + 0.05 * torch.randn(4, 11, generator=torch.Generator().manual_seed(1))


def as_batch(labels: Tensor) -> Batch:
    return Batch(torch.zeros(4, 1, 3), labels[:, :8], labels[:, 8:], ONLY)


def test_torch_and_numpy_decode_alike(
    chair: AffineTemplate, losses: Losses, labels: Tensor
) -> None:
    decoded = losses.decode(labels).numpy()
    f, t = labels[:, :8].double().numpy(), labels[:, 8:].double().numpy()
    np.testing.assert_allclose(decoded, chair.decode(f) + t[:, None], atol=1e-6)


def test_the_semantic_loss_is_the_mean_square_in_deviations(
    losses: Losses, labels: Tensor, predicted: Tensor
) -> None:
    spread = np.linspace(0.05, 0.3, 11)
    squares = [
        ((float(predicted[i, j]) - float(labels[i, j])) / spread[j]) ** 2
        for i in range(4)
        for j in range(11)
    ]
    assert losses.semantic(predicted, labels, ONLY).item() == pytest.approx(
        np.mean(squares), rel=1e-5
    )
    assert losses.semantic(labels, labels, ONLY).item() == 0.0


def test_the_reconstruction_loss_is_the_mean_squared_vertex_distance(
    chair: AffineTemplate, losses: Losses, labels: Tensor, predicted: Tensor
) -> None:
    distances = []
    for p, t in zip(predicted.double().numpy(), labels.double().numpy(), strict=True):
        gap = chair.decode(p[:8]) + p[8:] - chair.decode(t[:8]) - t[8:]
        distances += [float(row @ row) for row in gap]
    assert losses.reconstruction(predicted, labels, ONLY).item() == pytest.approx(
        np.mean(distances), rel=1e-4
    )


def test_a_shared_addition_changes_neither_loss(
    losses: Losses, labels: Tensor, predicted: Tensor
) -> None:
    # Why the editing branch multiplies: an additive edit would train nothing new.
    added = torch.linspace(-0.2, 0.4, 11)
    for loss in (losses.semantic, losses.reconstruction):
        plain = loss(predicted, labels, ONLY).item()
        assert loss(predicted + added, labels + added, ONLY).item() == pytest.approx(
            plain, rel=1e-3
        )
        doubled = loss(predicted * 2, labels * 2, ONLY).item()
        assert doubled == pytest.approx(4 * plain, rel=1e-4)


def test_an_edit_multiplies_the_parameters_and_keeps_the_place(
    losses: Losses, labels: Tensor
) -> None:
    factors = torch.linspace(0.6, 1.6, 32).reshape(4, 8)
    edited = losses.edit(labels, factors)
    assert torch.equal(edited[:, :8], labels[:, :8] * factors)
    assert torch.equal(edited[:, 8:], labels[:, 8:])


def test_the_editing_branch_edits_prediction_and_truth_alike(
    losses: Losses, labels: Tensor, predicted: Tensor
) -> None:
    factors = draw_edit(4, 8, torch.Generator().manual_seed(2), "cpu")
    terms = losses.synthetic(predicted, as_batch(labels), factors)
    assert set(terms) == {"sem", "rec", "sem_edit", "rec_edit"}
    edited, target = predicted.clone(), labels.clone()
    edited[:, :8] *= factors
    target[:, :8] *= factors
    assert torch.equal(terms["sem"], losses.semantic(predicted, labels, ONLY))
    assert torch.equal(terms["rec"], losses.reconstruction(predicted, labels, ONLY))
    assert torch.allclose(terms["sem_edit"], losses.semantic(edited, target, ONLY))
    assert torch.allclose(terms["rec_edit"], losses.reconstruction(edited, target, ONLY))
    assert set(losses.synthetic(predicted, as_batch(labels), None)) == {"sem", "rec"}


def test_a_parameter_that_is_set_can_not_be_off(
    chair: AffineTemplate, labels: Tensor, predicted: Tensor
) -> None:
    own = Losses(chair, torch.ones(11), edit="set")
    factors = draw_edit(4, 8, torch.Generator().manual_seed(2), "cpu")
    guess = predicted.clone().requires_grad_()
    edited, target = own.branch(guess, as_batch(labels), factors, None)
    assert torch.equal(target, own.edit(labels, factors))
    changed = torch.cat([factors != 1.0, torch.zeros(4, 3, dtype=torch.bool)], dim=1)
    assert torch.equal(edited[changed], target[changed])
    assert torch.equal(edited[~changed], predicted[~changed])
    own.semantic(edited, target, ONLY).backward()
    assert guess.grad is not None
    assert torch.equal(guess.grad != 0.0, ~changed)


def test_a_setting_edit_keeps_the_odds_of_the_variants(kinds: AffineTemplate) -> None:
    own = Losses(kinds, torch.ones(8), edit="set")
    labels = torch.tensor([[1.0, 0.1, 0.8]])
    batch = Batch(torch.zeros(1, 1, 3), labels, torch.zeros(1, 3), torch.tensor([0]))
    predicted = torch.tensor([[1.1, 0.2, 0.9, 0.1, 0.2, 0.3, 2.0, 5.0]])
    edited, _ = own.branch(predicted, batch, torch.tensor([[1.5, 1.0, 1.0]]), None)
    expected = torch.tensor([[1.5, 0.2, 0.9, 0.1, 0.2, 0.3, 2.0, 5.0]])
    assert torch.equal(edited, expected)


def test_a_cycle_encodes_the_edited_prediction_and_asks_for_the_edited_truth(
    chair: AffineTemplate, labels: Tensor, predicted: Tensor
) -> None:
    own = Losses(chair, torch.ones(11), edit="cycle")
    factors = draw_edit(4, 8, torch.Generator().manual_seed(2), "cpu")
    guess = predicted.clone().requires_grad_()
    batch = Batch(torch.zeros(4, 500, 3), labels[:, :8], labels[:, 8:], ONLY)
    seen: list[Tensor] = []

    def encode(clouds: Tensor) -> Tensor:
        seen.append(clouds)
        return torch.cat([clouds.amax(dim=1)] * 4, dim=1)[:, :11]

    again, target = own.branch(guess, batch, factors, encode)
    (clouds,) = seen
    assert clouds.shape == (4, 500, 3)
    np.testing.assert_allclose(clouds.detach().mean(dim=1), 0.0, atol=1e-6)
    np.testing.assert_allclose(clouds.detach().norm(dim=2).amax(dim=1), 0.6, rtol=1e-5)
    # The truth edited, in the frame of the cloud: its lengths in proportion.
    ratio = (target[:, :8] / (labels[:, :8] * factors)).numpy()
    np.testing.assert_allclose(ratio, np.broadcast_to(ratio[:, :1], ratio.shape), rtol=1e-5)
    assert not target.requires_grad
    own.semantic(again, target, ONLY).backward()
    assert guess.grad is not None
    assert guess.grad.abs().sum() > 0


def test_a_perfect_prediction_is_asked_in_a_cycle_for_what_its_cloud_shows(
    chair: AffineTemplate, labels: Tensor
) -> None:
    own = Losses(chair, torch.ones(11), edit="cycle")
    factors = draw_edit(4, 8, torch.Generator().manual_seed(2), "cpu")
    batch = Batch(torch.zeros(4, 4000, 3), labels[:, :8], labels[:, 8:], ONLY)
    clouds: list[Tensor] = []
    _, target = own.branch(labels, batch, factors, lambda c: (clouds.append(c), labels)[1])
    low, high = clouds[0].amin(dim=1), clouds[0].amax(dim=1)
    vertices = own.decode(target)
    np.testing.assert_allclose(low, vertices.amin(dim=1), atol=0.03)
    np.testing.assert_allclose(high, vertices.amax(dim=1), atol=0.03)


def test_the_semantic_loss_may_be_of_absolute_values(
    chair: AffineTemplate, labels: Tensor, predicted: Tensor
) -> None:
    own = Losses(chair, torch.full((11,), 0.1), norm="l1")
    expected = (predicted - labels).abs().mean() / 0.1
    assert own.semantic(predicted, labels, ONLY).item() == pytest.approx(expected.item(), rel=1e-5)


def test_edits_are_log_uniform_factors_on_a_random_subset() -> None:
    factors = draw_edit(4000, 8, torch.Generator().manual_seed(3), "cpu")
    assert factors.shape == (4000, 8)
    assert 0.599 < factors.min() < 0.605
    assert 1.66 < factors.max() <= 1.67
    edited = factors != 1.0
    assert edited.any(dim=1).all()
    # One for sure, the other seven by the toss of a coin, in each column alike.
    assert edited.double().sum(dim=1).mean().item() == pytest.approx(1 + 7 / 2, abs=0.1)
    np.testing.assert_allclose(edited.double().mean(dim=0), 4.5 / 8, atol=0.04)
    log = torch.log(factors[edited])
    np.testing.assert_allclose(np.quantile(log, [0.25, 0.5, 0.75]), [-0.256, 0, 0.256], atol=0.02)


def test_edits_repeat_with_the_seed() -> None:
    first, again, other = (
        draw_edit(5, 8, torch.Generator().manual_seed(seed), "cpu") for seed in (1, 1, 2)
    )
    assert torch.equal(first, again)
    assert not torch.equal(first, other)


def test_the_similarity_loss_is_the_two_way_squared_chamfer(losses: Losses, labels: Tensor) -> None:
    clouds = 0.5 * torch.randn(4, 60, 3, generator=torch.Generator().manual_seed(4))
    torch.manual_seed(5)
    samples = losses._sample(losses.decode(labels), 40)[0].double().numpy()
    torch.manual_seed(5)
    value = losses.similarity(labels, clouds, points=40).item()
    there, back = [], []
    for a, b in zip(samples, clouds[:, :40].double().numpy(), strict=True):
        squared = np.square(a[:, None] - b[None]).sum(axis=2)
        there.append(squared.min(axis=1).mean())
        back.append(squared.min(axis=0).mean())
    assert value == pytest.approx(np.mean(there) + np.mean(back), rel=1e-4)


def test_template_samples_lie_on_its_visible_faces_by_area(
    chair: AffineTemplate, losses: Losses
) -> None:
    f = torch.tensor([[0.4, 0.04, 0.06, 0.45, 0.48, 0.4, 0.16, 0.16, 0.1, 0.2, 0.3]])
    torch.manual_seed(6)
    vertices = losses.decode(f)
    samples = losses._sample(vertices, 20_000)[0][0].double().numpy()
    low, high = vertices[0].numpy().min(axis=0), vertices[0].numpy().max(axis=0)
    assert (samples >= low - 1e-6).all()
    assert (samples <= high + 1e-6).all()
    # Each leg's four sides, without its hidden top: their share of the visible area.
    areas = chair.face_areas(chair.decode(f[0, :8].double().numpy()))
    visible = np.where(chair.hidden, 0.0, areas)
    leg = chair.part[chair.faces[:, 0]] >= 2
    below = samples[:, 1] < 0.2 - 0.03 - 1e-5
    assert below.mean() == pytest.approx(visible[leg].sum() / visible.sum(), abs=0.01)
    at_top = np.isclose(samples[:, 1], 0.2 - 0.03, atol=1e-6).mean()
    assert at_top == pytest.approx(0.48 * 0.45 / visible.sum(), abs=0.01)


def test_the_similarity_loss_pulls_towards_the_cloud(losses: Losses, labels: Tensor) -> None:
    torch.manual_seed(7)
    clouds = losses._sample(losses.decode(labels), 400)[0]
    shifted = labels.clone()
    shifted[:, 8] += 0.2
    shifted.requires_grad_()
    loss = losses.similarity(shifted, clouds, points=300)
    loss.backward()
    assert shifted.grad is not None
    assert (shifted.grad[:, 8] > 0).all()
    assert loss.item() > 2 * losses.similarity(labels, clouds, points=300).item()


def test_the_objective_weighs_its_terms() -> None:
    terms = {
        name: torch.tensor(value)
        for name, value in {
            "sem": 1.0, "sem_edit": 10.0, "rec": 100.0, "rec_edit": 1e3, "sim": 1e4, "variant": 1e5
        }.items()
    }  # fmt: skip
    weighed = 0.3 * 11 + 30 * 1100 + 50 * 1e4 + 0.1 * 1e5
    assert total(terms, Weights()).item() == pytest.approx(weighed)
    assert total(terms, Weights(1.0, 0.0, 0.0, 0.0)).item() == pytest.approx(11)
    assert total({"sem": torch.tensor(2.0)}, Weights()).item() == pytest.approx(0.6)
    with pytest.raises(KeyError):
        total({"other": torch.tensor(2.0)}, Weights())


def test_what_a_variant_lacks_does_not_count(kinds: AffineTemplate) -> None:
    own = Losses(kinds, torch.ones(8))
    true = torch.tensor([[1.0, 0.1, 0.8, 0.0, 0.0, 0.0]]).expand(2, -1)
    predicted = true.clone()
    predicted[:, 2] += 0.3
    high, low = torch.tensor([0, 1])
    for loss in (own.semantic, own.reconstruction):
        assert loss(predicted[:1], true[:1], high[None]).item() > 1e-3
        assert loss(predicted[1:], true[1:], low[None]).item() == 0.0
    assert own.semantic(predicted[:1], true[:1], high[None]).item() == pytest.approx(0.09 / 6)
    predicted[:, 0] += 0.3
    assert own.semantic(predicted[1:], true[1:], low[None]).item() == pytest.approx(0.09 / 5)
    slab = kinds.variants[1]
    shift = slab.jacobian @ np.array([0.3, 0.0, 0.0])
    assert own.reconstruction(predicted[1:], true[1:], low[None]).item() == pytest.approx(
        np.square(shift).sum(axis=1).mean(), rel=1e-4
    )


def test_variants_are_told_apart_by_cross_entropy(kinds: AffineTemplate) -> None:
    own = Losses(kinds, torch.ones(8))
    labels = torch.tensor([[1.0, 0.1, 0.8], [1.0, 0.1, 0.8]])
    batch = Batch(torch.zeros(2, 1, 3), labels, torch.zeros(2, 3), torch.tensor([0, 1]))
    odds = torch.tensor([[2.0, 0.0], [2.0, 0.0]])
    predicted = torch.cat([batch.labels, odds], dim=1)
    value = own.synthetic(predicted, batch, None)["variant"].item()
    right, wrong = np.log1p(np.exp(-2.0)), np.log1p(np.exp(2.0))
    assert value == pytest.approx((right + wrong) / 2, rel=1e-5)


def test_a_real_shape_is_compared_with_the_variant_that_is_likely_and_fits(
    kinds: AffineTemplate,
) -> None:
    own = Losses(kinds, torch.ones(8))
    label = torch.tensor([[1.0, 0.1, 0.8, 0.0, 0.0, 0.0]])
    samples, has = own._sample(own.decode(label), 4000)
    slab = samples[0][has[0, 1]][None]
    slab = slab[:, torch.randperm(slab.shape[1], generator=torch.Generator().manual_seed(1))]

    def value(odds: list[float]) -> float:
        torch.manual_seed(8)
        return own.similarity(torch.cat([label, torch.tensor([odds])], dim=1), slab).item()

    # A slab alone is no slab on a post, unless that were quite certain.
    assert value([0.0, 0.0]) == value([-5.0, 5.0]) < 0.01
    assert value([50.0, -50.0]) > 10 * value([0.0, 0.0])
