"""The meshes that are sent: templates at ordinary values, in as many vertices as is asked for."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh

from service.template.bodyfile import load_body
from service.template.loader import load_template
from service.template.skinned import body_of

from .client import GENERATOR

CATEGORIES = ("chair", "airplane", "human")


@dataclass(frozen=True)
class Mesh:
    """A file of a category, and the name of a parameter that it has."""

    category: str
    name: str
    data: bytes
    parameter: str


def generated(category: str, vertices: int) -> Mesh:
    """A GLB of at least so many vertices, standing on y = 0, in metres."""
    if category == "human":
        body = load_body()
        points, faces = (
            body.decode(body_of(np.zeros((24, 3)), np.zeros(3), 1.0, np.zeros(3))),
            body.faces,
        )
        parameter = "left_elbow_y"
    else:
        template = load_template(category)
        points = template.decode([sum(p.typical) / 2 for p in template.parameters])
        faces = template.faces
        parameter = "seat_width" if category == "chair" else "wing_length"
    points = points - [0.0, points[:, 1].min(), 0.0]
    while len(points) < vertices:
        points, faces = trimesh.remesh.subdivide(points, faces)
    mesh = trimesh.Trimesh(points, faces, process=False)
    data = bytes(mesh.export(file_type="glb"))
    assert GENERATOR in data
    return Mesh(category, f"{category}.glb", data, parameter)


def read(path: Path, category: str, parameter: str) -> Mesh:
    """A file of your own."""
    return Mesh(category, path.name, path.read_bytes(), parameter)
