from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from service import deadline
from service.encode.bodyfit import ROUGH, Anchor, fit_body, posed_by
from service.encode.distance import Cloud
from service.errors import Overloaded, TooComplex
from service.mesh.surface import sample_surface
from service.template.anatomy import JOINTS, limits
from service.template.skinned import Body, SkinnedTemplate, body_of

COUNT = len(JOINTS)


def random_body(seed: int) -> Body:
    """Somewhere within the limits, facing anywhere, in the normalised frame."""
    rng = np.random.default_rng(seed)
    low, high = limits()
    vectors = 0.5 * rng.uniform(low, high)
    vectors[0] = rng.standard_normal(3)
    return body_of(vectors, rng.standard_normal(3), 0.62, 0.1 * rng.standard_normal(3))


def cloud_of(human: SkinnedTemplate, body: Body, count: int = 1500) -> Cloud:
    rng = np.random.default_rng(5)
    samples = sample_surface(human.decode(body), human.faces, count, rng)
    return Cloud(samples.points, samples.normals)


def doubtful(human: SkinnedTemplate, body: Body, seed: int) -> Anchor:
    """The answer of an encoder that errs by 5 cm and 20 degrees, and knows no shape."""
    rng = np.random.default_rng(seed)
    joints = human.posed_joints(body) + 0.018 * rng.standard_normal((COUNT, 3))
    turns = Rotation.from_rotvec(0.2 * rng.standard_normal((COUNT, 3))).as_matrix()
    start = Body(
        turns @ body.rotations,
        np.zeros(3),
        1.05 * body.scale,
        body.translation + np.array([0.02, 0, -0.02]),
    )
    return Anchor(joints, start)


def joint_error(human: SkinnedTemplate, found: Body, body: Body) -> float:
    """Mean, in metres of the body."""
    gaps = human.posed_joints(found) - human.posed_joints(body)
    return float(np.linalg.norm(gaps, axis=1).mean() / body.scale)


@pytest.mark.parametrize("seed", range(3))
def test_a_body_is_found_from_a_rough_answer(human: SkinnedTemplate, seed: int) -> None:
    body = random_body(seed)
    anchor = doubtful(human, body, seed)
    posed = posed_by(human, anchor)
    fit = fit_body(human, replace(anchor, body=posed), cloud_of(human, body)).body
    errors = [joint_error(human, found, body) for found in (anchor.body, posed, fit)]
    assert errors[0] > 2 * errors[1] > 6 * errors[2]
    assert errors[2] < 0.012
    assert np.abs(fit.shape - body.shape).max() < 1.5


def test_a_rough_fit_is_between(human: SkinnedTemplate) -> None:
    body = random_body(4)
    anchor = doubtful(human, body, 4)
    start = replace(anchor, body=posed_by(human, anchor))
    cloud = cloud_of(human, body)
    rough, fine = (fit_body(human, start, cloud, s) for s in (ROUGH, type(ROUGH)()))
    assert (
        joint_error(human, start.body, body)
        > joint_error(human, rough.body, body)
        > joint_error(human, fine.body, body)
    )


def test_a_known_scale_is_kept(human: SkinnedTemplate) -> None:
    body = random_body(6)
    anchor = doubtful(human, body, 6)
    known = replace(anchor, log_scale=float(np.log(body.scale)))
    cloud = cloud_of(human, body)
    free, held = (fit_body(human, a, cloud).body for a in (anchor, known))
    assert abs(np.log(held.scale / body.scale)) < 0.01
    assert abs(np.log(held.scale / body.scale)) < abs(np.log(free.scale / body.scale))
    assert abs(held.shape[0] - body.shape[0]) < abs(free.shape[0] - body.shape[0])


def test_joints_do_not_bend_where_they_can_not(human: SkinnedTemplate) -> None:
    body = human.at_rest()
    knee = JOINTS.index("left_knee")
    backwards = body.rotations.copy()
    backwards[knee] = Rotation.from_rotvec((-0.8, 0.0, 0.0)).as_matrix()
    anchor = Anchor(human.posed_joints(body), replace(body, rotations=backwards))
    found = posed_by(human, anchor)
    bend = Rotation.from_matrix(found.rotations[knee]).as_rotvec()[0]
    assert bend > limits()[0][knee, 0] - 0.1


def test_the_covariance_tells_what_is_uncertain(human: SkinnedTemplate) -> None:
    body = random_body(7)
    anchor = doubtful(human, body, 7)
    fit = fit_body(human, anchor, cloud_of(human, body))
    sigma = np.sqrt(np.diag(fit.covariance))[: 3 * COUNT].reshape(COUNT, 3).max(axis=1)
    assert (sigma > 0.0).all()
    assert sigma[JOINTS.index("left_hand")] > sigma[JOINTS.index("left_hip")]


def test_a_fit_stops_at_its_deadline(human: SkinnedTemplate) -> None:
    body = random_body(8)
    with pytest.raises((TooComplex, Overloaded)), deadline.limit(0.0):
        fit_body(human, doubtful(human, body, 8), cloud_of(human, body))
