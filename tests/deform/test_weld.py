from __future__ import annotations

import numpy as np
from boxes import block, joined

from service.deform.weld import runs, weld


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


def test_positions_keep_the_order_of_the_vertices():
    vertices, faces = block((0.0, 0.0, 0.0), (0.1, 0.1, 0.1), cells=3)
    soup = vertices[faces].reshape(-1, 3)
    welded = weld(soup, np.arange(len(soup)).reshape(-1, 3))
    assert (np.diff(welded.first) > 0).all()
    np.testing.assert_array_equal(welded.vertices, soup[welded.first])
    np.testing.assert_array_equal(welded.of[welded.first], np.arange(len(welded.first)))
    np.testing.assert_array_equal(welded.rows, welded.first)
    plain = weld(welded.vertices, welded.faces)
    assert plain.seamless
    assert plain.rows == slice(None)
    np.testing.assert_array_equal(plain.faces, welded.faces)


def test_pieces_are_those_of_the_graph_whatever_the_order_of_the_faces():
    # Rings of which every other has its vertices shuffled among the mesh's.
    rng = np.random.default_rng(5)
    name = rng.permutation(60 * 8)
    ring = np.arange(8)
    faces = [
        name[8 * n + np.stack([ring, (ring + 1) % 8, (ring + 2) % 8], axis=1)] for n in range(60)
    ]
    points = rng.uniform(size=(60 * 8, 3))
    welded = weld(points, rng.permutation(np.concatenate(faces)))
    assert welded.pieces == 60
    pieces = welded.piece[welded.of[name]].reshape(60, 8)
    assert (pieces == pieces[:, :1]).all()
    assert len(np.unique(pieces[:, 0])) == 60


def test_many_keys_in_one_slot_are_still_told_apart(monkeypatch):
    # Factors of zero put all keys into the table's first slot.
    monkeypatch.setattr("service.deform.weld._SPREAD", (0, 0))
    vertices, faces = joined(*[block((0.0, 0.0, 0.0), (0.1, 0.1, 0.1), cells=2)] * 2)
    assert len(weld(vertices, faces).vertices) == 26


def test_runs_put_pieces_together():
    order, starts = runs(np.array([2, 0, 2, 1, 0]))
    assert order.tolist() == [1, 4, 3, 0, 2]
    assert starts.tolist() == [0, 2, 3]
