from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from service.encode.discriminator import Discriminator
from service.errors import ModelFault
from service.mesh.frame import CANONICAL, Orientation, orientations


@pytest.fixture
def discriminator(tmp_path: Path, write_discriminator: Any) -> Discriminator:
    return Discriminator(write_discriminator(tmp_path / "any.onnx"))


def tall(count: int) -> np.ndarray:
    """Points along an axis that rises from (5, 5, 5), twice as dense at the lower end."""
    height = np.linspace(0.0, 1.0, count) ** 2
    return np.array([5.0, 5.0, 5.0]) + height[:, None] * np.array([0.0, 3.0, 0.0])


def test_each_orientation_is_judged_by_the_cloud_seen_from_there(
    discriminator: Discriminator,
) -> None:
    ways = [CANONICAL, Orientation("-y", "+z"), Orientation("+x", "+y")]
    upright, upside_down, lying = discriminator.odds(tall(90), ways)
    # The upper end of the normalised cloud lies at 0.6, the lower end, where most are, nearer.
    assert upright == pytest.approx(10 * 0.6 - 2, abs=1e-3)
    assert -2 < upside_down < upright - 2
    assert lying == pytest.approx(-2, abs=1e-3)


@pytest.mark.parametrize("count", [30, 31, 90, 3000])
def test_clouds_of_any_size_place_and_scale_will_do(
    discriminator: Discriminator, count: int
) -> None:
    cloud = tall(count)
    first = discriminator.odds(cloud, orientations())
    assert first.shape == (24,)
    np.testing.assert_allclose(
        first, discriminator.odds(7.0 * cloud + 2.0, orientations()), atol=1e-4
    )


def test_orientations_are_judged_alone(discriminator: Discriminator) -> None:
    cloud = np.random.default_rng(0).normal(size=(200, 3))
    together = discriminator.odds(cloud, orientations())
    for way, odds in zip(orientations(), together, strict=True):
        np.testing.assert_allclose(discriminator.odds(cloud, [way]), [odds], atol=1e-5)


def test_a_file_that_is_no_network_is_refused(tmp_path: Path) -> None:
    (tmp_path / "any.onnx").write_bytes(b"nothing")
    with pytest.raises(ModelFault) as caught:
        Discriminator(tmp_path / "any.onnx")
    assert caught.value.code == "model_unreadable"


def test_a_network_that_takes_one_cloud_at_a_time_is_refused(
    tmp_path: Path, write_network: Any
) -> None:
    with pytest.raises(ModelFault) as caught:
        Discriminator(write_network(tmp_path / "any.onnx", [0.0], (1, 50, 3)))
    assert caught.value.code == "model_shape"
