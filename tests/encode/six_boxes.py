"""A chair of six boxes whose network answers the same to every cloud."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import service.template

SIX_BOXES = (
    (Path(service.template.__file__).parent / "paper_chair.yaml")
    .read_text("utf-8")
    .replace("name: paper_chair", "name: chair")
    .replace("label: Chair of six boxes", "label: Chair")
)
ANSWER = [0.4, 0.04, 0.06, -0.2, 0.5, 0.4, 0.05, 0.0]


def rewrite(folder: Path, model: str = "chair", /, **changes: Any) -> None:
    """Change entries of a model's card; None takes one out."""
    path = folder / f"{model}.json"
    card = json.loads(path.read_text("utf-8")) | changes
    path.write_text(json.dumps({k: v for k, v in card.items() if v is not None}), "utf-8")
