from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch
from plain_chair import PLAIN

from model_export.synthetic import Augmentation, Batch, SyntheticShapes
from service.template.affine import AffineTemplate
from service.template.loader import load_template

CLEAN = Augmentation.none()


def off_surface(template: AffineTemplate, batch: Batch) -> np.ndarray:
    """``[B, n]`` distances from the points to the nearest box surface of the labelled shapes."""
    rows = []
    for points, f, t in zip(batch.points, batch.parameters, batch.translation, strict=True):
        frames = template.frames(f.double().numpy())
        half = np.diagonal(frames[:, :, :3], axis1=1, axis2=2) / 2
        local = np.abs((points - t).double().numpy()[:, None] - frames[None, :, :, 3])
        beyond = local - np.abs(half)
        outside = np.linalg.norm(np.maximum(beyond, 0), axis=2)
        inside = np.minimum(beyond.max(axis=2), 0)
        rows.append(np.abs(outside + inside).min(axis=1))
    return np.stack(rows)


def only(count: int) -> torch.Tensor:
    """The only variant, for so many shapes."""
    return torch.zeros(count, dtype=torch.int64)


def plain_chairs(chair: AffineTemplate, count: int) -> torch.Tensor:
    row = [PLAIN[name] for name in chair.names]
    return torch.tensor([row] * count, dtype=torch.float32)


def test_draws_are_in_range_and_keep_the_relations(chair: AffineTemplate) -> None:
    f = SyntheticShapes(chair, CLEAN, seed=1, log_share=0.5).draw_parameters(3000)
    assert f.shape == (3000, 8)
    assert (f >= chair.low).all()
    assert (f <= chair.high).all()
    assert (f @ chair.relations[:, 1:].T + chair.relations[:, 0] >= 0).all()


def test_draws_that_break_a_relation_are_drawn_anew(chair: AffineTemplate) -> None:
    narrow = chair.relations[0].copy()
    narrow[0] = -0.55
    strict = replace(chair, relations=np.array([narrow]))
    f = SyntheticShapes(strict, CLEAN, seed=1).draw_parameters(500)
    width, leg = f[:, chair.names.index("seat_width")], f[:, chair.names.index("leg_width")]
    assert len(f) == 500
    assert (width - 2 * leg >= 0.55).all()


def test_draws_fill_the_ranges_evenly_or_evenly_in_the_logarithm(stand: AffineTemplate) -> None:
    free = replace(stand, relations=np.zeros((0, 4)))
    even = SyntheticShapes(free, CLEAN, seed=2).draw_parameters(4000)
    logs = SyntheticShapes(free, CLEAN, seed=2, log_share=1.0).draw_parameters(4000)
    half = SyntheticShapes(free, CLEAN, seed=2, log_share=0.5).draw_parameters(4000)
    middle, geometric = (free.low + free.high) / 2, np.sqrt(free.low * free.high)
    np.testing.assert_allclose(np.median(even, axis=0), middle, rtol=0.04)
    np.testing.assert_allclose(np.median(logs, axis=0), geometric, rtol=0.04)
    below = (half < geometric).mean(axis=0)
    expected = 0.5 * (0.5 + (geometric - free.low) / (free.high - free.low))
    np.testing.assert_allclose(below, expected, atol=0.03)


def test_signed_offsets_are_drawn_evenly_always(stand: AffineTemplate) -> None:
    slab, *others = stand.parameters
    signed = replace(slab, low=-0.5, nuisance=True)
    free = replace(stand, relations=np.zeros((0, 4)), parameters=(signed, *others))
    logs = SyntheticShapes(free, CLEAN, seed=2, log_share=1.0).draw_parameters(4000)
    quarters = np.quantile(logs[:, 0], [0.25, 0.5, 0.75])
    np.testing.assert_allclose(quarters, [0.0, 0.5, 1.0], atol=0.05)
    np.testing.assert_allclose(np.median(logs[:, 1]), 0.1, rtol=0.04)


def test_airplanes_are_drawn_in_range_and_whole() -> None:
    airplane = load_template("airplane")
    shapes = SyntheticShapes(airplane, CLEAN, seed=1, log_share=0.25)
    f = shapes.draw_parameters(500)
    assert ((f >= airplane.low) & (f <= airplane.high)).all()
    assert (f @ airplane.relations[:, 1:].T >= 0).all()
    offsets = airplane.low < 0
    assert (f[:, offsets].min(axis=0) < 0).all()
    batch = shapes.batch(4, 200)
    assert torch.isfinite(batch.points).all()


def test_the_seed_decides_everything(chair: AffineTemplate) -> None:
    settings = Augmentation(clutter=0.3)
    first, again, other = (SyntheticShapes(chair, settings, seed, 0.25) for seed in (7, 7, 8))
    for _ in range(2):
        a, b, c = (shapes.batch(3, 100) for shapes in (first, again, other))
        for name in ("points", "parameters", "translation"):
            assert torch.equal(getattr(a, name), getattr(b, name))
            assert not torch.equal(getattr(a, name), getattr(c, name))


def test_global_randomness_is_left_alone(chair: AffineTemplate) -> None:
    torch.manual_seed(0)
    before = torch.get_rng_state()
    SyntheticShapes(chair, Augmentation(clutter=0.3), 3, 0.5).batch(2, 50)
    assert torch.equal(before, torch.get_rng_state())


@pytest.mark.parametrize("settings", [CLEAN, Augmentation(), Augmentation(clutter=0.5)])
def test_clouds_are_normalised(chair: AffineTemplate, settings: Augmentation) -> None:
    batch = SyntheticShapes(chair, settings, seed=3).batch(6, 400)
    assert batch.points.shape == (6, 400, 3)
    assert (batch.parameters.shape, batch.translation.shape) == ((6, 8), (6, 3))
    assert batch.points.mean(dim=1).abs().max() < 1e-6
    np.testing.assert_allclose(batch.points.norm(dim=2).amax(dim=1), 0.6, rtol=1e-5)


def test_clean_clouds_lie_on_the_shapes_that_their_labels_say(chair: AffineTemplate) -> None:
    batch = SyntheticShapes(chair, CLEAN, seed=4, log_share=0.5).batch(12, 500)
    assert off_surface(chair, batch).max() < 2e-6


def test_labels_are_the_drawn_lengths_times_one_scale(chair: AffineTemplate) -> None:
    f = plain_chairs(chair, 2)
    batch = SyntheticShapes(chair, CLEAN, seed=4).sample(f, only(len(f)), 300)
    ratio = batch.parameters / f
    np.testing.assert_allclose(ratio, ratio[:, :1].expand(-1, 8), rtol=1e-5)


def test_clean_clouds_share_their_points_by_area(stand: AffineTemplate) -> None:
    f = torch.tensor([[1.0, 0.1, 0.8]])
    batch = SyntheticShapes(stand, CLEAN, seed=5).sample(f, only(len(f)), 20_000)
    bottom = -0.05 * batch.parameters[0, 0]
    below = (batch.points[0] - batch.translation[0])[:, 1] < bottom - 1e-4
    slab, post = 2 * 1 + 4 * 0.1, 4 * 0.25 * 0.8
    assert below.double().mean().item() == pytest.approx(post / (slab + post), abs=0.01)


def on_hidden_bottom(stand: AffineTemplate, settings: Augmentation) -> np.ndarray:
    """For each of 40 stands, whether the hidden bottom of its post has points."""
    f = torch.tensor([[1.5, 0.1, 0.3]] * 40)
    batch = SyntheticShapes(stand, settings, seed=6).sample(f, only(len(f)), 800)
    floor = batch.translation[:, 1] - batch.parameters[:, 1] / 2 - batch.parameters[:, 2]
    return (batch.points[:, :, 1] <= floor[:, None] + 1e-5).any(dim=1).numpy()


def test_hidden_faces_are_sampled_as_often_as_asked(stand: AffineTemplate) -> None:
    assert not on_hidden_bottom(stand, CLEAN).any()
    assert on_hidden_bottom(stand, replace(CLEAN, hidden=1.0)).all()
    assert 8 <= on_hidden_bottom(stand, replace(CLEAN, hidden=0.5)).sum() <= 32


def post_share(stand: AffineTemplate, settings: Augmentation) -> np.ndarray:
    """``[60]`` share of the points of like stands that lie on the post."""
    f = torch.tensor([[1.0, 0.1, 0.8]] * 60)
    batch = SyntheticShapes(stand, settings, seed=7).sample(f, only(len(f)), 400)
    bottom = batch.translation[:, 1] - batch.parameters[:, 1] / 2
    return (batch.points[:, :, 1] < bottom[:, None] - 1e-4).double().mean(dim=1).numpy()


def test_parts_go_missing_as_often_as_asked(stand: AffineTemplate) -> None:
    assert (post_share(stand, CLEAN) > 0.1).all()
    share = post_share(stand, replace(CLEAN, drop_part=0.5))
    # The post alone is gone in a quarter of the draws, the slab alone in another.
    assert 5 <= (share == 0).sum() <= 27
    assert 5 <= (share > 0.99).sum() <= 27


def test_parts_are_sampled_unevenly(stand: AffineTemplate) -> None:
    even, uneven = post_share(stand, CLEAN), post_share(stand, replace(CLEAN, uneven=0.8))
    assert even.std() < 0.03
    odds = np.log(uneven / (1 - uneven))
    # The log odds differ by two normal draws of standard deviation 0.8.
    assert odds.std() == pytest.approx(0.8 * np.sqrt(2), rel=0.35)


def test_variants_are_drawn_alike_often_and_lack_what_they_lack(kinds: AffineTemplate) -> None:
    shapes = SyntheticShapes(kinds, CLEAN, seed=7)
    batch = shapes.batch(200, 60)
    assert 70 <= int(batch.variant.sum()) <= 130
    below = (batch.points - batch.translation[:, None])[..., 1] < -0.6 * batch.parameters[:, 1:2]
    assert torch.equal(below.any(dim=1), batch.variant == 0)
    assert torch.equal(SyntheticShapes(kinds, CLEAN, seed=7).batch(200, 60).variant, batch.variant)


def test_noise_stays_below_its_level(chair: AffineTemplate) -> None:
    batch = SyntheticShapes(chair, replace(CLEAN, noise=0.02), seed=8).sample(
        plain_chairs(chair, 30), only(30), 600
    )
    clean = SyntheticShapes(chair, CLEAN, seed=8).sample(plain_chairs(chair, 30), only(30), 600)
    gap = np.sqrt(np.square(off_surface(chair, batch)).mean(axis=1))
    assert off_surface(chair, clean).max() < 2e-6
    # One direction of three leads off a surface; 0.6 is the radius.
    assert gap.max() < 0.02 * 0.6 * 1.1
    assert gap.max() > 0.02 * 0.6 * 0.4
    assert gap.min() < 0.2 * gap.max()


def test_clutter_moves_some_points_off_some_shapes(chair: AffineTemplate) -> None:
    settings = replace(CLEAN, clutter=0.5)
    batch = SyntheticShapes(chair, settings, seed=9).sample(plain_chairs(chair, 60), only(60), 500)
    off = (off_surface(chair, batch) > 1e-4).mean(axis=1)
    assert 15 <= (off == 0).sum() <= 45
    assert 0.3 < off.max() < 0.57
    vertices = chair.decode(batch.parameters.double().numpy())
    vertices += batch.translation.double().numpy()[:, None]
    points = batch.points.double().numpy()
    assert (points.min(axis=1) >= vertices.min(axis=1) - 1e-5).all()
    assert (points.max(axis=1) <= vertices.max(axis=1) + 1e-5).all()


def test_clutter_is_as_symmetric_as_the_shapes(chair: AffineTemplate) -> None:
    settings = replace(CLEAN, clutter=1.0)
    batch = SyntheticShapes(chair, settings, seed=10).sample(
        plain_chairs(chair, 40), only(40), 2000
    )
    where = (batch.points - batch.translation[:, None]).double().numpy()
    for points, off in zip(where, off_surface(chair, batch) > 0.02, strict=True):
        left = (points[off, 0] > 0.02).sum()
        right = (points[off, 0] < -0.02).sum()
        assert abs(left - right) <= 6 * np.sqrt(left + right + 1)
