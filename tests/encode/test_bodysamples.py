from __future__ import annotations

import numpy as np
import pytest

from service.encode.bodysamples import LOG_SCALE, PLACE, SHAPE, STEP, BodySamples, stepped
from service.template.anatomy import JOINTS, descendants
from service.template.skinned import Body, SkinnedTemplate, body_of


@pytest.fixture(scope="module")
def body() -> Body:
    rng = np.random.default_rng(0)
    vectors = 0.5 * rng.standard_normal((len(JOINTS), 3))
    return body_of(vectors, rng.standard_normal(3), 0.6, 0.2 * rng.standard_normal(3))


def test_samples_lie_on_the_body(human: SkinnedTemplate, body: Body) -> None:
    samples = BodySamples.drawn(human, 300)
    points, normals = samples.at(body)
    surface = human.decode(body)
    nearest = np.linalg.norm(points[:, None] - surface[None], axis=2).min(axis=1)
    assert nearest.max() < 0.06 * body.scale
    assert np.allclose(np.linalg.norm(normals, axis=1), 1.0)
    line = samples.linearise(body)
    assert np.allclose(line.points, points, atol=1e-7)
    assert np.allclose(line.normals, normals, atol=1e-7)
    assert np.allclose(line.joints, human.posed_joints(body))


def test_the_derivative_is_that_of_small_steps(human: SkinnedTemplate, body: Body) -> None:
    samples = BodySamples.drawn(human, 60)
    line = samples.linearise(body)
    h = 1e-6
    for index in range(STEP):
        step = np.zeros(STEP)
        step[index] = h
        up, down = stepped(body, line.turned, step), stepped(body, line.turned, -step)
        points = (samples.at(up)[0] - samples.at(down)[0]) / (2 * h)
        joints = (human.posed_joints(up) - human.posed_joints(down)) / (2 * h)
        assert np.allclose(line.jacobian[:, :, index], points, atol=1e-6)
        assert np.allclose(line.joint_jacobian[:, :, index], joints, atol=1e-6)


def test_a_turn_moves_only_what_hangs_on_the_joint(human: SkinnedTemplate, body: Body) -> None:
    elbow = JOINTS.index("left_elbow")
    step = np.zeros(STEP)
    step[3 * elbow : 3 * elbow + 3] = (0.3, -0.2, 0.1)
    turned = BodySamples.drawn(human, 10).linearise(body).turned
    after = human.posed_joints(stepped(body, turned, step))
    moved = np.linalg.norm(after - human.posed_joints(body), axis=1) > 1e-9
    below = descendants()[elbow].copy()
    below[elbow] = False
    assert (moved == below).all()


def test_a_step_changes_shape_scale_and_place(human: SkinnedTemplate, body: Body) -> None:
    step = np.zeros(STEP)
    step[SHAPE], step[LOG_SCALE], step[PLACE] = (1.0, 2.0, 3.0), np.log(2.0), (4.0, 5.0, 6.0)
    turned = BodySamples.drawn(human, 10).linearise(body).turned
    after = stepped(body, turned, step)
    assert np.allclose(after.shape - body.shape, (1.0, 2.0, 3.0))
    assert after.scale == pytest.approx(2.0 * body.scale)
    assert np.allclose(after.translation - body.translation, (4.0, 5.0, 6.0))
    assert np.allclose(after.rotations, body.rotations, atol=1e-6)
