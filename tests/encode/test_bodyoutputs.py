from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.distance import pdist
from scipy.spatial.transform import Rotation

from service.encode.bodyoutputs import OUTPUTS, BodyEncoding, spread_first
from service.template.anatomy import JOINTS, PARENTS
from service.template.bodyfile import load_body
from service.template.skinned import Body, body_of
from service.template.skinning import pose_joints

COUNT = len(JOINTS)


def outputs_of(body: Body) -> np.ndarray:
    """What a perfect encoder answers for a body."""
    human = load_body()
    rest = human.joints + human.joint_dirs @ body.shape
    turned, _ = pose_joints(body.rotations, rest, PARENTS)
    columns = turned[:, :, :2].transpose(0, 2, 1).reshape(COUNT, 6)
    return np.concatenate(
        [human.posed_joints(body).ravel(), columns.ravel(), body.shape, [np.log(body.scale)]]
    )


@pytest.fixture(scope="module")
def body() -> Body:
    rng = np.random.default_rng(1)
    vectors = 0.6 * rng.standard_normal((COUNT, 3))
    return body_of(vectors, rng.standard_normal(3), 0.55, 0.1 * rng.standard_normal(3))


def test_outputs_are_taken_apart(body: Body) -> None:
    outputs = outputs_of(body)
    assert outputs.shape == (OUTPUTS,)
    found = BodyEncoding.of(outputs.astype(np.float32)).body(load_body())
    assert np.allclose(found.rotations, body.rotations, atol=1e-5)
    assert np.allclose(found.shape, body.shape, atol=1e-5)
    assert found.scale == pytest.approx(body.scale, rel=1e-5)
    assert np.allclose(found.translation, body.translation, atol=1e-5)


def test_columns_of_any_length_and_angle_make_rotations() -> None:
    outputs = np.random.default_rng(2).standard_normal(OUTPUTS)
    rotations = BodyEncoding.of(outputs).rotations
    assert np.allclose(rotations @ rotations.transpose(0, 2, 1), np.eye(3), atol=1e-9)
    assert np.allclose(np.linalg.det(rotations), 1.0)


def test_an_answer_turns_with_its_cloud(body: Body) -> None:
    rotation = Rotation.from_euler("xyz", (0.4, 1.1, -0.3)).as_matrix()
    human = load_body()
    found = BodyEncoding.of(outputs_of(body)).turned(rotation).body(human)
    assert np.allclose(human.posed_joints(found), human.posed_joints(body) @ rotation.T)
    assert np.allclose(human.decode(found), human.decode(body) @ rotation.T)


def test_points_far_from_one_another_come_first() -> None:
    points = np.random.default_rng(3).standard_normal((500, 3))
    order = spread_first(points, 32)
    assert sorted(order) == list(range(500))
    assert order[0] == 0
    assert pdist(points[order[:32]]).min() > 2 * pdist(points[:32]).min()


def test_copies_of_one_point_are_told_apart() -> None:
    assert sorted(spread_first(np.zeros((40, 3)), 8)) == list(range(40))
