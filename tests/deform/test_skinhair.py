from __future__ import annotations

import numpy as np
import pytest
from bodies import below, index, template

from service.deform.normals import vertex_normals
from service.deform.skinhair import covered, face_vertices, hair_pieces
from service.deform.skinmatch import BodySurface

REST = template().at_rest()
VERTICES = template().decode(REST)
NORMALS = vertex_normals(VERTICES, template().faces)


def together(*clouds):
    """Clouds of points joined, and the piece that each point is of."""
    piece = np.repeat(np.arange(len(clouds)), [len(cloud) for cloud in clouds])
    return np.concatenate(clouds), piece


@pytest.mark.parametrize("hanging", [0.05, 0.35])
def test_hair_turns_with_the_head_however_long_it_is(hanging):
    head = template().weights[:, index("head")] > 0.95
    back = VERTICES[head][:, 2] < np.median(VERTICES[head][:, 2])
    cap = VERTICES[head][back] + 0.02 * NORMALS[head][back]
    low = cap[cap[:, 1] < np.quantile(cap[:, 1], 0.3)]
    strands = np.concatenate([low - [0.0, hanging * f, 0.03] for f in (0.3, 0.6, 1.0)])
    hair = np.concatenate([cap, strands])
    x, piece = together(VERTICES, hair)
    outward = np.concatenate([NORMALS, hair - VERTICES[head].mean(axis=0)])
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    surface = BodySurface.of(template(), REST)
    found = hair_pieces(
        x, np.ones(len(x)), piece, surface.match(x, outward), template(), surface.points
    )
    np.testing.assert_array_equal(found, [False, True])


def test_a_bust_with_its_face_is_no_hair():
    bust = below(template().weights, "head", "neck") > 0.5
    x, piece = together(VERTICES[bust], VERTICES[~bust])
    normals = np.concatenate([NORMALS[bust], NORMALS[~bust]])
    surface = BodySurface.of(template(), REST)
    found = hair_pieces(
        x, np.ones(len(x)), piece, surface.match(x, normals), template(), surface.points
    )
    assert not found.any()


def test_a_strand_that_lies_on_hair_is_hair_and_one_on_the_chest_is_not():
    head = template().weights[:, index("head")] > 0.95
    back = VERTICES[head][:, 2] < np.median(VERTICES[head][:, 2])
    cap = VERTICES[head][back] + 0.02 * NORMALS[head][back]
    tail = cap[cap[:, 1].argmin()] - np.linspace(0.0, 0.15, 30)[:, None] * [0.0, 1.0, 0.3]
    tie = tail[10:14] - np.array([0.0, 0.0, 0.005])
    chest = VERTICES[template().weights[:, index("spine3")].argmax()] + [0.0, 0.0, 0.005]
    x, piece = together(VERTICES, np.concatenate([cap, tail]), tie, np.tile(chest, (4, 1)))
    outward = np.concatenate([NORMALS, x[len(VERTICES) :] - VERTICES[head].mean(axis=0)])
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    surface = BodySurface.of(template(), REST)
    found = hair_pieces(
        x, np.ones(len(x)), piece, surface.match(x, outward), template(), surface.points
    )
    np.testing.assert_array_equal(found, [False, True, True, False])


def test_shares_are_of_points_that_are_touched():
    points = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0]])
    x = np.array([[0.0, 0.01, 0], [1, 0, 0.01], [1, 0, 0], [2.5, 0, 0]])
    np.testing.assert_allclose(covered(x, np.array([0, 0, 0, 1]), 3, points), [0.5, 0.0, 0.0])


def test_the_face_is_in_front_and_below_the_middle_of_the_head():
    face = template().rest[face_vertices(template())]
    head = template().rest[template().weights[:, index("head")] > 0.7]
    assert face[:, 2].min() > np.median(head[:, 2])
    assert face[:, 1].max() < head[:, 1].mean()
    assert np.ptp(face[:, 0]) < 0.2
