from __future__ import annotations

import numpy as np
import pytest
from bodies import index, template, turned

from service.deform.normals import vertex_normals
from service.deform.skinmatch import BodySurface

POSED = turned(template().at_rest(), left_shoulder=(0.0, 0.0, -1.0), right_knee=(0.9, 0.0, 0.0))


@pytest.fixture(scope="module")
def surface():
    return BodySurface.of(template(), POSED)


@pytest.fixture(scope="module")
def skin():
    vertices = template().decode(POSED)
    return vertices, vertex_normals(vertices, template().faces)


def test_the_body_is_matched_with_itself(surface, skin):
    match = surface.match(*skin)
    assert np.quantile(np.linalg.norm(match.rest - template().rest, axis=1), 0.99) < 0.01
    assert np.quantile(np.abs(match.values[:, :24] - template().weights).sum(axis=1), 0.95) < 0.1
    assert surface.sound(skin[0], match).mean() > 0.99


def test_loose_clothes_are_sound_and_far_ones_not(surface, skin):
    vertices, normals = skin
    torso = template().weights[:, index("spine2")] > 0.5
    for off, expected in ((0.03, True), (0.2, False)):
        x = vertices[torso] + off * normals[torso]
        sound = surface.sound(x, surface.match(x, normals[torso]))
        assert (sound == expected).mean() > 0.9


def test_the_inner_side_of_a_trouser_is_not_the_other_leg(surface, skin):
    vertices, normals = skin
    thigh = template().weights[:, index("left_hip")] > 0.9
    x, inward = vertices[thigh] + 0.03 * normals[thigh], -normals[thigh]
    match = surface.match(x, inward)
    other = match.values[:, index("right_hip")] > 0.5
    # Right beside the other leg it could well be that.
    right = surface.points[surface.limb == 3]
    other &= np.linalg.norm(x[:, None] - right, axis=2).min(axis=1) > 0.07
    assert other.any()
    assert not surface.sound(x, match)[other].any()


def test_matches_can_be_kept_to_one_limb(surface, skin):
    left_forearm = surface.limb == 0
    match = surface.match(*skin, within=left_forearm)
    assert (match.values[:, [index(f"left_{j}") for j in ("elbow", "wrist", "hand")]].sum(1) > 0.3
            ).all()  # fmt: skip


def test_rows_of_one_match_replace_those_of_another(surface, skin):
    whole = surface.match(*skin)
    rows = np.array([3, 5])
    arm = surface.match(skin[0][rows], skin[1][rows], within=surface.limb == 0)
    both = whole.replaced(rows, arm)
    np.testing.assert_array_equal(both.rest[rows], arm.rest)
    np.testing.assert_array_equal(np.delete(both.rest, rows, 0), np.delete(whole.rest, rows, 0))
    np.testing.assert_array_equal(both.taken(rows).values, arm.values)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_normals_are_turned_outward(surface, skin, sign):
    vertices, normals = skin
    np.testing.assert_array_equal(surface.outward(vertices, sign * normals), normals)


def test_normals_of_a_mesh_that_turns_both_ways_agree_one_by_one(surface, skin):
    vertices, normals = skin
    signs = np.where(np.random.default_rng(0).random(len(normals)) < 0.5, -1.0, 1.0)
    outward = surface.outward(vertices, signs[:, None] * normals)
    assert (np.einsum("nc,nc->n", outward, normals) > 0.0).mean() > 0.97


def test_a_skirts_middle_hangs_between_the_legs(surface):
    rest = BodySurface.of(template(), template().at_rest())
    knees = template().joints[[index("left_knee"), index("right_knee")]]
    # In front of both legs, in front of one, and out at the side.
    x = np.stack([knees.mean(axis=0), knees[0], knees[0]])
    x[:2, 2] += 0.14
    x[2, 0] += 0.14
    facing = np.array([[0.0, 0, 1], [0, 0, 1], [1, 0, 0]])
    between = rest.between_legs(x, rest.match(x, facing))
    assert between[0]
    assert not between[2]
