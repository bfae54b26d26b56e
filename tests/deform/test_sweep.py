from __future__ import annotations

import numpy as np
import pytest
from boxes import ORIGIN, PARAMETERS, chair
from planes import (
    VALUES,
    airplane,
    of_part,
    plane,
    plane_change,
    plane_mesh,
    plane_values,
)

from service.deform.binding import inverse_frames
from service.deform.blend import bind
from service.deform.loft import lofts
from service.deform.proximity import Boxes
from service.deform.roots import rooted
from service.deform.sweep import swept
from service.template.affine import AffineTemplate

FIN = airplane().parts.index("vertical_stabilizer")
OWN = 0.4 * VALUES["vertical_stabilizer_length"] / 0.15
"""The angle of the template's fin, which begins within the fuselage and is 0.15 long in all."""
LENGTH = airplane().names.index("vertical_stabilizer_length")


def mesh(factor: float) -> tuple[np.ndarray, np.ndarray]:
    """The airplane with a fin that is swept so many times as much as its template's."""
    vertices, faces = plane_mesh()
    fin = of_part("vertical_stabilizer")
    height = vertices[fin, 1] - vertices[fin, 1].mean()
    vertices[fin, 2] -= (factor - 1.0) * OWN * height
    return vertices, faces


def found(vertices: np.ndarray, faces: np.ndarray) -> tuple[AffineTemplate, AffineTemplate]:
    """The airplane's template before and after it has seen a mesh."""
    f = plane_values()
    cut, starts = rooted(plane(), f)
    maps = cut.maps(f)
    parts = lofts(cut, f, maps.frames, maps.tapers, starts)
    boxes = Boxes(maps.frames, inverse_frames(maps.frames), parts)
    return cut, swept(cut, f, boxes, boxes.local(vertices - ORIGIN), faces)


def slope(template: AffineTemplate) -> float:
    """How far the fin's tip goes back, in the length that is added to the fin."""
    rows = template.frame_jacobian[FIN, :, 3, LENGTH] + (
        template.frame_jacobian[FIN, :, 1, LENGTH] / 2
    )
    return float(-rows[2] / rows[1])


@pytest.mark.parametrize("factor", [0.3, 1.0, 1.8])
def test_a_fin_goes_on_as_it_is_swept(factor: float) -> None:
    _, after = found(*mesh(factor))
    assert slope(after) == pytest.approx(factor * OWN, abs=0.02)


def test_the_template_stays_what_it_is_at_the_fit() -> None:
    before, after = found(*mesh(1.8))
    f = plane_values()
    np.testing.assert_allclose(after.frames(f), before.frames(f), atol=1e-12)
    others = np.arange(len(f)) != LENGTH
    np.testing.assert_array_equal(
        after.frame_jacobian[..., others], before.frame_jacobian[..., others]
    )


def test_a_t_tail_goes_back_with_it() -> None:
    vertices, faces = mesh(1.8)
    binding = bind(vertices, faces, plane(), plane_values(), ORIGIN)
    moved = binding.displace(plane_change("vertical_stabilizer_length", 1.25))
    tail = of_part("left_horizontal_stabilizer")
    np.testing.assert_allclose(moved[tail, 2], -1.8 * OWN * moved[tail, 1], rtol=0.03)


def test_without_a_fin_to_be_seen_the_template_is_the_same() -> None:
    vertices, faces = plane_mesh()
    without = faces[~of_part("vertical_stabilizer")[faces[:, 0]]]
    before, after = found(vertices, without)
    assert after is before
    before, after = found(vertices, faces[:0])
    assert after is before


def test_a_fin_of_several_pieces_is_seen_as_one() -> None:
    vertices, faces = mesh(1.5)
    # A rudder: the faces behind the middle have vertices of their own.
    fin = of_part("vertical_stabilizer")[faces[:, 0]]
    behind = fin & (vertices[faces, 2] < vertices[faces[fin], 2].mean()).all(axis=1)
    apart = np.concatenate([vertices, vertices])
    parted = np.where(behind[:, None], faces + len(vertices), faces)
    _, after = found(apart, parted)
    assert slope(after) == pytest.approx(1.5 * OWN, abs=0.03)


def test_chairs_have_nothing_that_sweeps() -> None:
    maps = chair().maps(PARAMETERS)
    boxes = Boxes(maps.frames, inverse_frames(maps.frames))
    template = chair()
    vertices = template.decode(PARAMETERS)
    same = swept(template, PARAMETERS, boxes, boxes.local(vertices), template.faces)
    assert same is template
