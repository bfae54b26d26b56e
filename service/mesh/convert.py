"""Geometry alone, written in another format than it came in."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from service.errors import InvalidRequest
from service.mesh.faults import quoted
from service.mesh.formats import READERS
from service.mesh.meshfile import Faces, Vertices

# Digits behind those of the mesh's size that text formats keep, as many as float32 does.
PRECISION = 8


def convert(vertices: Vertices, faces: Faces, format: str) -> bytes:
    """Write vertices and faces, in their order, without anything else.

    Args:
        vertices: ``[V, 3]`` positions.
        faces: ``[F, 3]`` indices into `vertices`.
        format: one of `formats.READERS`.

    Raises:
        InvalidRequest: ``unknown_format``.
    """
    if format not in READERS:
        raise InvalidRequest(
            "unknown_format",
            f"There is no format {quoted(format)} to write.",
            f"Ask for one of {', '.join(READERS)}.",
        )
    # Here: it takes a fifth of the time to start and 20 MB, and few requests ask for a format.
    import trimesh

    mesh = trimesh.Trimesh(vertices, faces, process=False)
    content: Any
    if format == "gltf":
        files: Any = mesh.export(file_type="gltf", embed_buffers=True)
        content = files["model.gltf"]
    elif format in ("obj", "off"):
        size = float(np.abs(vertices).max(initial=0.0)) or 1.0
        digits = min(max(PRECISION - math.floor(math.log10(size)), 0), 40)
        content = mesh.export(file_type=format, digits=digits)
    else:
        content = mesh.export(file_type=format)
    return content.encode() if isinstance(content, str) else bytes(content)
