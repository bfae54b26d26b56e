"""An operator's models folder, and ways to change and to spoil what is in it."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

from service.encode.catalog import SUFFIXES
from service.encode.model import SHIPPED, file_digest
from service.template.loader import BUILT_IN


def write_throne(folder: Path) -> None:
    """Put the shipped chair into a folder under the name of throne."""
    folder.mkdir()
    template = (BUILT_IN / "chair.yaml").read_text("utf-8")
    (folder / "throne.yaml").write_text(template.replace("name: chair", "name: throne"), "utf-8")
    for suffix in SUFFIXES:
        if (SHIPPED / f"chair{suffix}").is_file():
            shutil.copy(SHIPPED / f"chair{suffix}", folder / f"throne{suffix}")
    change(folder, name="throne", template_digest=file_digest(folder / "throne.yaml"))


def change(folder: Path, card: str = "throne", **entries: Any) -> None:
    """Change entries of a card; None takes one out."""
    path = folder / f"{card}.json"
    kept = {**json.loads(path.read_text("utf-8")), **entries}
    path.write_text(json.dumps({k: v for k, v in kept.items() if v is not None}), "utf-8")


def flip(path: Path) -> None:
    """Turn one bit in the middle of a file."""
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)


def cut(path: Path) -> None:
    """Leave the first half of a file."""
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def rewrite_network(folder: Path, data: bytes) -> None:
    """Put another file in the place of the encoder, and tell its digest in the card."""
    (folder / "throne.onnx").write_bytes(data)
    change(folder, digest=file_digest(folder / "throne.onnx"))


def swap_template(folder: Path) -> None:
    """Put in a template of other parameters, which the card does not vouch for."""
    text = (BUILT_IN / "debug.yaml").read_text("utf-8").replace("points: 64", "points: 2840")
    (folder / "throne.yaml").write_text(text.replace("name: debug", "name: throne"), "utf-8")
    change(folder, template_digest=None)
