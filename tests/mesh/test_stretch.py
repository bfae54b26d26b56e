from __future__ import annotations

import numpy as np
import pytest

from service.mesh.moves import turn_normals
from service.mesh.stretch import Stretch

COUNT = 50
generator = np.random.default_rng(5)
DIRECTIONS = generator.normal(size=(COUNT, 3))
DIRECTIONS /= np.linalg.norm(DIRECTIONS, axis=1, keepdims=True)
MATRICES = generator.normal(size=(COUNT, 3, 3))


def whole(matrices: np.ndarray) -> Stretch:
    return Stretch({(i, j): matrices[:, i, j] for i in range(3) for j in range(3)})


def dense(stretch: Stretch) -> np.ndarray:
    result = np.zeros((COUNT, 3, 3))
    for (i, j), values in stretch.cells.items():
        result[:, i, j] = values
    return result


@pytest.mark.parametrize("each", [False, True])
def test_products_with_matrices(each: bool) -> None:
    left, right = (
        generator.normal(size=(2, COUNT, 3, 3)) if each else generator.normal(size=(2, 3, 3))
    )
    assert np.allclose(dense(whole(MATRICES).between(left, right)), left @ MATRICES @ right)


def test_turned_axes_need_no_more_entries() -> None:
    turn = np.array([[0.0, 1, 0], [0, 0, -1], [-1, 0, 0]])
    stretch = Stretch({(0, 0): MATRICES[:, 0, 0]}).between(turn.T, turn)
    assert list(stretch.cells) == [(1, 1)]


def test_normals_and_tangents_to_first_order() -> None:
    small = 0.01
    maps = np.eye(3) + small * MATRICES
    normals = DIRECTIONS + small * whole(MATRICES).turn_normals(DIRECTIONS)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    assert np.abs(normals - turn_normals(DIRECTIONS, maps)).max() < 3e-3
    tangents = DIRECTIONS + small * whole(MATRICES).carry_tangents(DIRECTIONS)
    assert np.allclose(tangents, np.einsum("nij,nj->ni", maps, DIRECTIONS), atol=small * 3e-3)


@pytest.mark.parametrize("by", [-0.5, 0.7, 3.0])
def test_a_stretch_along_one_axis_is_exact(by: float) -> None:
    change = Stretch({(1, 1): np.ones(COUNT)}).turn_normals(DIRECTIONS)
    turned = DIRECTIONS + by * change
    turned /= np.linalg.norm(turned, axis=1, keepdims=True)
    maps = np.tile(np.diag([1, 1 + by, 1]), (COUNT, 1, 1))
    assert np.abs(turned - turn_normals(DIRECTIONS, maps)).max() < 1e-6


def test_what_turns_nothing_is_nothing() -> None:
    axes = np.eye(3)
    grown = Stretch({(i, i): np.ones(3) for i in range(3)})
    assert not grown.turn_normals(axes).any()
    assert not Stretch({(0, 0): np.ones(3)}).turn_normals(axes).any()
    assert Stretch({(0, 1): np.ones(3)}).turn_normals(axes).any()


def test_touched_and_parts() -> None:
    stretch = Stretch({(0, 0): np.array([0, 1, 0, 0]), (2, 1): np.array([0, 0, 0, 2])})
    assert stretch.touched().tolist() == [1, 3]
    assert stretch.at(slice(0, 1)).touched().tolist() == []
    assert stretch.scaled(0.5).cells[2, 1][3] == 1
    assert Stretch({}).touched().tolist() == []
