from __future__ import annotations

import numpy as np
import pytest

from service.mesh.moves import BLOCK
from service.mesh.placement import Placement, times

generator = np.random.default_rng(7)
ONE = np.eye(4)
ONE[:3, :] = generator.normal(size=(3, 4))
MANY = np.tile(np.eye(4), (5, 1, 1))
MANY[:, :3, :] = generator.normal(size=(5, 3, 4))
POINTS = generator.normal(size=(5, 3))
LINEAR = np.eye(3) + 0.3 * generator.normal(size=(5, 3, 3))


@pytest.mark.parametrize("matrix", [np.eye(4), ONE, MANY], ids=["identity", "one", "many"])
def test_to_world_and_back(matrix: np.ndarray) -> None:
    placement = Placement.of(matrix)
    full = np.broadcast_to(matrix, (5, 4, 4))
    world = placement.to_world(POINTS)
    assert np.allclose(world, [m[:3, :3] @ p + m[:3, 3] for m, p in zip(full, POINTS, strict=True)])
    moved = world + generator.normal(size=(5, 3))
    local = placement.shifted(POINTS, world, moved)
    assert np.allclose(placement.to_world(local), moved)


@pytest.mark.parametrize("matrix", [np.eye(4), ONE, MANY], ids=["identity", "one", "many"])
def test_normals_and_tangents_turn_as_if_in_the_world(matrix: np.ndarray) -> None:
    """Local vectors u, v on a surface, and their normal, go through one local linear map each."""
    placement = Placement.of(matrix)
    full = np.broadcast_to(matrix[..., :3, :3], (5, 3, 3))
    local_maps = np.linalg.inv(full) @ LINEAR @ full
    u, v = generator.normal(size=(2, 5, 3))
    normals, tangents = np.cross(u, v), u
    new_u = np.einsum("nij,nj->ni", local_maps, u)
    new_v = np.einsum("nij,nj->ni", local_maps, v)
    expected = np.cross(new_u, new_v) * np.sign(np.linalg.det(local_maps))[:, None]
    found = placement.turn_normals(normals, LINEAR)
    assert np.allclose(found, expected / np.linalg.norm(expected, axis=1, keepdims=True))
    found = placement.turn_tangents(tangents, LINEAR)
    assert np.allclose(found, new_u / np.linalg.norm(new_u, axis=1, keepdims=True))


def test_flattened_axis_keeps_its_coordinate() -> None:
    placement = Placement.of(np.diag([2.0, 0.0, 1.0, 1.0]))
    world = placement.to_world(POINTS)
    local = placement.shifted(POINTS, world, world + 1.0)
    assert np.allclose(local, POINTS + np.array([0.5, 0.0, 1.0]))


def test_mirrors_and_identity_are_told() -> None:
    assert Placement.of(np.diag([1.0, -1.0, 1.0, 1.0])).mirrors
    assert not Placement.of(np.diag([-1.0, -1.0, 1.0, 1.0])).mirrors
    assert Placement.of(np.eye(4)).is_identity
    assert not Placement.of(MANY).is_identity


def test_rows_of_placements() -> None:
    rows = np.array([3, 1])
    assert np.allclose(
        Placement.of(MANY).at(rows).to_world(POINTS[rows]),
        Placement.of(MANY).to_world(POINTS)[rows],
    )
    one = Placement.of(ONE)
    assert one.at(rows) is one


def test_long_products_are_cut_without_a_seam() -> None:
    vectors = generator.normal(size=(BLOCK + 3, 3))
    expected = np.einsum("ij,nj->ni", ONE[:3, :3], vectors)
    assert np.allclose(times(ONE[:3, :3], vectors), expected)
