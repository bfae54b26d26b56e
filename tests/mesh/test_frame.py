from __future__ import annotations

import numpy as np
import pytest

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
