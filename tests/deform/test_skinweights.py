from __future__ import annotations

import numpy as np
import pytest
from bodies import below, hands_on_hips, index, template

from service.deform.normals import vertex_normals
from service.deform.skinmatch import BodySurface
from service.deform.skinweights import consistent, skin_values, vertex_areas
from service.deform.weld import Welded, weld

REST = template().at_rest()
LEFT = ("left_elbow", "left_wrist", "left_hand")


def values_of(vertices, faces, body):
    mesh = weld(vertices, faces)
    return skin_values(mesh, template(), body)[mesh.of]


def test_areas_are_shared_by_corners():
    x = np.array([[0.0, 0, 0], [2, 0, 0], [0, 3, 0], [9, 9, 9]])
    np.testing.assert_allclose(vertex_areas(x, np.array([[0, 1, 2]])), [1.0, 1.0, 1.0, 0.0])


def test_at_rest_they_are_the_templates_own():
    values = values_of(template().decode(REST), template().faces, REST)
    error = np.abs(values[:, :24] - template().weights).sum(axis=1)
    assert np.quantile(error, 0.95) < 0.1
    dirs = values[:, 24:].reshape(-1, 3, 3)
    assert np.abs(dirs - template().shapedirs).mean() < 1e-3


@pytest.mark.parametrize("off", [-0.015, 0.015])
def test_hands_on_hips_are_no_hips(off):
    body = hands_on_hips(inward=0.1)
    # The upload differs from the fit, as uploads do.
    vertices = template().decode(body) + np.array([off, 0.0, off])
    values = values_of(vertices, template().faces, body)
    wrong = np.abs(below(values, *LEFT) - below(template().weights, *LEFT)) > 0.5
    assert wrong.mean() < 2e-3
    plain = BodySurface.of(template(), body)
    normals = vertex_normals(vertices, template().faces)
    unaided = plain.match(vertices, 0.0 * normals)
    assert (np.abs(below(unaided.values, *LEFT) - below(template().weights, *LEFT)) > 0.5
            ).mean() > 5.0 * wrong.mean()  # fmt: skip


def strip(length: int):
    """A ribbon of squares of a centimetre along x."""
    x = np.array([[0.01 * i, 0.01 * j, 0.0] for i in range(length) for j in (0, 1)])
    a = 2 * np.arange(length - 1)
    faces = np.concatenate([np.stack([a, a + 2, a + 1], 1), np.stack([a + 1, a + 2, a + 3], 1)])
    return x, faces


def judged(rest, sound):
    x, faces = strip(20)
    piece = np.zeros(len(x), np.int64)
    own = np.arange(len(x))
    mesh = Welded(x, own, own, faces, piece, 1)
    return consistent(x, mesh, rest, sound, vertex_areas(x, faces))


def test_a_patch_that_is_elsewhere_on_the_body_is_wrong():
    x, _ = strip(20)
    rest = x.copy()
    patch = slice(10, 14)
    rest[patch] += [0.0, 0.6, 0.0]
    expected = np.ones(40, bool)
    expected[patch] = False
    np.testing.assert_array_equal(judged(rest, np.ones(40, bool)), expected)


def test_what_is_cut_off_by_unsound_matches_only_is_right():
    x, _ = strip(20)
    sound = np.ones(40, bool)
    sound[30:34] = False
    assert judged(x, sound)[sound].all()
    moved = x.copy()
    moved[34:] += [0.0, 0.6, 0.0]
    assert not judged(moved, sound)[34:].any()


def test_hair_is_all_head():
    head = template().weights[:, index("head")] > 0.95
    faces = template().faces[head[template().faces].all(axis=1)]
    vertices = template().decode(REST)
    normals = vertex_normals(vertices, template().faces)
    behind = vertices[:, 2] < np.median(vertices[head, 2])
    faces = faces[behind[faces].all(axis=1)]
    # A cap on the back of the head that is drawn out over the neck.
    cap = vertices + 0.02 * normals
    low = np.clip(np.quantile(cap[head, 1], 0.5) - cap[:, 1], 0.0, None)
    cap[:, 1] -= 2.0 * low
    both = np.concatenate([vertices, cap])
    values = values_of(both, np.concatenate([template().faces, faces + len(vertices)]), REST)
    hair = np.unique(faces) + len(vertices)
    np.testing.assert_array_equal(values[hair, index("head")], 1.0)
    np.testing.assert_array_equal(values[hair, :24].sum(axis=1), 1.0)
