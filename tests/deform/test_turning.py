from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from service.deform.flips import counted
from service.deform.gradient import Gradient
from service.deform.turning import BLOCK, Turning

STEPS = (-0.3, 0.4)


def flipped(
    before: NDArray[np.float64],
    after: NDArray[np.float64],
    faces: NDArray[np.int64],
    maps: NDArray[np.float64],
) -> NDArray[np.bool_]:
    """The same by the whole formula."""
    mean = maps[faces].mean(axis=1)
    (a, b), (c, d) = (
        (v[faces[:, 1]] - v[faces[:, 0]], v[faces[:, 2]] - v[faces[:, 0]]) for v in (before, after)
    )
    carried = np.cross(*(np.einsum("fij,fj->fi", mean, side) for side in (a, b)))
    against = np.asarray((carried * np.cross(c, d)).sum(axis=1) < 0.0)
    return against & counted(np.square(np.cross(a, b)).sum(axis=1))


def rough(count: int) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """An uneven sheet of ``count x count`` points."""
    rng = np.random.default_rng(1)
    x, y = np.meshgrid(np.arange(float(count)), np.arange(float(count)), indexing="ij")
    points = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    a = (np.arange(count - 1)[:, None] * count + np.arange(count - 1)).ravel()
    b, c, d = a + count, a + count + 1, a + 1
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return 0.01 * (points + rng.uniform(-0.3, 0.3, points.shape)), faces


@pytest.mark.parametrize("axes", [(0,), (1, 2), (0, 1, 2)])
@pytest.mark.parametrize("strength", [0.1, 3.0])
def test_it_finds_what_the_whole_formula_finds(axes: tuple[int, ...], strength: float) -> None:
    vertices, faces = rough(40)
    rng = np.random.default_rng(2)
    motion = {axis: 0.02 * rng.standard_normal(len(vertices)) for axis in axes}
    cells = [(0, 0), (0, 2), (1, 1)]
    values = (strength * rng.standard_normal((3, len(vertices)))).astype(np.float32)
    gradient = Gradient(cells, values)
    found = Turning(vertices, faces).folded(motion, gradient, gradient.wild(1.0, STEPS), STEPS)
    for folded, step in zip(found, STEPS, strict=True):
        after, maps = vertices.copy(), np.tile(np.eye(3), (len(vertices), 1, 1))
        for axis, column in motion.items():
            after[:, axis] += step * column
        for (i, j), value in zip(cells, values, strict=True):
            maps[:, i, j] += step * value
        expected = flipped(vertices, after, faces, maps)
        assert 20 < expected.sum() < len(faces)
        np.testing.assert_array_equal(folded, expected)


def test_a_mesh_of_more_than_one_block_is_looked_at_to_its_end() -> None:
    vertices, faces = rough(100)
    assert len(faces) > BLOCK
    still = Gradient([], np.empty((0, len(vertices)), np.float32))
    swap = np.zeros(len(vertices))
    corner = faces[-1, 2]
    swap[corner] = -0.1
    wild = still.wild(1.0, STEPS)
    found = Turning(vertices, faces).folded({0: swap, 1: swap}, still, wild, STEPS)
    assert found.any()
    assert (faces[np.flatnonzero(found.any(axis=0))] == corner).any(axis=1).all()


def test_faces_without_area_do_not_count() -> None:
    vertices, _ = rough(3)
    faces = np.array([[0, 1, 4], [2, 2, 5]])
    still = Gradient([], np.empty((0, 9), np.float32))
    motion = {2: np.random.default_rng(0).standard_normal(9)}
    found = Turning(vertices, faces).folded(motion, still, np.ones(9, bool), STEPS)
    assert not found[:, 1].any()


@pytest.mark.parametrize("thin", [1.0, 1e-7])
@pytest.mark.parametrize("strength", [0.0, 1.0, 3.0])
@pytest.mark.parametrize("growth", [0.0, 1.5])
def test_flips_are_those_of_the_whole_formula(thin: float, strength: float, growth: float) -> None:
    vertices, faces = rough(40)
    turn = Rotation.from_rotvec([0.3, 0.5, 0.7]).as_matrix()
    vertices = vertices * [1.0, thin, 1.0] @ turn
    rng = np.random.default_rng(2)
    shift = 0.01 * rng.standard_normal(vertices.shape) * [1.0, thin, 1.0] @ turn
    moved = strength * shift + growth * vertices
    maps = np.eye(3) * (1.0 + growth) + 0.2 * strength * rng.standard_normal((len(vertices), 3, 3))
    found = Turning(vertices, faces).flipped(moved, maps)
    expected = np.flatnonzero(flipped(vertices, vertices + moved, faces, maps))
    assert (strength > 0.0) == (20 < len(expected) < len(faces))
    np.testing.assert_array_equal(found, expected)
