from __future__ import annotations

import numpy as np
from boxes import block, joined

from service.deform.weld import weld


def test_seams_are_joined_and_touching_boxes_are_not():
    first = block((0.0, 0.0, 0.0), (0.1, 0.1, 0.1), cells=2)
    second = block((0.1, 0.1, 0.1), (0.2, 0.2, 0.2), cells=2)
    welded = weld(*joined(first, second))
    assert welded.pieces == 2
    # A cube's surface of 2 x 2 cells a side has 26 points; the corner that touches counts twice.
    assert len(welded.vertices) == 52
    np.testing.assert_array_equal(welded.vertices[welded.of], joined(first, second)[0])


def test_a_vertex_that_two_fans_share_joins_them():
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]], float)
    welded = weld(points, np.array([[0, 1, 2], [0, 3, 4]]))
    assert welded.pieces == 1


def test_triangles_of_their_own_are_joined_along_edges_and_not_at_corners():
    vertices, faces = joined(
        block((0.0, 0.0, 0.0), (0.1, 0.1, 0.1), cells=2),
        block((0.1, 0.1, 0.1), (0.2, 0.2, 0.2), cells=2),
    )
    soup = np.arange(3 * len(faces)).reshape(-1, 3)
    welded = weld(vertices[faces].reshape(-1, 3), soup)
    assert welded.pieces == 2
    assert len(welded.vertices) == 52


def test_boxes_bound_the_pieces_and_strays_are_a_piece():
    vertices, faces = block((0.0, 0.0, 0.0), (0.1, 0.2, 0.3), cells=1)
    welded = weld(np.concatenate([vertices, [[2.0, 2.0, 2.0]]]), faces)
    low, high = welded.boxes()
    np.testing.assert_allclose(sorted((high - low).tolist()), [[0, 0, 0], [0.1, 0.2, 0.3]])


def test_points_alone_are_one_piece():
    assert weld(np.eye(3), np.empty((0, 3), np.int64)).pieces == 1
