"""Command lines that are run in this process, and boxes to run them on."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import trimesh
from click.testing import Result

Run = Callable[..., Result]


def box(width: float = 0.4, height: float = 0.8, depth: float = 0.5) -> trimesh.Trimesh:
    """A box that stands on y = 0."""
    mesh = trimesh.creation.box([width, height, depth])
    mesh.apply_translation([0.0, height / 2, 0.0])
    return mesh


def extents(path: Path) -> list[float]:
    """Width, height and depth of a mesh file."""
    return [float(e) for e in trimesh.load_mesh(path).extents]


def documents(result: Result) -> list[dict[str, Any]]:
    """The JSON that a command line wrote, a document a line."""
    return [json.loads(line) for line in result.stdout.splitlines()]
