"""The copy of its template file that a run keeps: what was trained is what is exported."""

from __future__ import annotations

import shutil
from pathlib import Path


def template_copy(folder: Path, template: str) -> Path:
    """Where a run keeps the template file that it trains."""
    return folder / Path(template).name


def require_same_template(folder: Path, template: str) -> None:
    """Refuse to go on with a run in ``folder`` whose template file has changed since it began.

    Raises:
        ValueError: when it has.
    """
    source, copy = Path(template), template_copy(folder, template)
    if copy.is_file() and source.is_file() and copy.read_bytes() != source.read_bytes():
        raise ValueError(
            f"{source} has changed since the run in {folder} began: start anew, without --resume"
        )


def keep_template(folder: Path, template: str) -> None:
    """Make a run's folder, with its template file in it."""
    folder.mkdir(parents=True, exist_ok=True)
    source, copy = Path(template), template_copy(folder, template)
    if source.is_file() and copy.resolve() != source.resolve():
        shutil.copyfile(source, copy)
