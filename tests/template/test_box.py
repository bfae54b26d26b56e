from __future__ import annotations

import numpy as np
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from service.template.box import BOX_SIDES, box
from service.template.unitshape import UnitShape

NORMALS = {
    "left": (-1, 0, 0),
    "right": (1, 0, 0),
    "bottom": (0, -1, 0),
    "top": (0, 1, 0),
    "back": (0, 0, -1),
    "front": (0, 0, 1),
}
CELLS = st.tuples(*[st.integers(1, 5)] * 3)


def crosses(shape: UnitShape) -> np.ndarray:
    """``[m, 3]`` face normals, twice the area long."""
    a, b, c = (shape.vertices[shape.faces[:, corner]] for corner in range(3))
    return np.cross(b - a, c - a)


@given(CELLS)
def test_a_box_has_one_grid_a_side(cells: tuple[int, int, int]) -> None:
    shape = box(cells)
    a, b, c = cells
    pairs = [(a, b), (b, c), (c, a)]
    assert len(shape.vertices) == 2 * sum((i + 1) * (j + 1) for i, j in pairs)
    assert len(shape.faces) == len(shape.side) == 4 * sum(i * j for i, j in pairs)
    assert shape.vertices.dtype == np.float64
    assert shape.faces.dtype == shape.side.dtype == np.int64


@given(CELLS)
def test_its_faces_close_the_unit_cube_and_look_outwards(cells: tuple[int, int, int]) -> None:
    shape = box(cells)
    solid = trimesh.Trimesh(shape.vertices, shape.faces, process=False)
    solid.merge_vertices()
    assert solid.is_watertight
    np.testing.assert_allclose(solid.volume, 1.0, atol=1e-12)
    np.testing.assert_allclose(solid.bounds, [[-0.5] * 3, [0.5] * 3])
    size = 0.5 * np.linalg.norm(crosses(shape), axis=1)
    np.testing.assert_allclose(size.sum(), 6.0, atol=1e-12)


@given(CELLS)
def test_the_cells_along_an_axis_are_even_and_as_many_as_asked(
    cells: tuple[int, int, int],
) -> None:
    shape = box(cells)
    for axis, count in enumerate(cells):
        places = np.unique(shape.vertices[:, axis].round(12))
        np.testing.assert_allclose(places, np.linspace(-0.5, 0.5, count + 1), atol=1e-12)


def test_each_face_is_on_the_side_it_is_labelled_with() -> None:
    shape = box((2, 3, 4))
    assert shape.sides == BOX_SIDES
    expected = np.array([NORMALS[shape.sides[side]] for side in shape.side])
    normals = crosses(shape)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    np.testing.assert_allclose(normals, expected, atol=1e-12)
    assert set(shape.side) == set(range(6))


def test_sides_share_no_vertices() -> None:
    shape = box((2, 3, 4))
    owners = [set(shape.faces[shape.side == side].ravel()) for side in range(6)]
    assert sum(map(len, owners)) == len(set.union(*owners)) == len(shape.vertices)
