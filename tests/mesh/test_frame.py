from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from service.errors import InvalidRequest
from service.mesh.frame import AXES, CANONICAL, Orientation, orientations


def test_there_are_24_proper_rotations() -> None:
    found = orientations()
    assert len(found) == len(set(found)) == 24
    rotations = np.stack([orientation.rotation for orientation in found])
    assert len(np.unique(rotations.reshape(24, 9), axis=0)) == 24
    np.testing.assert_array_equal(rotations @ rotations.transpose(0, 2, 1), [np.eye(3)] * 24)
    np.testing.assert_allclose(np.linalg.det(rotations), 1.0)


def test_up_goes_to_plus_y_and_front_to_plus_z() -> None:
    for orientation in orientations():
        assert (orientation.rotation @ AXES[orientation.up]).tolist() == [0, 1, 0]
        assert (orientation.rotation @ AXES[orientation.front]).tolist() == [0, 0, 1]


def test_axes_are_what_they_are_called() -> None:
    assert len(AXES) == 6
    for name, axis in AXES.items():
        assert axis["xyz".index(name[1])] == {"+": 1, "-": -1}[name[0]]
        assert np.abs(axis).sum() == 1


def test_the_canonical_orientation_comes_first_and_changes_nothing() -> None:
    assert orientations()[0] == CANONICAL == Orientation("+y", "+z")
    assert np.array_equal(CANONICAL.rotation, np.eye(3))
    assert orientations(up="+y")[0] == CANONICAL
    assert orientations(front="+z")[0] == CANONICAL


def test_a_file_with_z_up_is_tipped_forward() -> None:
    turn = Orientation(up="+z", front="-y").rotation
    assert (turn @ [1, 2, 3]).tolist() == [1, 3, -2]


def test_a_lean_is_a_further_turn_after_the_axes() -> None:
    way = Orientation("+z", "-y")
    leaning = way.leaning(np.array([0.0, 0.3, 0.0])).leaning(np.array([0.2, 0.0, 0.0]))
    turn = Rotation.from_rotvec([0.2, 0, 0]) * Rotation.from_rotvec([0, 0.3, 0])
    np.testing.assert_allclose(leaning.rotation, turn.as_matrix() @ way.rotation, atol=1e-15)
    assert (leaning.up, leaning.front) == (way.up, way.front)
    assert leaning.degrees == pytest.approx(np.degrees(turn.magnitude()))
    assert way.degrees == 0.0


@pytest.mark.parametrize("lean", [np.zeros(3), np.array([0.1, -0.2, 0.05])])
@pytest.mark.parametrize("way", orientations()[:8])
def test_points_and_maps_go_there_and_back(way: Orientation, lean: np.ndarray) -> None:
    way = way.leaning(lean)
    rng = np.random.default_rng(0)
    points, maps = rng.normal(size=(5, 3)), rng.normal(size=(5, 3, 3))
    there = way.to_canonical(points)
    np.testing.assert_allclose(there, points @ way.rotation.T, atol=1e-15)
    np.testing.assert_allclose(way.to_own(there), points, atol=1e-15)
    own = np.einsum("nij,nj->ni", way.maps_to_own(maps), points)
    np.testing.assert_allclose(own, way.to_own(np.einsum("nij,nj->ni", maps, there)), atol=1e-14)


def test_what_does_not_move_stays_where_it_is_to_the_last_bit() -> None:
    leaning = CANONICAL.leaning(np.array([0.1, -0.2, 0.05]))
    assert not leaning.to_own(np.zeros((4, 3))).any()
    still = np.tile(np.eye(3, dtype=np.float32), (4, 1, 1))
    assert np.array_equal(leaning.maps_to_own(still), still)


@pytest.mark.parametrize("axis", AXES)
def test_what_is_known_of_the_axes_is_kept(axis: str) -> None:
    by_up, by_front = orientations(up=axis), orientations(front=axis)
    assert {found.up for found in by_up} == {axis} == {found.front for found in by_front}
    assert len({found.front for found in by_up}) == len(by_up) == 4
    assert len({found.up for found in by_front}) == len(by_front) == 4
    other = "+x" if axis[1] != "x" else "-z"
    assert orientations(axis, other) == [Orientation(axis, other)]


@pytest.mark.parametrize(
    ("up", "front", "code"),
    [
        ("up", "auto", "unknown_up"),
        ("y", "+z", "unknown_up"),
        ("auto", "+w", "unknown_front"),
        ("+y", "", "unknown_front"),
        ("+y", "+y", "parallel_axes"),
        ("+y", "-y", "parallel_axes"),
    ],
)
def test_axes_that_make_no_frame_are_refused(up: str, front: str, code: str) -> None:
    with pytest.raises(InvalidRequest) as caught:
        orientations(up, front)
    assert caught.value.code == code
    assert repr(up) in caught.value.detail or front in caught.value.detail
