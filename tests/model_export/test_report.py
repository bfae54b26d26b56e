from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from matplotlib import image, pyplot

from model_export.pictures import YELLOW, Panel
from model_export.report import describe, draw_report

LOG: list[dict[str, Any]] = [
    {"step": 10 * n, "loss": 1 / n, "sem": 2 / n, "rec": 0.1 / n, "within": [0.1 * n, 0.2, 0.3]}
    for n in range(1, 6)
]
ROW = {
    "vertices_within_percent": [41.26, 82.0, 99.0],
    "edited_within_percent": [31.0, 72.0, 89.0],
    "mean_error_percent_of_range": {"width": 3.14, "height": 2.72},
}


CARD = {
    "name": "stool",
    "label": "Stool",
    "version": "1.2.0",
    "training": {"hours": 0.1, "runs": [{"steps": 40}, {"steps": 10}]},
    "data": {"realistic": {"train": 8, "test": 2}},
    "metrics": {"synthetic": {"shapes": 7, "constant": ROW, "encoder": ROW, "refined": ROW}},
}
MODEL: Any = SimpleNamespace(card=CARD, template=SimpleNamespace(names=("width", "height")))


def test_the_words_say_what_the_figures_are() -> None:
    text = describe(MODEL, LOG, real=False)
    assert text.startswith("# Stool: stool 1.2.0\n")
    assert "50 steps in 0.1 hours; 8 real shapes to train on, 2 held out." in text
    assert "fresh template shapes" in text
    assert "| encoder alone | 41.3 | 82.0 | 99.0 | 31.0 | 72.0 | 89.0 |" in text
    assert "| always the mean (to compare with) | 41.3" in text
    assert "| `width` | 3.1 | 3.1 | 3.1 |" in text
    assert "Last loss: 0.2, at step 50." in text
    assert "held-out real shapes" in describe(MODEL, LOG, real=True)
    assert "Last loss" not in describe(MODEL, [], real=True)


@pytest.mark.parametrize("log", [LOG, json.loads("[]")])
def test_the_picture_has_curves_above_and_fits_below(log: Any, tmp_path: Path) -> None:
    square = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], float)
    panel = Panel("p", [(square, np.array([[0, 1, 2], [0, 2, 3]]), YELLOW, 1.0)])
    open_before = pyplot.get_fignums()
    draw_report(log, [panel] * 6, tmp_path / "report.png")
    assert pyplot.get_fignums() == open_before
    picture = image.imread(tmp_path / "report.png")[:, :, :3]
    yellow = ((picture[:, :, 0] > picture[:, :, 2] + 0.2) & (picture.max(axis=2) < 0.95)).sum(
        axis=1
    )
    third = len(picture) // 3
    assert yellow[third + 20 :].sum() > 5 * yellow[:third].sum()
    assert yellow[-len(picture) // 4 :].any()
