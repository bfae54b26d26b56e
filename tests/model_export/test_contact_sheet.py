from __future__ import annotations

from pathlib import Path

import numpy as np
import trimesh
from scipy.spatial import cKDTree

from model_export.contact_sheet import fit_panel
from model_export.detailed import detailed_chair
from model_export.realistic import find_shapes
from service.encode.model import SHIPPED, load_model


def test_a_fit_is_drawn_over_the_chair(tmp_path: Path) -> None:
    chair = detailed_chair(0)
    mesh = trimesh.Trimesh(chair.mesh(chair.parameters), chair.faces, process=False)
    mesh.export(tmp_path / "own.ply")
    panel = fit_panel(load_model(SHIPPED / "chair.json"), find_shapes(tmp_path)[0])
    own, template = panel.meshes
    assert panel.title.startswith("own\n")
    assert len(own[0]) == len(mesh.vertices)
    away, _ = cKDTree(own[0]).query(template[0][np.unique(template[1])])
    assert np.median(away) < 0.05
