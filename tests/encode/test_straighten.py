from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from service.encode.straighten import LEAST, leans, mirror_lean, resting_lean
from service.mesh.surface import Normalization, Samples

ANGLES = [(9, 0, 0), (0, 0, -7), (6, 0, 8), (-12, 0, 3)]
TURNS = [(0, 8, 0), (0, -12, 0), (0, 6, 0)]


@pytest.fixture(scope="module")
def upright(chair_samples: Samples) -> np.ndarray:
    return Normalization.of(chair_samples.points).apply(chair_samples.points)


def leaning(points: np.ndarray, degrees: tuple[float, float, float]) -> np.ndarray:
    return points @ Rotation.from_euler("xyz", degrees, degrees=True).as_matrix().T


def left(degrees: tuple[float, float, float], lean: np.ndarray) -> float:
    """Degrees that a lean leaves of a turn."""
    turn = Rotation.from_euler("xyz", degrees, degrees=True)
    return float(np.degrees((Rotation.from_rotvec(lean) * turn).magnitude()))


def test_an_upright_chair_is_left_alone(upright: np.ndarray) -> None:
    assert list(leans(upright, stands=True)) == []
    assert list(leans(upright, stands=False)) == []


@pytest.mark.parametrize("degrees", ANGLES)
def test_what_stands_is_laid_level(
    upright: np.ndarray, degrees: tuple[float, float, float]
) -> None:
    assert left(degrees, resting_lean(leaning(upright, degrees))) < 1.0


@pytest.mark.parametrize("degrees", [*TURNS, (0, 7, 6)])
def test_the_mirror_plane_is_found(
    upright: np.ndarray, degrees: tuple[float, float, float]
) -> None:
    assert left(degrees, mirror_lean(leaning(upright, degrees))) < 2.0


@pytest.mark.parametrize("degrees", [*ANGLES, *TURNS, (8, 9, -5)])
def test_the_first_lean_to_be_proposed_straightens_a_chair(
    upright: np.ndarray, degrees: tuple[float, float, float]
) -> None:
    first, *others = leans(leaning(upright, degrees), stands=True)
    assert left(degrees, first) < 2.0
    assert all(np.linalg.norm(first - other) > LEAST / 2 for other in others)


def test_what_flies_is_turned_by_its_mirror_plane_alone(upright: np.ndarray) -> None:
    assert list(leans(leaning(upright, (10, 0, 0)), stands=False)) == []
    first, *_ = leans(leaning(upright, (0, 9, 5)), stands=False)
    assert left((0, 9, 5), first) < 1.5


@pytest.mark.parametrize("flat", [0, 1, 2])
def test_a_flat_cloud_rests_anyhow(flat: int) -> None:
    points = np.random.default_rng(0).uniform(-1, 1, (100, 3))
    points[:, flat] = 0.0
    assert np.isfinite(resting_lean(points)).all()
