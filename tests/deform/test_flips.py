from __future__ import annotations

import numpy as np
import pytest
import trimesh

from service.deform.turning import count_flips

SPHERE = trimesh.creation.icosphere(subdivisions=2)
VERTICES = np.asarray(SPHERE.vertices, np.float64)
FACES = np.asarray(SPHERE.faces, np.int64)


def flips(after: np.ndarray, linear: np.ndarray, faces: np.ndarray = FACES) -> int:
    """Flips when every vertex has the same linear map ``[3, 3]``."""
    return count_flips(VERTICES, after, faces, np.broadcast_to(linear, (len(VERTICES), 3, 3)))


@pytest.mark.parametrize(
    "linear",
    [
        np.eye(3),
        np.diag([3.0, 0.2, 1.0]),
        np.diag([1.0, 1.0, 1e-3]),
        [[0, 0, 1], [1, 0, 0], [0, 1, 0]],
        [[1, 4, 0], [0, 1, 0], [0, 0, 1]],
        -np.diag([1.0, 1.0, -1.0]),
    ],
)
def test_a_linear_map_that_keeps_handedness_flips_nothing(linear: np.ndarray) -> None:
    linear = np.asarray(linear, np.float64)
    assert flips(VERTICES @ linear.T + [1, 2, 3], linear) == 0


def test_a_face_that_turns_against_its_map_is_a_flip() -> None:
    after = VERTICES.copy()
    corners = FACES[17]
    # Swapping two corners of one face turns it over; its neighbours keep their sides or lose area.
    lonely = FACES[[17]]
    after[corners[[0, 1]]] = after[corners[[1, 0]]]
    assert flips(after, np.eye(3), lonely) == 1
    assert flips(VERTICES, np.eye(3), lonely) == 0


def test_faces_that_a_mirror_turns_by_more_than_a_right_angle_are_counted() -> None:
    mirror = np.diag([1.0, 1.0, -1.0])
    normals = np.cross(*np.moveaxis(np.diff(VERTICES[FACES], axis=1), 1, 0))
    turned = (normals @ np.diag([-1.0, -1.0, 1.0]) * normals).sum(axis=1) < 0
    assert flips(VERTICES @ mirror, np.eye(3)) == turned.sum() > 0


def test_a_turned_face_whose_map_turned_with_it_is_none() -> None:
    half_turn = np.diag([-1.0, 1.0, -1.0])
    assert flips(VERTICES @ half_turn, half_turn) == 0
    assert flips(VERTICES @ half_turn, np.eye(3)) > 0


def test_area_vectors_are_carried_by_the_cofactors() -> None:
    # A steep shear takes the normal (0, 1, 0) to (5, 1, 0); as a vector it would stay.
    shear = np.array([[1.0, 0, 0], [-5.0, 1, 0], [0, 0, 1]])
    before = np.array([[0.0, 0, 0], [1, 0, 0], [0, 0, -1]])
    maps, face = np.broadcast_to(shear, (3, 3, 3)), np.array([[0, 1, 2]])
    assert count_flips(before, before @ shear.T, face, maps) == 0
    against = np.array([[0.0, 0, 0], [1, 1, 0], [0, 0, -1]])  # its normal is (-1, 1, 0)
    along = np.array([[0.0, 0, 0], [-1, -1, 0], [0, 0, -1]])  # and this one's (1, -1, 0)
    assert count_flips(before, against, face, maps) == 1
    assert count_flips(before, along, face, maps) == 0


def test_a_map_that_flattens_is_no_fault() -> None:
    flat = np.diag([1.0, 0.0, 1.0])
    assert flips(VERTICES @ flat, flat) == 0


def test_faces_too_small_to_have_a_side_are_left_out() -> None:
    sliver = VERTICES[0] + np.array([[0, 0, 0], [1e-5, 0, 0], [0, 1e-5, 0]])
    before = np.concatenate([VERTICES, sliver])
    after = np.concatenate([VERTICES, sliver[[0, 2, 1]]])
    faces = np.concatenate([FACES, len(VERTICES) + np.array([[0, 1, 2]])])
    maps = np.broadcast_to(np.eye(3), (len(before), 3, 3))
    assert count_flips(before, after, faces, maps) == 0
    assert count_flips(1e6 * before, 1e6 * after, faces, maps) == 0


def test_the_unit_of_the_mesh_makes_no_difference() -> None:
    after = VERTICES @ np.diag([-1.0, 1.0, -1.0])
    counted = flips(after, np.eye(3))
    maps = np.broadcast_to(np.eye(3), (len(VERTICES), 3, 3))
    for size in (1e-4, 1e4):
        assert count_flips(size * VERTICES, size * after, FACES, maps) == counted


@pytest.mark.parametrize("stretch", [0.5, 1.0, 1.4, 3.5])
def test_the_quick_look_at_stretches_agrees_with_the_whole_formula(stretch: float) -> None:
    rng = np.random.default_rng(3)
    before = rng.standard_normal((300, 3))
    faces = rng.integers(0, 300, (500, 3))
    maps = np.tile(np.diag([1.0, stretch, 1.0]), (300, 1, 1))
    after = before * [1.0, stretch, 1.0] + 0.3 * rng.standard_normal((300, 3))
    crosses = [
        np.cross(v[faces[:, 1]] - v[faces[:, 0]], v[faces[:, 2]] - v[faces[:, 0]])
        for v in (before * [1.0, stretch, 1.0], after)
    ]
    expected = (crosses[0] * crosses[1]).sum(axis=1) < 0
    assert 10 < count_flips(before, after, faces, maps) == expected.sum()
