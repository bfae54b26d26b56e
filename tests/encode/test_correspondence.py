from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from service import deadline
from service.encode.correspondence import fit_vertices
from service.errors import Overloaded, TooComplex
from service.template.anatomy import JOINTS, limits
from service.template.skinned import Body, SkinnedTemplate, body_of

COUNT = len(JOINTS)


def random_body(seed: int) -> Body:
    rng = np.random.default_rng(seed)
    low, high = limits()
    vectors = 0.7 * rng.uniform(low, high)
    vectors[0] = rng.standard_normal(3)
    return body_of(vectors, rng.standard_normal(3), 0.6, 0.1 * rng.standard_normal(3))


def roughly(body: Body, seed: int) -> Body:
    """Off by some 25 degrees a joint."""
    rng = np.random.default_rng(seed)
    turns = Rotation.from_rotvec(0.25 * rng.standard_normal((COUNT, 3))).as_matrix()
    return Body(turns @ body.rotations, np.zeros(3), 1.1 * body.scale, body.translation)


@pytest.mark.parametrize("seed", range(3))
def test_corresponding_vertices_tell_the_body(human: SkinnedTemplate, seed: int) -> None:
    body = random_body(seed)
    found = fit_vertices(human, roughly(body, seed), human.decode(body)).body
    gaps = np.linalg.norm(human.posed_joints(found) - human.posed_joints(body), axis=1)
    assert gaps.mean() < 0.001 * body.scale
    turns = Rotation.from_matrix(found.rotations.transpose(0, 2, 1) @ body.rotations)
    assert np.degrees(turns.magnitude()).max() < 1.0


def test_a_few_vertices_far_off_do_not_matter(human: SkinnedTemplate) -> None:
    body = random_body(5)
    vertices = human.decode(body)
    vertices[::40] += 0.3
    found = fit_vertices(human, roughly(body, 5), vertices).body
    gaps = np.linalg.norm(human.posed_joints(found) - human.posed_joints(body), axis=1)
    assert gaps.mean() < 0.003 * body.scale


def test_a_known_scale_is_kept(human: SkinnedTemplate) -> None:
    body = replace(random_body(6), shape=np.array([2.0, 0.0, 0.0]))
    start = roughly(body, 6)
    known = fit_vertices(human, start, human.decode(body), float(np.log(body.scale))).body
    assert known.scale == pytest.approx(body.scale, rel=1e-3)
    assert known.shape == pytest.approx(body.shape, abs=0.05)


def test_a_fit_stops_at_its_deadline(human: SkinnedTemplate) -> None:
    body = random_body(7)
    with pytest.raises((TooComplex, Overloaded)), deadline.limit(0.0):
        fit_vertices(human, body, human.decode(body))
