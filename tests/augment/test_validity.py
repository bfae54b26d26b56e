"""What edits do to meshes of a few faces."""

from __future__ import annotations

import numpy as np
import trimesh

from service.augment.validity import USUAL, Damage, Limits, Validity, heights


def table() -> tuple[np.ndarray, np.ndarray, slice]:
    """A board on a leg that it touches, and the leg's vertices."""
    board = trimesh.creation.box((1, 0.1, 1))
    leg = trimesh.creation.box((0.1, 0.8, 0.1))
    leg.apply_translation([0, -0.45, 0])
    both = trimesh.util.concatenate([board, leg])
    return both.vertices, both.faces, slice(len(board.vertices), None)


def test_a_mesh_that_stays_is_whole() -> None:
    vertices, faces, _ = table()
    damage = Validity(vertices, faces).told(vertices, 0)
    assert damage == Damage(0, 0, 0.0, 0, len(faces))
    assert damage.beyond(USUAL) == []


def test_a_leg_that_comes_off_is_a_gap() -> None:
    vertices, faces, leg = table()
    moved = vertices.copy()
    moved[leg, 1] -= 0.1
    damage = Validity(vertices, faces).told(moved, 0)
    assert damage.gaps == 1
    assert damage.beyond(USUAL) == ["1 pairs of pieces that touched come apart"]


def test_a_leg_that_slides_along_the_board_is_none() -> None:
    vertices, faces, leg = table()
    moved = vertices.copy()
    moved[leg, 0] += 0.4
    assert Validity(vertices, faces).told(moved, 0).gaps == 0


def test_a_joint_may_go_deeper() -> None:
    vertices, faces, leg = table()
    moved = vertices.copy()
    moved[leg, 1] += 0.03
    damage = Validity(vertices, faces).told(moved, 0)
    assert (damage.crossings, damage.gaps) == (0.0, 0)


def test_pieces_that_were_apart_may_not_cross() -> None:
    one, other = trimesh.creation.box((1, 1, 1)), trimesh.creation.box((0.5, 0.5, 0.5))
    other.apply_translation([2, 0.1, 0.1])
    both = trimesh.util.concatenate([one, other])
    moved = both.vertices.copy()
    moved[8:, 0] -= 1.4
    damage = Validity(both.vertices, both.faces).told(moved, 0)
    assert damage.crossings > 0
    assert "cross" in damage.beyond(USUAL)[0]
    assert damage.gaps == 0


def test_a_face_that_collapses_is_counted_and_one_that_was_thin_is_not() -> None:
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [3, 0, 0], [4, 0, 0], [3.5, 1e-8, 0]])
    faces = np.array([[0, 1, 2], [3, 4, 5]])
    moved = vertices.copy()
    moved[2] = [0.5, 0, 0]
    assert Validity(vertices, faces).told(moved, 0).degenerate == 1
    assert Validity(vertices, faces).told(vertices, 0).degenerate == 0


def test_heights_are_shares_of_the_diagonal() -> None:
    vertices = np.array([[0.0, 0, 0], [4, 0, 0], [0, 3, 0]])
    np.testing.assert_allclose(heights(vertices, np.array([[0, 1, 2]])), [3 * 4 / 5 / 5])


def test_limits_are_shares_of_the_faces() -> None:
    damage = Damage(flipped=2, degenerate=2, crossings=3.0, gaps=0, faces=1000)
    assert len(damage.beyond(USUAL)) == 2
    assert damage.beyond(Limits(flips=0.01, degenerate=0.01)) == []
    assert damage.figures["new_crossings_per_10k"] == 3.0


def test_seams_do_not_part_a_mesh() -> None:
    box = trimesh.creation.box((1, 1, 1))
    loose = box.vertices[box.faces].reshape(-1, 3)
    faces = np.arange(len(loose)).reshape(-1, 3)
    damage = Validity(loose, faces).told(loose * [2.0, 1.0, 1.0], 0)
    assert damage.beyond(USUAL) == []
