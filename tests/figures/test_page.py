from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image

from model_export.figures.page import LINE, MARGIN, Page, write
from model_export.pictures import BLUE, YELLOW, Panel

SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
TWO = np.array([[0, 1, 2], [0, 2, 3]])
PAGE = Page(60, 80, np.eye(3))


def panel(size: float, title: str = "") -> Panel:
    return Panel(title, [(size * SQUARE, TWO, YELLOW, 1.0)])


def yellow(image: Image.Image) -> np.ndarray:
    pixels = np.asarray(image).astype(int)
    return pixels[..., 0] > pixels[..., 2] + 50


def test_rows_are_as_high_as_what_they_show() -> None:
    image = PAGE.image([[[panel(1.0)]], [[panel(2.0), Panel("", [])]]])
    height = MARGIN + 60
    assert image.size == (120, 2 * height)
    shown = yellow(image)
    assert shown[:height, :60].sum() == shown[height:, :60].sum() == 50 * 50
    assert not shown[:, 60:].any()


def test_a_picture_is_no_higher_than_the_page_has_it() -> None:
    tall = Panel("", [(SQUARE * [1, 10, 1], TWO, BLUE, 1.0)])
    assert PAGE.image([[[tall]]]).size == (60, MARGIN + 80)


def test_a_group_has_one_scale_and_frame() -> None:
    shown = yellow(PAGE.image([[[panel(1.0), panel(0.5)], [panel(0.2)]]]))
    row = MARGIN + 60
    areas = [shown[:row, :60].sum(), shown[:row, 60:].sum(), shown[row:, :60].sum()]
    assert areas == [2500, 625, 100]
    # All stand where they stood: their lower left corners are at one place.
    for part in (shown[:row, :60], shown[:row, 60:], shown[row:, :60]):
        rows, columns = np.nonzero(part)
        assert (rows.max(), columns.min()) == (MARGIN + 60 - MARGIN - 1, MARGIN)


def test_titles_stand_above_and_make_room() -> None:
    image = PAGE.image([[[panel(1.0, "one\ntwo"), panel(1.0)]]])
    assert image.size == (120, 2 * LINE + MARGIN + 60)
    dark = np.asarray(image).sum(axis=2) < 200
    assert dark[: 2 * LINE + MARGIN, :60].any()
    assert not dark[:, 60:].any()


def test_a_sheet_is_written_in_few_colours(tmp_path: Path) -> None:
    image = PAGE.image([[[panel(1.0, "one")]]])
    write(image, tmp_path / "sheet.png")
    with Image.open(tmp_path / "sheet.png") as picture:
        assert picture.mode == "P"
        difference = np.asarray(picture.convert("RGB")).astype(int) - np.asarray(image)
    assert np.abs(difference).max() < 20
