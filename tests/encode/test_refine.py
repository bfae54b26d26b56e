from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from service.encode.distance import Cloud
from service.encode.model import SMALLEST
from service.encode.refine import STANDARD, Settings, refine
from service.mesh.surface import Normalization, sample_surface
from service.template.affine import AffineTemplate
from service.template.loader import load_template


def ordinary(chair: AffineTemplate, seed: int) -> np.ndarray:
    """``[8]`` a chair drawn from what is typical."""
    low, high = np.array([p.typical for p in chair.parameters]).T
    rng = np.random.default_rng(seed)
    while True:
        f = rng.uniform(low, high)
        if (chair.relations @ [1.0, *f] >= 0).all():
            return f


@pytest.mark.parametrize("seed", range(6))
def test_it_recovers_parameters_that_start_a_tenth_off(
    chair: AffineTemplate, labelled: Any, seed: int
) -> None:
    cloud, f, t = labelled(ordinary(chair, seed), noise=0.003, seed=seed)
    rng = np.random.default_rng(seed)
    start = f * (1 + 0.1 * rng.choice([-1, 1], 8)), t + 0.02 * rng.standard_normal(3)
    fit = refine(chair, *start, cloud)
    assert fit.parameters.shape == fit.sigma.shape == (8,)
    # About a hundredth of the radius; the start is off by up to a tenth.
    np.testing.assert_allclose(fit.parameters, f, atol=0.007)
    np.testing.assert_allclose(fit.translation, t, atol=0.006)
    # It encloses noise, which makes sizes larger by about its spread.
    assert np.abs(fit.parameters - f).mean() < 0.2 * np.abs(start[0] - f).mean()


def test_a_true_start_stays(chair: AffineTemplate, plain: np.ndarray, labelled: Any) -> None:
    cloud, f, t = labelled(plain)
    fit = refine(chair, f, t, cloud)
    np.testing.assert_allclose(fit.parameters, f, atol=0.002)
    np.testing.assert_allclose(fit.translation, t, atol=0.002)


def test_a_mirrored_cloud_has_a_mirrored_fit(
    chair: AffineTemplate, plain: np.ndarray, labelled: Any
) -> None:
    cloud, f, t = labelled(plain, noise=0.003)
    mirror = np.array([-1.0, 1.0, 1.0])
    mirrored = Cloud(cloud.points * mirror, cloud.normals * mirror)
    start = f * 1.08, t + np.array([0.03, 0.01, -0.01])
    fit = refine(chair, *start, cloud)
    other = refine(chair, start[0], start[1] * mirror, mirrored)
    np.testing.assert_allclose(other.parameters, fit.parameters, atol=0.003)
    np.testing.assert_allclose(other.translation, fit.translation * mirror, atol=0.003)


def test_a_shifted_cloud_has_a_shifted_fit(
    chair: AffineTemplate, plain: np.ndarray, labelled: Any
) -> None:
    cloud, f, t = labelled(plain, noise=0.003)
    shift = np.array([0.4, -0.3, 0.2])
    fit = refine(chair, 1.05 * f, t, cloud)
    other = refine(chair, 1.05 * f, t + shift, Cloud(cloud.points + shift, cloud.normals))
    np.testing.assert_allclose(other.parameters, fit.parameters, atol=1e-5)
    np.testing.assert_allclose(other.translation, fit.translation + shift, atol=1e-5)


def test_it_is_the_same_each_time(chair: AffineTemplate, plain: np.ndarray, labelled: Any) -> None:
    cloud, f, t = labelled(plain, noise=0.01)
    first, again = (refine(chair, 1.1 * f, t, cloud) for _ in range(2))
    assert np.array_equal(first.parameters, again.parameters)
    assert np.array_equal(first.sigma, again.sigma)


@pytest.mark.parametrize("seed", range(4))
def test_sizes_stay_positive_whatever_the_cloud(chair: AffineTemplate, seed: int) -> None:
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(300, 3)) * [0.3, 1e-3, 0.3] if seed else rng.normal(size=(300, 3))
    normals = rng.normal(size=(300, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    start = np.full(8, 0.3) if seed < 2 else np.full(8, SMALLEST)
    fit = refine(chair, start, np.zeros(3), Cloud(points, normals))
    assert (fit.parameters >= SMALLEST).all()
    assert np.isfinite(fit.parameters).all()
    assert np.isfinite(fit.translation).all()
    assert np.isfinite(fit.sigma).all()
    assert (fit.sigma > 0).all()


def test_fits_keep_the_relations_of_the_template(
    chair: AffineTemplate, plain: np.ndarray, labelled: Any
) -> None:
    # Legs so thick that they meet: four of them look like one block.
    block = plain.copy()
    block[chair.names.index("leg_width")] = 0.5 * block[chair.names.index("seat_width")]
    block[chair.names.index("leg_depth")] = 0.5 * block[chair.names.index("seat_depth")]
    assert chair.broken_relations(block)
    cloud, f, t = labelled(block)
    fit = refine(chair, f, t, cloud)
    assert (chair.relations @ [1.0, *fit.parameters] > -1e-6).all()
    width = chair.names.index("seat_width")
    assert fit.parameters[width] == pytest.approx(f[width], abs=0.02)


def test_signed_offsets_are_fitted_below_zero() -> None:
    template = load_template("airplane")
    names = template.names
    f = (template.low + template.high) / 2
    f[names.index("wing_sweep")], f[names.index("wing_height")] = -0.05, -0.03
    f[names.index("wing_dihedral")] = -0.02
    visible = template.faces[~template.hidden]
    samples = sample_surface(template.decode(f), visible, 2750, np.random.default_rng(0))
    normalization = Normalization.of(samples.points)
    cloud = Cloud(normalization.apply(samples.points), samples.normals)
    true, t = f * normalization.scale, -normalization.center * normalization.scale
    start = true + np.where(template.signed, 0.03, 0.0)
    fit = refine(template, start, t, cloud)
    offsets = ["wing_sweep", "wing_height", "wing_dihedral"]
    index = [names.index(name) for name in offsets]
    assert (fit.parameters[index] < 0).all()
    np.testing.assert_allclose(fit.parameters[index], true[index], atol=0.01)


def test_a_chair_with_all_its_points_on_one_side_is_no_fault(
    chair: AffineTemplate, plain: np.ndarray, labelled: Any
) -> None:
    cloud, f, t = labelled(plain)
    kept = cloud.points[:, 0] > 0
    fit = refine(chair, f, t, Cloud(cloud.points[kept], cloud.normals[kept]))
    assert np.isfinite(fit.parameters).all()
    index = chair.names.index("seat_thickness")
    assert fit.parameters[index] == pytest.approx(f[index], abs=0.01)


def test_sigma_is_larger_for_worse_data(
    chair: AffineTemplate, plain: np.ndarray, labelled: Any
) -> None:
    fits = []
    for noise in (0.0, 0.015, 0.03, 0.06):
        cloud, f, t = labelled(plain, noise=noise)
        fits.append(refine(chair, f, t, cloud))
    sigma = np.array([fit.sigma for fit in fits])
    assert (sigma > 0).all()
    assert (np.diff(sigma.mean(axis=1)) > 0).all()
    assert (sigma[3] > 1.5 * sigma[0]).all()
    residuals = [fit.residual for fit in fits]
    assert (np.diff(residuals) > 0).all()


def test_sigma_is_larger_for_what_the_data_does_not_show(
    chair: AffineTemplate, plain: np.ndarray, labelled: Any
) -> None:
    cloud, f, t = labelled(plain, noise=0.005)
    below = cloud.points[:, 1] < t[1] - f[chair.names.index("seat_thickness")] / 2 - 0.02
    cut = refine(chair, f, t, Cloud(cloud.points[~below], cloud.normals[~below]))
    whole = refine(chair, f, t, cloud)
    growth = dict(zip(chair.names, cut.sigma / whole.sigma, strict=True))
    legs = min(growth[name] for name in ("leg_height", "leg_depth", "leg_width"))
    assert legs > 1.1 * max(growth["back_height"], growth["back_thickness"])


def test_stray_points_hardly_matter(
    chair: AffineTemplate, plain: np.ndarray, labelled: Any
) -> None:
    cloud, f, t = labelled(plain)
    rng = np.random.default_rng(0)
    stray = rng.uniform(0.5, 0.9, (280, 3)) * rng.choice([-1, 1], (280, 3))
    normals = np.tile([0.0, 0.0, 1.0], (280, 1))
    both = Cloud(np.concatenate([cloud.points, stray]), np.concatenate([cloud.normals, normals]))
    fit = refine(chair, 1.05 * f, t, both)
    np.testing.assert_allclose(fit.parameters, f, atol=0.006)


def test_thin_seats_keep_their_two_sides_apart(
    chair: AffineTemplate, plain: np.ndarray, labelled: Any
) -> None:
    thin = plain.copy()
    index = chair.names.index("seat_thickness")
    thin[index] = 0.015
    cloud, f, t = labelled(thin)
    start = f.copy()
    start[index] *= 2.5
    assert refine(chair, start, t, cloud).parameters[index] == pytest.approx(f[index], abs=0.002)


def test_more_steps_fit_better_and_none_change_nothing(
    chair: AffineTemplate, plain: np.ndarray, labelled: Any
) -> None:
    cloud, f, t = labelled(plain)
    start = 1.15 * f, t + 0.03
    still = refine(chair, *start, cloud, replace(STANDARD, iterations=0))
    np.testing.assert_array_equal(still.parameters, start[0])
    np.testing.assert_array_equal(still.translation, start[1])
    errors = [
        np.abs(refine(chair, *start, cloud, Settings(iterations=n)).parameters - f).max()
        for n in (1, 4, 20)
    ]
    assert errors[0] > errors[1] > errors[2]


def test_a_strong_pull_holds_the_start(
    chair: AffineTemplate, plain: np.ndarray, labelled: Any
) -> None:
    cloud, f, t = labelled(plain)
    held = refine(chair, 1.1 * f, t, cloud, Settings(pull=10.0))
    np.testing.assert_allclose(held.parameters, 1.1 * f, atol=1e-3)


def test_a_rough_beginning_ends_where_a_whole_one_does(
    chair: AffineTemplate, plain: np.ndarray, labelled: Any
) -> None:
    cloud, f, t = labelled(plain, noise=0.002)
    start = 1.08 * f, t + 0.02
    whole = refine(chair, *start, cloud, Settings(rough=0))
    swift = refine(chair, *start, cloud)
    np.testing.assert_allclose(swift.parameters, whole.parameters, atol=0.003)
    assert not np.array_equal(swift.parameters, whole.parameters)
    all_rough = refine(chair, *start, cloud, Settings(rough=20))
    np.testing.assert_allclose(all_rough.parameters, whole.parameters, atol=0.01)
