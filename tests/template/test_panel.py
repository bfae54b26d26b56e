from __future__ import annotations

import numpy as np
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from service.template.panel import panel

CELLS = st.tuples(st.integers(1, 8), st.integers(3, 12))


@settings(max_examples=15)
@given(CELLS)
def test_a_panel_is_closed_and_looks_outwards(cells: tuple[int, int]) -> None:
    shape = panel(cells)
    along, chord = cells
    assert len(shape.vertices) == 2 * chord * (along + 3)
    mesh = trimesh.Trimesh(shape.vertices, shape.faces, process=False)
    mesh.merge_vertices()
    assert mesh.is_watertight
    assert mesh.volume > 0.4
    np.testing.assert_allclose(mesh.bounds, [[-0.5] * 3, [0.5] * 3], atol=1e-12)
    sizes = np.linalg.norm(trimesh.triangles.cross(shape.vertices[shape.faces]), axis=1)
    assert (sizes > 0).all()


def test_the_ends_are_flat_and_have_vertices_of_their_own() -> None:
    shape = panel((3, 5))
    assert shape.sides == ("start", "end", "around")
    for side, x in ((0, -0.5), (1, 0.5)):
        assert (shape.vertices[shape.faces[shape.side == side]][..., 0] == x).all()
    owners = [set(shape.faces[shape.side == side].ravel()) for side in range(3)]
    assert sum(map(len, owners)) == len(set.union(*owners)) == len(shape.vertices)


def test_the_section_is_a_wings_blunt_in_front_and_sharp_behind() -> None:
    outline = panel((1, 16)).vertices[:32, 1:]
    y, z = outline.T
    np.testing.assert_allclose(outline[0], [0.0, 0.5], atol=1e-12)
    np.testing.assert_allclose(outline[16], [0.0, -0.5], atol=1e-12)
    np.testing.assert_allclose(y[1:16], -y[:16:-1], atol=1e-12)
    thickest = z[y.argmax()]
    assert 0.15 < thickest < 0.25, "at some 30 % of the chord from the leading edge"
    # Two percent of the chord from either edge: thick in front, thin behind.
    front, rear = np.interp([0.48, -0.48], z[16::-1], y[16::-1])
    assert front > 4 * rear
