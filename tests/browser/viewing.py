"""What tests of the page do over and over."""

from __future__ import annotations

import io
from collections.abc import Callable
from itertools import count

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from playwright.sync_api import Page, expect

# A machine with few cores draws by software and infers at the same time.
PATIENCE = 60_000

DESKTOP = {"width": 1280, "height": 800}

Visit = Callable[..., Page]
Viewer = Callable[[str], Page]
Shoot = Callable[[Page, str], None]
Picture = NDArray[np.int16]


def opened(page: Page, name: str) -> Page:
    """The page once a sample's sliders are there."""
    page.click(f"[data-sample={name}]")
    expect(page.locator("#panel h2")).to_be_visible()
    drawn(page)
    return page


def drawn(page: Page) -> None:
    """Wait until what was changed has been drawn."""
    page.evaluate(
        "() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"
    )


_uploads = count()


def upload(page: Page, name: str, data: bytes, suffix: str = ".glb") -> None:
    """Choose a file, as from the disk, and wait until it is open; names are never the same."""
    full = f"{name}-{next(_uploads)}{suffix}"
    file = {"name": full, "mimeType": "application/octet-stream", "buffer": data}
    page.locator("#file-input").set_input_files([file])
    expect(page.locator("#file")).to_have_text(full)


def typed(page: Page, field: str, text: str) -> None:
    """Type a value into a number field."""
    field_of = page.locator(f"#{field}")
    field_of.fill(text)
    field_of.press("Enter")
    drawn(page)


def shown(page: Page, field: str) -> float:
    """The number in a field."""
    return float(page.locator(f"#{field}").input_value())


def view(page: Page) -> Picture:
    """``[h, w, 3]`` pixels of the stage."""
    picture = Image.open(io.BytesIO(page.locator("#stage").screenshot()))
    return np.asarray(picture.convert("RGB"), np.int16)


def changed(before: Picture, after: Picture) -> float:
    """Share of the pixels that differ visibly."""
    return float((np.abs(before - after).max(axis=2) > 24).mean())
