from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from service.encode.bodyestimate import SIGMA_ENCODER, BodyEstimate, estimate_body, opposes
from service.encode.bodyoutputs import BodyEncoding
from service.encode.distance import Cloud
from service.mesh.frame import Orientation, orientations
from service.mesh.surface import Normalization, Samples, sample_surface
from service.template.anatomy import JOINTS
from service.template.bodyfile import load_body
from service.template.skinned import Body, SkinnedTemplate, body_of

COUNT = len(JOINTS)
STANDING = body_of(np.zeros((COUNT, 3)), np.array([0.5, -0.5, 0.5]), 1.0, np.zeros(3))


class Known:
    """A model that knows a body: its encoder nearly, if it sees it upright, and which way it is."""

    def __init__(self, body: Body, samples: Samples, certain: bool = True) -> None:
        self.template = load_body()
        self.discriminator = self
        self.body = body
        self.frame = Normalization.of(samples.points)
        self.certain = certain
        self.asked = 0

    def odds(self, cloud: NDArray[np.float64], ways: Sequence[Orientation]) -> NDArray[np.float64]:
        """How well a way of turning it stands the body up."""
        up = [(way.rotation @ self.body.rotations[0]).trace() for way in ways]
        return np.array(up) * (10.0 if self.certain else 1.0)

    def encode(self, points: NDArray[np.float64]) -> BodyEncoding:
        """The truth, a bit off, turned as the points are."""
        self.asked += 1
        joints = self.frame.apply(self.template.posed_joints(self.body))
        there = BodyEncoding(
            joints + 0.01 * np.random.default_rng(0).standard_normal(joints.shape),
            self.body.rotations,
            np.zeros(3),
            self.frame.scale * 1.05,
        )
        for way in orientations():
            if np.allclose(way.to_canonical(self.points), points):
                return there.turned(way.rotation)
        raise AssertionError("no view of the cloud")

    points: NDArray[np.float64]


def seen(body: Body, human: SkinnedTemplate) -> Samples:
    return sample_surface(human.decode(body), human.faces, 1500, np.random.default_rng(1))


def estimated(body: Body, certain: bool = True, **options: object) -> tuple[BodyEstimate, Known]:
    samples = seen(body, load_body())
    model = Known(body, samples, certain)
    model.points = model.frame.apply(samples.points)
    return estimate_body(model, samples, **({"refined": True} | options)), model  # type: ignore[arg-type]


def joints_of(answer: BodyEstimate) -> NDArray[np.float64]:
    return answer.normalization.invert(load_body().posed_joints(answer.body))


@pytest.mark.parametrize("turn", [(0, 0, 0), (0, 90, 0), (0, 30, 180), (90, 0, 20), (-90, 70, 5)])
def test_a_body_is_found_any_way_up(turn: tuple[int, int, int]) -> None:
    rotation = Rotation.from_euler("xyz", turn, degrees=True).as_matrix()
    body = STANDING.turned(rotation, load_body().joints[0])
    answer, _ = estimated(body)
    gaps = np.linalg.norm(joints_of(answer) - load_body().posed_joints(body), axis=1)
    assert gaps.mean() < 0.012
    between = Rotation.from_matrix(answer.body.rotations[0].T @ body.rotations[0])
    assert np.degrees(between.magnitude()) < 5
    assert answer.distance < 0.01
    assert answer.distance < answer.encoder_distance
    assert not answer.inside_out


def test_close_readings_are_tried() -> None:
    rotation = Rotation.from_euler("y", 44, degrees=True).as_matrix()
    body = STANDING.turned(rotation, load_body().joints[0])
    sure, model = estimated(STANDING)
    assert model.asked == 1
    torn, model = estimated(body, certain=False)
    assert model.asked > 1
    assert abs(torn.distance - sure.distance) < 0.003


def test_without_refinement_the_encoder_speaks_alone() -> None:
    answer, _ = estimated(STANDING, refined=False)
    assert answer.distance == answer.encoder_distance
    assert (answer.sigma == SIGMA_ENCODER).all()
    refined, _ = estimated(STANDING)
    assert refined.distance < answer.distance
    assert (refined.sigma < SIGMA_ENCODER).mean() > 0.8


def test_a_believable_unit_tells_the_stature() -> None:
    tall = replace(STANDING, shape=np.array([2.0, 0.0, 0.0]))
    answer, _ = estimated(tall, metre=1.0)
    assert answer.body.scale / answer.normalization.scale == pytest.approx(1.0, rel=0.02)
    assert answer.body.shape[0] == pytest.approx(2.0, abs=0.3)
    unknown, _ = estimated(tall)
    assert unknown.body.shape[0] < answer.body.shape[0]
    strange, _ = estimated(tall, metre=1000.0)
    assert strange.body.shape == pytest.approx(unknown.body.shape)


def test_a_body_that_is_inside_out_is_found_all_the_same() -> None:
    human = load_body()
    samples = seen(STANDING, human)
    model = Known(STANDING, samples)
    model.points = model.frame.apply(samples.points)
    turned = replace(samples, normals=-samples.normals)
    answers = [estimate_body(model, s, refined=True) for s in (samples, turned)]
    assert [answer.inside_out for answer in answers] == [False, True]
    assert answers[0].body.shape == pytest.approx(answers[1].body.shape)
    cloud = Cloud(samples.points, samples.normals)
    assert not opposes(human, STANDING, cloud)
    assert opposes(human, STANDING, Cloud(cloud.points, -cloud.normals))
