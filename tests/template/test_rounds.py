from __future__ import annotations

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from service.template.rounds import ROUND_SIDES, ellipsoid, fuselage, tube
from service.template.unitshape import UnitShape

AROUND = st.integers(1, 6).map(lambda n: 4 * n)
ALONG = st.integers(3, 12)
POWER = st.floats(1.5, 6.0)


def solid(shape: UnitShape) -> trimesh.Trimesh:
    mesh = trimesh.Trimesh(shape.vertices, shape.faces, process=False)
    mesh.merge_vertices()
    return mesh


def check_whole(shape: UnitShape) -> None:
    """Closed, looking outwards, and just inside the unit cube."""
    mesh = solid(shape)
    assert mesh.is_watertight
    assert mesh.volume > 0
    np.testing.assert_allclose(mesh.bounds, [[-0.5] * 3, [0.5] * 3], atol=1e-12)
    assert shape.faces.dtype == np.int64
    assert len(shape.side) == len(shape.faces)
    assert shape.sides == ROUND_SIDES


@settings(max_examples=15)
@given(AROUND, ALONG, POWER)
def test_a_tube_is_closed_by_flat_ends_of_its_own(around: int, along: int, power: float) -> None:
    shape = tube((around, along), power)
    check_whole(shape)
    assert len(shape.vertices) == around * (along + 1) + 2 * (around + 1)
    for side, z in ((0, -0.5), (1, 0.5)):
        assert (shape.vertices[shape.faces[shape.side == side]][..., 2] == z).all()
    owners = [set(shape.faces[shape.side == side].ravel()) for side in range(3)]
    assert sum(map(len, owners)) == len(set.union(*owners)) == len(shape.vertices)


def test_a_tube_comes_near_a_cylinder_and_a_square_one_near_a_cube() -> None:
    assert solid(tube((64, 3))).volume == pytest.approx(np.pi / 4, rel=2e-3)
    assert solid(tube((64, 3), power=30.0)).volume == pytest.approx(1.0, rel=0.05)


@settings(max_examples=15)
@given(AROUND, st.integers(2, 6).map(lambda n: 2 * n), POWER)
def test_an_ellipsoid_is_closed(around: int, along: int, power: float) -> None:
    shape = ellipsoid((around, along), power)
    check_whole(shape)
    assert len(shape.vertices) == around * (along - 1) + 2


def test_a_plain_ellipsoid_is_a_ball() -> None:
    shape = ellipsoid((48, 24))
    np.testing.assert_allclose(np.linalg.norm(shape.vertices, axis=1), 0.5, atol=1e-12)
    assert solid(shape).volume == pytest.approx(np.pi / 6, rel=0.02)


@settings(max_examples=15)
@given(AROUND, st.integers(10, 40), st.floats(0.05, 0.5), st.floats(0.05, 0.5), st.floats(-1, 1))
def test_a_fuselage_is_closed(
    around: int, along: int, nose: float, tail: float, upsweep: float
) -> None:
    shape = fuselage((around, along), nose, tail, upsweep)
    check_whole(shape)
    assert len(shape.vertices) == around * (along - 1) + 2


def test_a_fuselage_is_straight_between_a_blunt_nose_and_a_tail_that_rises() -> None:
    shape = fuselage((20, 40), nose=0.2, tail=0.4, upsweep=1.0)
    rings = shape.vertices[:-2].reshape(39, 20, 3)
    z, width = rings[:, 0, 2], np.ptp(rings[..., 0], axis=1)
    straight = (z > -0.1) & (z < 0.3)
    assert straight.sum() > 5
    np.testing.assert_allclose(width[straight], 1.0)
    # An ellipse ahead, a parabola behind; swept up all the way, its top line stays level.
    np.testing.assert_allclose(width[z > 0.3], np.sqrt(1 - ((z[z > 0.3] - 0.3) / 0.2) ** 2))
    np.testing.assert_allclose(width[z < -0.1], 1 - ((-0.1 - z[z < -0.1]) / 0.4) ** 2)
    np.testing.assert_allclose(rings[z < 0.3][..., 1].max(axis=1), 0.5)
    np.testing.assert_allclose(shape.vertices[-2:], [[0, 0.5, -0.5], [0, 0, 0.5]], atol=1e-12)


@pytest.mark.parametrize(("nose", "tail"), [(0.0, 0.5), (0.5, -0.1), (0.6, 0.5)])
def test_a_fuselage_needs_room_for_nose_and_tail(nose: float, tail: float) -> None:
    with pytest.raises(ValueError, match="are not positive shares"):
        fuselage((8, 8), nose, tail)
