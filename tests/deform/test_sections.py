from __future__ import annotations

import numpy as np
import pytest
from boxes import ORIGIN, block, joined

from service.deform.sections import cut
from service.deform.weld import weld


def test_each_box_is_cut_into_its_rectangle():
    mesh = joined(block((0, 0, 0), (0.1, 1, 0.2), 3), block((0.5, 0, 0), (0.7, 1, 0.1), 3))
    welded = weld(*mesh)
    sections = cut(welded.vertices - ORIGIN, welded.faces, 1, np.array([0.2, 0.5]))
    assert sections.curves == 4
    for curve in range(4):
        own = sections.points[sections.curve == curve]
        assert len(set(sections.plane[sections.curve == curve])) == 1
        extent = np.ptp(own, axis=0)
        assert extent[1] == pytest.approx(0.0, abs=1e-12)
        assert extent[[0, 2]] == pytest.approx([0.1, 0.2]) or extent[[0, 2]] == pytest.approx(
            [0.2, 0.1]
        )


def test_planes_that_miss_the_mesh_and_planes_through_vertices():
    vertices, faces = block((0, 0, 0), (1, 1, 1), 2)
    welded = weld(vertices - ORIGIN, faces)
    assert cut(welded.vertices, welded.faces, 1, np.array([2.0, 3.0])).curves == 0
    through = cut(welded.vertices, welded.faces, 1, np.array([0.5]))
    np.testing.assert_allclose(np.ptp(through.points, axis=0), [1, 0, 1], atol=1e-9)
