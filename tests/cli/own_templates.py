"""A category of one's own, as far as its names go."""

from __future__ import annotations

from pathlib import Path


def write_stool(folder: Path) -> None:
    """Write the card and the template of a stool."""
    folder.mkdir(parents=True)
    (folder / "stool.json").write_text('{"name": "stool"}', "utf-8")
    (folder / "stool.yaml").write_text(
        "parameters:\n"
        "  leg_length: {label: Length of the legs}\n"
        "  lean: {label: Lean, nuisance: true}\n"
        "keep: {floor: [0, 0, 0]}\n",
        "utf-8",
    )
