from __future__ import annotations

import numpy as np
import pytest
import trimesh

from service.template.panel import panel
from service.template.unitshape import UnitShape, rings

ORDERS = ("xyz", "yzx", "zxy", "yxz", "zyx", "xzy")


@pytest.fixture(scope="module")
def corner() -> UnitShape:
    """A triangle whose vertices lie on the three axes."""
    vertices = np.diag([0.1, 0.2, 0.3])
    return UnitShape(vertices, np.array([[0, 1, 2]]), np.array([0]), ("only",))


def test_each_axis_goes_where_it_is_told(corner: UnitShape) -> None:
    turned = corner.turned("yzx")
    np.testing.assert_array_equal(turned.vertices, [[0, 0.1, 0], [0, 0, 0.2], [0.3, 0, 0]])
    assert turned.faces.tolist() == [[0, 1, 2]]
    np.testing.assert_array_equal(corner.turned("xyz").vertices, corner.vertices)


def test_a_reflection_turns_the_faces_round(corner: UnitShape) -> None:
    turned = corner.turned("yxz")
    np.testing.assert_array_equal(turned.vertices, [[0, 0.1, 0], [0.2, 0, 0], [0, 0, 0.3]])
    assert turned.faces.tolist() == [[2, 1, 0]]


@pytest.mark.parametrize("axes", ORDERS)
def test_turned_shapes_keep_their_volume_and_look_outwards(axes: str) -> None:
    shape = panel((4, 5))
    turned = shape.turned(axes)
    volumes = [trimesh.Trimesh(s.vertices, s.faces).volume for s in (shape, turned)]
    assert volumes[1] == pytest.approx(volumes[0])
    assert volumes[0] > 0.5


def test_rings_are_the_sections_across_the_run() -> None:
    points = np.array([[1.0, 0.0, 2.0], [3.0, 0.5, 4.0], [5.0, 0.0, -2.0]])
    found = rings(points, 1)
    assert found.levels.tolist() == [0.0, 0.5]
    assert found.of.tolist() == [0, 1, 0]
    assert found.low.tolist() == [[1.0, -2.0], [3.0, 4.0]]
    assert found.high.tolist() == [[5.0, 2.0], [3.0, 4.0]]
