"""A chair, an airplane and a body made for the purpose, and the studio that draws them."""

from __future__ import annotations

from pathlib import Path

import pytest
import trimesh

from model_export.detailed import detailed_airplane, detailed_chair
from model_export.figures.studio import Studio
from service.encode.model import SHIPPED, load_models
from service.template.skinned import Body, SkinnedTemplate


@pytest.fixture(scope="session")
def folders(
    human: SkinnedTemplate, strider: Body, tmp_path_factory: pytest.TempPathFactory
) -> dict[str, Path]:
    """A folder of each kind, with one mesh in it."""
    root = tmp_path_factory.mktemp("real")
    chair, plane = detailed_chair(0), detailed_airplane(0)
    made = {
        "chairs": ("chair.obj", chair.mesh(chair.parameters), chair.faces),
        "airplanes": ("plane.glb", plane.mesh(plane.parameters), plane.faces),
        "humans": ("body.ply", human.decode(strider), human.faces),
    }
    for kind, (name, vertices, faces) in made.items():
        (root / kind).mkdir()
        trimesh.Trimesh(vertices, faces, process=False).export(root / kind / name)
    return {kind: root / kind for kind in made}


@pytest.fixture(scope="session")
def studio(folders: dict[str, Path], tmp_path_factory: pytest.TempPathFactory) -> Studio:
    """Of the shipped models."""
    return Studio(load_models(SHIPPED), folders, tmp_path_factory.mktemp("sheets"))
