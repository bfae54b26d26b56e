"""A variant of a mesh and all that is told of it."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from service.edited import Edited
from service.edits import Change
from service.errors import ShapeError


@dataclass(frozen=True)
class Variant:
    """One of the variants of an upload.

    Attributes:
        index: which.
        edits: what was asked of the mesh.
        provenance: what it was made from and by.
        validity: what the edit does to the mesh; see `service.augment.validity`.
        edited: the file and its report; None where no draw left the mesh whole.
        problem: why there is none.
    """

    index: int
    edits: Mapping[str, Change]
    provenance: Mapping[str, Any]
    validity: Mapping[str, float]
    edited: Edited | None = None
    problem: ShapeError | None = None

    @property
    def status(self) -> str:
        """``ok``, or ``rejected`` where there is no file."""
        return "ok" if self.edited else "rejected"

    @property
    def name(self) -> str | None:
        """A file name for it: ``007.glb``."""
        return f"{self.index:03d}.{self.edited.format}" if self.edited else None

    @cached_property
    def sha256(self) -> str | None:
        """Digest of the file, in hex."""
        return hashlib.sha256(self.edited.data).hexdigest() if self.edited else None

    def row(self) -> dict[str, Any]:
        """All that is told of it, as JSON takes it; ``file`` is its name alone."""
        report = self.edited.report if self.edited else {}
        return {
            "index": self.index,
            "status": self.status,
            "file": self.name,
            "sha256": self.sha256,
            "format": self.edited.format if self.edited else None,
            "parameters": _after(report, "parameters"),
            "derived": _after(report, "derived"),
            "edits": {name: {change.kind: change.amount} for name, change in self.edits.items()},
            "validity": dict(self.validity),
            "provenance": dict(self.provenance),
            "warnings": report.get("warnings", []),
            "problem": {"code": self.problem.code, "detail": self.problem.detail}
            if self.problem
            else None,
        }


def _after(report: Mapping[str, Any], kind: str) -> dict[str, dict[str, Any]]:
    """Values after the edit, with their units."""
    return {
        name: {"value": change["after"], "unit": change["unit"]}
        for name, change in report.get(kind, {}).items()
    }
