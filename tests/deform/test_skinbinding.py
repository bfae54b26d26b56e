from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from bodies import index, template, turned
from scipy.spatial.transform import Rotation

from service.deform.skinbinding import INFLUENCES, bind, joint_matrices, sparse_rows
from service.template.skinned import Body

REST = template().at_rest()
POSED = turned(REST, left_shoulder=(0.1, -0.1, -1.2), right_elbow=(0.0, 0.8, 0.0))


def own(body: Body):
    """The template's own mesh bound to it."""
    return bind(template().decode(body), template().faces, template(), body)


@pytest.fixture(scope="module")
def binding():
    return own(POSED)


def test_no_edit_moves_nothing_at_all(binding):
    np.testing.assert_array_equal(binding.move(POSED, POSED), binding.vertices)


def test_parameters_that_went_through_angles_move_nothing_at_all(binding):
    again = POSED.with_parameters(POSED.parameters)
    np.testing.assert_array_equal(binding.move(POSED, again), binding.vertices)


def test_what_a_joint_does_not_carry_stays_bit_for_bit(binding):
    moved = binding.move(POSED, turned(POSED, left_elbow=(0.0, -1.0, 0.0)))
    carried = binding.weights[:, [index(f"left_{j}") for j in ("elbow", "wrist", "hand")]]
    still = carried.sum(axis=1) == 0.0
    assert 0.5 < still.mean() < 0.99
    np.testing.assert_array_equal(moved[still], binding.vertices[still])
    assert (moved[~still] != binding.vertices[~still]).any(axis=1).all()


def test_weights_are_few_and_sum_to_one(binding):
    assert ((binding.weights > 0.0).sum(axis=1) <= INFLUENCES).all()
    assert binding.weights.min() == 0.0
    np.testing.assert_allclose(binding.weights.sum(axis=1), 1.0)


@pytest.mark.parametrize(
    "edit",
    [
        {"left_knee": (1.0, 0.0, 0.0)},
        {"right_shoulder": (0.0, 0.0, -0.7)},
        {"head": (0.0, 0.8, 0.0), "spine2": (0.2, 0.0, 0.0)},
    ],
)
def test_the_body_itself_goes_where_its_own_skin_takes_it(edit):
    moved = own(REST).move(REST, turned(REST, **edit))
    truth = template().decode(turned(REST, **edit))
    error = np.linalg.norm(moved - truth, axis=1)
    assert error.mean() < 1e-3
    assert error.max() < 0.03


def test_a_change_of_shape_is_the_bodys(binding):
    after = replace(POSED, shape=np.array([1.0, 2.0, -0.5]))
    truth = template().decode(after)
    error = np.linalg.norm(binding.move(POSED, after) - truth, axis=1)
    assert np.linalg.norm(truth - binding.vertices, axis=1).mean() > 0.02
    assert error.mean() < 2e-3


def test_what_moves_as_a_whole_keeps_its_form(binding):
    turn = Rotation.from_rotvec([0.4, -0.9, 0.2]).as_matrix()
    after = replace(POSED.turned(turn, template().joints[0]), scale=POSED.scale)
    moved = binding.move(POSED, after)
    before, now = (v - v.mean(axis=0) for v in (binding.vertices, moved))
    np.testing.assert_allclose(now, before @ turn.T, atol=1e-9)


def test_neither_unit_nor_orientation_of_the_upload_matter(binding):
    turn = Rotation.from_rotvec([np.pi / 2, 0.0, 0.0]).as_matrix()
    turned_body = POSED.turned(turn, template().joints[0])
    body = replace(turned_body, scale=100.0, translation=100.0 * turned_body.translation + 7.0)
    other = own(body)
    # In the middle of the body, either side's joint may be the fourth that counts.
    np.testing.assert_allclose(other.weights, binding.weights, atol=0.02)
    np.testing.assert_allclose(other.shapedirs, binding.shapedirs, atol=1e-5)


def test_vertices_along_a_seam_move_alike():
    vertices, faces = template().decode(POSED), template().faces
    corners = bind(vertices[faces].reshape(-1, 3), np.arange(3 * len(faces)).reshape(-1, 3),
                   template(), POSED)  # fmt: skip
    moved = corners.move(POSED, turned(POSED, left_hip=(-0.8, 0.0, 0.2)))
    first = np.zeros((len(vertices), 3))
    first[faces.ravel()] = moved
    np.testing.assert_array_equal(moved, first[faces.ravel()])


def test_a_renderer_with_the_joints_matrices_does_the_same(binding):
    after = turned(POSED, left_elbow=(0.0, -0.9, 0.0), spine1=(0.3, 0.1, 0.0))
    bound = joint_matrices(template(), POSED)
    np.testing.assert_allclose(bound[:, :3, 3], template().posed_joints(POSED))
    matrices = joint_matrices(template(), after) @ np.linalg.inv(bound)
    blended = np.einsum("nj,jab->nab", binding.weights, matrices)
    homogeneous = np.column_stack([binding.vertices, np.ones(len(binding.vertices))])
    moved = np.einsum("nab,nb->na", blended, homogeneous)[:, :3]
    np.testing.assert_allclose(moved, binding.move(POSED, after), atol=1e-9)


def test_a_head_that_turns_takes_its_normals_along(binding):
    after = turned(POSED, head=(0.0, 0.6, 0.0))
    maps = binding.carry(POSED, after)[1]
    whole = binding.weights[:, index("head")] == 1.0
    assert whole.sum() > 50
    moved = binding.move(POSED, after)
    before, now = (v[whole] - v[whole].mean(axis=0) for v in (binding.vertices, moved))
    np.testing.assert_allclose(now, np.einsum("nab,nb->na", maps[whole], before), atol=1e-9)
    still = binding.weights[:, index("head")] == 0.0
    np.testing.assert_array_equal(maps[still], np.broadcast_to(np.eye(3), maps[still].shape))


def test_points_without_faces_follow_too():
    vertices = template().decode(REST)[::10]
    cloud = bind(vertices, np.empty((0, 3), np.int64), template(), REST)
    after = turned(REST, left_knee=(1.0, 0.0, 0.0))
    error = np.linalg.norm(cloud.move(REST, after) - template().decode(after)[::10], axis=1)
    assert error.mean() < 3e-3


def test_of_many_weights_the_largest_stay():
    weights = np.zeros((2, 24))
    weights[0, :6] = [0.1, 0.3, 0.05, 0.2, 0.15, 0.2]
    weights[1, :5] = [0.5, 0.49996, 4e-5, 0.0, 0.0]
    kept = sparse_rows(weights)
    np.testing.assert_allclose(kept[0, :6] * 0.85, [0.0, 0.3, 0.0, 0.2, 0.15, 0.2])
    np.testing.assert_array_equal(kept[1] > 0.0, weights[1] > 0.1)


def test_weights_that_are_all_alike_still_sum_to_one():
    kept = sparse_rows(np.full((3, 24), 1.0 / 24.0))
    np.testing.assert_array_equal((kept > 0.0).sum(axis=1), INFLUENCES)
    np.testing.assert_allclose(kept.sum(axis=1), 1.0)
