from __future__ import annotations

import numpy as np
import pytest
from boxes import ORIGIN, PARAMETERS, block, chair, joined, template_mesh

from service.deform.measured import Level, find_levels

SEAT_TOP = float(ORIGIN[1] + PARAMETERS[2] / 2)
LOW = SEAT_TOP - 0.01


def level(vertices: np.ndarray, faces: np.ndarray) -> Level | None:
    return find_levels(vertices, faces, chair(), PARAMETERS, ORIGIN).get("seat_top_height")


def height(vertices: np.ndarray, faces: np.ndarray) -> float | None:
    found = level(vertices, faces)
    return None if found is None else float(found.of(vertices[:, 1]))


def slab(top: float, half: float = 0.2) -> tuple[np.ndarray, np.ndarray]:
    """A board whose upper side lies at a height above the template's seat."""
    y = PARAMETERS[2] / 2
    return block((-half, y + top - 0.02, -half), (half, y + top, half))


def test_the_template_itself_is_measured_where_it_is() -> None:
    assert height(*template_mesh()) == pytest.approx(SEAT_TOP)


@pytest.mark.parametrize("top", [-0.08, -0.01, 0.03, 0.1])
def test_a_seat_that_the_fit_has_missed_is_found(top: float) -> None:
    assert height(*slab(top)) == pytest.approx(SEAT_TOP + top)


def test_the_cushion_counts_and_not_the_board_below() -> None:
    assert height(*joined(slab(-0.02), slab(0.04, 0.15))) == pytest.approx(SEAT_TOP + 0.04)


def test_neither_winding_nor_a_missing_underside_matters() -> None:
    vertices, faces = slab(0.02)
    assert height(vertices, faces[:, ::-1]) == pytest.approx(SEAT_TOP + 0.02)
    upper = vertices[faces][:, :, 1].min(axis=1) >= SEAT_TOP + 0.02 - 1e-9
    assert 0 < upper.sum() < len(faces)
    assert height(vertices, faces[upper]) == pytest.approx(SEAT_TOP + 0.02)


def test_what_lies_on_the_seat_does_not_count() -> None:
    book = block((-0.05, 0.025, -0.02), (0.0, 0.06, 0.02))
    assert height(*joined(slab(0.0), book)) == pytest.approx(SEAT_TOP)


def test_slats_are_enough_and_a_bare_frame_is_not() -> None:
    slats = [block((x, 0.0, -0.2), (x + 0.02, 0.025, 0.2)) for x in np.arange(-0.2, 0.2, 0.03)]
    assert height(*joined(*slats)) == pytest.approx(SEAT_TOP)
    rails = [block((x, 0.0, -0.2), (x + 0.02, 0.025, 0.2)) for x in (-0.2, 0.18)]
    assert level(*joined(*rails)) is None


def test_a_slope_is_no_level() -> None:
    vertices, faces = slab(0.0)
    steep = vertices + np.array([0.0, 1.0, 0.0]) * vertices[:, 2:]
    assert level(steep, faces) is None
    gentle = vertices + np.array([0.0, 0.1, 0.0]) * (vertices[:, 2:] - ORIGIN[2])
    assert height(gentle, faces) == pytest.approx(SEAT_TOP, abs=0.002)


def test_a_cloud_of_points_has_no_level() -> None:
    assert level(slab(0.0)[0], np.zeros((0, 3), np.int64)) is None


def test_a_level_moves_with_its_faces() -> None:
    vertices, faces = slab(0.03)
    found = level(vertices, faces)
    assert found is not None
    assert found.weights.sum() == pytest.approx(1.0)
    moved = vertices + np.array([0.3, 0.2, -0.1])
    np.testing.assert_allclose(found.of(moved) - found.of(vertices), [0.3, 0.2, -0.1])
