from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from service.errors import InvalidRequest
from service.mesh.moves import BLOCK, any_of_rows, compare, turn_normals, turn_tangents, unit

IDENTITY = np.tile(np.eye(3), (4, 1, 1))
POINTS = np.arange(12.0).reshape(4, 3)


def test_moved_and_turned_are_told_apart() -> None:
    vertices, linear = POINTS.copy(), IDENTITY.copy()
    vertices[1, 2] = np.nextafter(vertices[1, 2], 99)
    linear[2, 0, 1] = 1e-12
    change = compare(POINTS, vertices, linear)
    assert change.moved.tolist() == [False, True, False, False]
    assert change.turned.tolist() == [False, False, True, False]
    assert change.any
    assert not compare(POINTS, POINTS, IDENTITY.astype(np.float32)).any


@pytest.mark.parametrize(
    ("vertices", "linear"), [(POINTS[:3], IDENTITY), (POINTS, IDENTITY[:3]), (POINTS, POINTS)]
)
def test_arrays_of_another_mesh_are_a_mistake(vertices: np.ndarray, linear: np.ndarray) -> None:
    with pytest.raises(ValueError, match=r"expected \(4, 3\) positions"):
        compare(POINTS, vertices, linear)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e38])
@pytest.mark.parametrize("part", [0, 1])
def test_values_that_cannot_be_stored_are_refused(value: float, part: int) -> None:
    arrays = [POINTS.copy(), IDENTITY.copy()]
    arrays[part].flat[5] = value
    with pytest.raises(InvalidRequest, match="overflow"):
        compare(POINTS, *arrays)


elements = st.floats(-3, 3, allow_subnormal=False)


@settings(deadline=None, database=None)
@given(
    linear=arrays(np.float64, (6, 3, 3), elements=elements),
    u=arrays(np.float64, (6, 3), elements=elements),
    v=arrays(np.float64, (6, 3), elements=elements),
)
def test_normals_stay_across_their_surface(
    linear: np.ndarray, u: np.ndarray, v: np.ndarray
) -> None:
    normals = np.cross(u, v)
    turned = turn_normals(normals, linear)
    scale = 1 + np.abs(linear).sum() * (np.abs(u).sum() + np.abs(v).sum())
    good = (np.linalg.norm(normals, axis=1) > 1e-3) & (np.abs(np.linalg.det(linear)) > 1e-3)
    for surface in (u, v):
        moved = np.einsum("nij,nj->ni", linear, surface)
        assert np.all(np.abs((moved * turned).sum(axis=1))[good] < 1e-9 * scale)
    assert np.allclose(np.linalg.norm(turned[good], axis=1), 1)
    exact = np.einsum("nji,nj->ni", np.linalg.inv(linear[good]), normals[good])
    assert np.all((exact * turned[good]).sum(axis=1) > 0)


def test_many_normals_are_turned_in_blocks_without_a_seam() -> None:
    generator = np.random.default_rng(3)
    count = 2 * BLOCK + 5
    linear = np.eye(3) + 0.2 * generator.normal(size=(count, 3, 3))
    normals = generator.normal(size=(count, 3))
    exact = np.einsum("nji,nj->ni", np.linalg.inv(linear), normals)
    exact /= np.linalg.norm(exact, axis=1, keepdims=True)
    assert np.allclose(turn_normals(normals, linear), exact)
    rough = turn_normals(normals, linear.astype(np.float32))
    assert np.allclose(rough, exact, atol=1e-4)


def test_flattening_maps_give_the_normal_of_the_plane() -> None:
    flat = np.diag([1.0, 1.0, 0.0])[None]
    assert np.allclose(turn_normals(np.array([[0.6, 0.0, 0.8]]), flat), [[0, 0, 1]])


def test_directions_that_vanish_stay() -> None:
    nothing = np.zeros((1, 3, 3))
    direction = np.array([[0.0, 0.0, 2.0]])
    assert np.array_equal(turn_normals(direction, nothing), direction)
    assert np.array_equal(turn_tangents(direction, nothing), direction)


def test_unit_keeps_what_has_no_length() -> None:
    with np.errstate(all="ignore"):
        directions = np.array([[3.0, 0, 4], [0, 0, 0], [np.nan, 0, 0], [np.inf, 0, 0]])
        found = unit(directions, np.full((4, 3), 7.0))
    assert np.allclose(found, [[0.6, 0, 0.8], [7, 7, 7], [7, 7, 7], [7, 7, 7]])


@settings(deadline=None, database=None)
@given(arrays(np.bool_, (5, 9)))
def test_any_of_rows(flags: np.ndarray) -> None:
    assert np.array_equal(any_of_rows(flags), flags.any(axis=1))
