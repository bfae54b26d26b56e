from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from matplotlib import image, pyplot

from model_export.pictures import BLUE, YELLOW, Panel, draw, save_sheet, view

SQUARE = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], float)
TWO = np.array([[0, 1, 2], [0, 2, 3]])


@pytest.mark.parametrize(("azimuth", "elevation"), [(0, 0), (35, 20), (-70, 80), (180, -30)])
def test_a_view_is_a_rotation(azimuth: float, elevation: float) -> None:
    camera = view(azimuth, elevation)
    np.testing.assert_allclose(camera @ camera.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(camera) == pytest.approx(1.0)


def test_a_view_looks_from_where_it_says() -> None:
    np.testing.assert_allclose(view(0, 0), np.eye(3), atol=1e-12)
    # From above and from the side what points to the eye is up, and left or right.
    np.testing.assert_allclose(view(0, 90) @ [0, 1, 0], [0, 0, 1], atol=1e-12)
    np.testing.assert_allclose(view(90, 0) @ [1, 0, 0], [0, 0, 1], atol=1e-12)
    assert (view(35, 20) @ [0, 1, 0])[1] > 0.9


def drawn(panel: Panel) -> np.ndarray:
    """The picture that `draw` makes, red, green, blue and opacity."""
    figure, axes = pyplot.subplots()
    draw(axes, panel, np.eye(3))
    (shown,) = axes.images
    pyplot.close(figure)
    return np.asarray(shown.get_array())


def test_near_faces_are_drawn_over_far_ones() -> None:
    near, far = SQUARE + np.eye(3)[2], 1.5 * SQUARE - np.eye(3)[2]
    for order in ((near, far), (far, near)):
        colours = [YELLOW if mesh is near else BLUE for mesh in order]
        meshes = [(mesh, TWO, colour, 1.0) for mesh, colour in zip(order, colours, strict=True)]
        picture = drawn(Panel("two", meshes))
        centre, edge = picture[240, 240, :3], picture[240, 60, :3]
        for pixel, colour in ((centre, YELLOW), (edge, BLUE)):
            np.testing.assert_allclose(pixel / pixel.max(), np.array(colour) / max(colour))


def test_faces_may_have_colours_of_their_own() -> None:
    colours = np.array([YELLOW, BLUE])
    picture = drawn(Panel("t", [(SQUARE, TWO, colours, 1.0)]))
    for pixel, colour in ((picture[300, 350, :3], YELLOW), (picture[150, 150, :3], BLUE)):
        np.testing.assert_allclose(pixel / pixel.max(), np.array(colour) / max(colour))


def test_a_sheet_holds_a_panel_a_cell(tmp_path: Path) -> None:
    path = tmp_path / "sheet.png"
    panels = [Panel(f"p{i}", [(SQUARE, TWO, YELLOW, 1.0)]) for i in range(3)]
    open_before = pyplot.get_fignums()
    save_sheet(panels, path, columns=2, size=1.0, camera=np.eye(3))
    assert pyplot.get_fignums() == open_before
    picture = image.imread(path)[:, :, :3]
    height, width, _ = picture.shape
    assert (height, width) == (220, 220)
    yellow = (picture[:, :, 0] > picture[:, :, 2] + 0.2) & (picture.max(axis=2) < 0.95)
    cells = [yellow[y : y + 110, x : x + 110].mean() for y in (0, 110) for x in (0, 110)]
    assert min(cells[:3]) > 0.15
    assert cells[3] == 0


def test_a_sheet_looks_from_the_front_right_unless_told(tmp_path: Path) -> None:
    panel = [Panel("p", [(SQUARE, TWO, YELLOW, 1.0)])]
    save_sheet(panel, tmp_path / "a.png", columns=1, size=1.0)
    save_sheet(panel, tmp_path / "b.png", columns=1, size=1.0, camera=view())
    save_sheet(panel, tmp_path / "c.png", columns=1, size=1.0, camera=view(80, 0))
    a, b, c = (image.imread(tmp_path / f"{name}.png") for name in "abc")
    assert np.array_equal(a, b)
    assert not np.array_equal(a, c)
