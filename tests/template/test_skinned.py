from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from service.template.anatomy import JOINTS, PARENTS, limits
from service.template.skinned import NAMES, Body, SkinnedTemplate, body_of
from service.template.skinning import pose_joints, skin

COUNT = 40


def random_template(rng: np.random.Generator, features: int = 0) -> SkinnedTemplate:
    return SkinnedTemplate(
        name="human",
        label="Human body",
        points=2048,
        rest=rng.normal(size=(COUNT, 3)),
        shapedirs=0.1 * rng.normal(size=(COUNT, 3, 3)),
        joints=rng.normal(size=(24, 3)),
        joint_dirs=0.1 * rng.normal(size=(24, 3, 3)),
        weights=rng.dirichlet(np.full(24, 0.1), COUNT),
        posedirs=0.01 * rng.normal(size=(COUNT, 3, features)),
        faces=rng.integers(0, COUNT, (30, 3)),
        shape_labels=("a", "b", "c"),
        digest="sha256-0",
    )


def random_body(rng: np.random.Generator) -> Body:
    vectors = rng.uniform(*limits())
    vectors[0] *= 0.5
    return body_of(vectors, rng.normal(size=3), 1.7, rng.normal(size=3))


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(0)


@pytest.fixture
def template(rng: np.random.Generator) -> SkinnedTemplate:
    return random_template(rng)


def test_parameters_are_named_in_their_order(template: SkinnedTemplate) -> None:
    assert len(NAMES) == len(set(NAMES)) == 75
    assert NAMES[:3] == ("global_orient_x", "global_orient_y", "global_orient_z")
    assert NAMES[3 * JOINTS.index("left_elbow") + 1] == "left_elbow_y"
    assert NAMES[-3:] == ("shape_0", "shape_1", "shape_2")


def test_parameters_come_back_as_they_were_given(rng: np.random.Generator) -> None:
    body = random_body(rng)
    parameters = body.parameters
    assert parameters.shape == (75,)
    same = body.with_parameters(parameters)
    assert np.abs(same.rotations - body.rotations).max() < 1e-12
    assert np.array_equal(same.shape, body.shape)
    assert same.scale == body.scale
    assert np.array_equal(same.translation, body.translation)
    other = parameters.copy()
    other[NAMES.index("left_knee_x")] = 0.7
    other[NAMES.index("shape_1")] = -2.0
    assert np.abs(body.with_parameters(other).parameters - other).max() < 1e-9


def test_a_body_at_rest_is_the_template(template: SkinnedTemplate) -> None:
    body = template.at_rest()
    assert np.abs(template.decode(body) - template.rest).max() < 1e-12
    assert np.abs(template.posed_joints(body) - template.joints).max() < 1e-12
    assert np.abs(body.parameters).max() == 0.0


def test_decoding_shapes_then_skins_then_places(
    rng: np.random.Generator, template: SkinnedTemplate
) -> None:
    body = random_body(rng)
    vertices, joints = template.shaped(body.shape)
    assert np.allclose(
        vertices, template.rest + np.einsum("vcs,s->vc", template.shapedirs, body.shape)
    )
    turned, placed = pose_joints(body.rotations, joints, PARENTS)
    posed = skin(vertices, template.weights, joints, turned, placed)
    assert np.allclose(template.decode(body), 1.7 * posed + body.translation, atol=1e-12)
    assert np.allclose(template.posed_joints(body), 1.7 * placed + body.translation, atol=1e-12)


def test_pose_correctives_follow_the_rotations(rng: np.random.Generator) -> None:
    template = random_template(rng, features=207)
    plain = SkinnedTemplate(**{**vars(template), "posedirs": np.zeros((COUNT, 3, 0))})
    rest = template.at_rest()
    assert np.allclose(template.decode(rest), template.rest, atol=1e-12)
    turned_root = rest.turned(Rotation.from_rotvec([0.3, 1.0, 0.2]).as_matrix(), template.joints[0])
    assert np.allclose(template.decode(turned_root), plain.decode(turned_root), atol=1e-12)
    body = random_body(rng)
    moved = plain.rest + template.posedirs @ (body.rotations[1:] - np.eye(3)).ravel()
    corrected = SkinnedTemplate(**{**vars(plain), "rest": moved})
    assert np.allclose(template.decode(body), corrected.decode(body), atol=1e-12)
    assert not np.allclose(template.decode(body), plain.decode(body), atol=1e-3)


def test_a_turned_body_is_the_turned_vertices(
    rng: np.random.Generator, template: SkinnedTemplate
) -> None:
    body, rotation = random_body(rng), Rotation.random(rng=rng).as_matrix()
    pivot = template.shaped(body.shape)[1][0]
    expected = template.decode(body) @ rotation.T
    assert np.allclose(template.decode(body.turned(rotation, pivot)), expected, atol=1e-12)


def test_transforms_map_points_from_rest_to_space(
    rng: np.random.Generator, template: SkinnedTemplate
) -> None:
    body = random_body(rng)
    vertices = template.shaped(body.shape)[0]
    maps, shifts = template.transforms(body)
    moved = np.einsum("vab,vb->va", maps, vertices) + shifts
    assert np.allclose(moved, template.decode(body), atol=1e-12)
    maps, shifts = template.transforms(body, template.weights[:5])
    moved = np.einsum("vab,vb->va", maps, vertices[:5]) + shifts
    assert np.allclose(moved, template.decode(body)[:5], atol=1e-12)
