"""What was measured and told already, kept in a file for a run that goes on."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path


class Kept:
    """Texts by name, a line of JSON each."""

    def __init__(self, path: Path) -> None:
        """
        Args:
            path: of the file; it is made with the first text.
        """
        self._path = path
        self._texts: dict[str, str] = {}
        for line in path.read_text("utf-8").splitlines() if path.is_file() else ():
            try:
                name, text = json.loads(line)
            except json.JSONDecodeError:
                # The line that a run was cut off at.
                continue
            self._texts[name] = text

    def get(self, name: str, make: Callable[[], str]) -> str:
        """The text of a name, made where there is none."""
        if name not in self._texts:
            self._texts[name] = make()
            with self._path.open("a", encoding="utf-8") as file:
                file.write(json.dumps([name, self._texts[name]]) + "\n")
        return self._texts[name]
