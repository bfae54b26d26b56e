from __future__ import annotations

from dataclasses import replace

import numpy as np
import torch
from scipy.spatial import cKDTree

from model_export.bodies import TILT, BodyBatch, Garments, SyntheticBodies
from service.template.skinned import Body, SkinnedTemplate


def drawn(human: SkinnedTemplate, garments: Garments, count: int = 6) -> BodyBatch:
    return SyntheticBodies(human, garments, 3).batch(count, 800)


def body_at(batch: BodyBatch, index: int) -> Body:
    arrays = (batch.rotations, batch.shape, batch.translation)
    rotations, shape, translation = (array[index].double().numpy() for array in arrays)
    return Body(rotations, shape, float(batch.scale[index]), translation)


def off_the_skin(human: SkinnedTemplate, batch: BodyBatch, index: int) -> np.ndarray:
    """Distances of a cloud's points from the labelled body's vertices, in its metres."""
    body = body_at(batch, index)
    points = batch.points[index].double().numpy()
    distance, _ = cKDTree(human.decode(body)).query(points)
    return np.asarray(distance) / body.scale


def test_naked_bodies_are_what_their_labels_say(human: SkinnedTemplate) -> None:
    batch = drawn(human, Garments.none())
    for index in range(len(batch.points)):
        joints = human.posed_joints(body_at(batch, index))
        assert np.abs(joints - batch.joints[index].double().numpy()).max() < 1e-4
        assert off_the_skin(human, batch, index).max() < 0.05


def test_clouds_are_normalised(human: SkinnedTemplate) -> None:
    points = drawn(human, Garments()).points
    assert torch.allclose(points.mean(dim=1), torch.zeros(len(points), 3), atol=1e-5)
    radius = points.norm(dim=2).amax(dim=1)
    assert torch.allclose(radius, torch.full_like(radius, 0.6), atol=0.03)


def test_parts_tell_the_joint_that_moves_a_point(human: SkinnedTemplate) -> None:
    batch = drawn(human, Garments.none())
    body = body_at(batch, 0)
    _, nearest = cKDTree(human.decode(body)).query(batch.points[0].double().numpy())
    same = human.weights[nearest].argmax(axis=1) == batch.parts[0].numpy()
    assert same.mean() > 0.95


def test_clothes_and_hair_stand_off_the_skin(human: SkinnedTemplate) -> None:
    plain = Garments.none()
    dressed = replace(plain, cloth=0.04, hair=0.1)
    for index in range(4):
        naked = off_the_skin(human, drawn(human, plain), index)
        clad = off_the_skin(human, drawn(human, dressed), index)
        assert clad.mean() > naked.mean()
        assert clad.max() < 0.2


def test_builds_differ_from_what_the_shape_says(human: SkinnedTemplate) -> None:
    batch = drawn(human, replace(Garments.none(), build=0.1))
    gaps = [
        np.abs(human.posed_joints(body_at(batch, i)) - batch.joints[i].double().numpy()).max()
        for i in range(len(batch.points))
    ]
    assert 0.005 < np.mean(gaps) < 0.2


def test_views_from_one_side_lack_the_other(human: SkinnedTemplate) -> None:
    whole, half = drawn(human, Garments.none()), drawn(human, replace(Garments.none(), partial=1.0))
    alone = [len(np.unique(cloud.numpy(), axis=0)) for cloud in (whole.points[0], half.points[0])]
    assert alone[0] == 800
    assert 200 < alone[1] < 700


def test_holes_and_noise(human: SkinnedTemplate) -> None:
    torn = drawn(human, replace(Garments.none(), holes=1.0))
    assert len(np.unique(torn.points[0].numpy(), axis=0)) < 800
    noisy = drawn(human, replace(Garments.none(), noise=0.03))
    assert (
        off_the_skin(human, noisy, 0).mean()
        > off_the_skin(human, drawn(human, Garments.none()), 0).mean()
    )


def test_orientations_keep_to_the_angle(human: SkinnedTemplate) -> None:
    bodies = SyntheticBodies(human, Garments(tilt=1.0), 0)
    cosine = (bodies.orientations(500).diagonal(dim1=1, dim2=2).sum(1) - 1) / 2
    angle = torch.acos(cosine.clamp(-1, 1))
    assert angle.max() <= TILT + 1e-3
    assert angle.max() > 0.9 * TILT
    upright = SyntheticBodies(human, Garments.none(), 0).orientations(500)
    assert (upright[:, 1, 1] > 0.9).all()


def test_the_same_seed_draws_the_same_bodies(human: SkinnedTemplate) -> None:
    first, second = (drawn(human, Garments()) for _ in range(2))
    assert torch.equal(first.points, second.points)
    other = SyntheticBodies(human, Garments(), 4).batch(6, 800)
    assert not torch.equal(first.points, other.points)
