from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
from plain_chair import PLAIN

from model_export import orientation_report
from model_export.config import SHIPPED
from model_export.orientation_report import answers, looks_the_same
from model_export.realistic import find_shapes
from service.encode.model import load_models
from service.mesh.frame import Orientation
from service.template.affine import AffineTemplate

VALUES = np.array(list(PLAIN.values()))


def heights(turns: list[np.ndarray]) -> list[float]:
    """Where each turn takes what points up."""
    return sorted(float(turn[1, 1]) for turn in turns)


def test_a_chair_looks_like_itself_from_one_side_only(chair: AffineTemplate) -> None:
    (turn,) = looks_the_same(chair.decode(VALUES), chair.faces)
    np.testing.assert_array_equal(turn, np.eye(3))


def test_a_square_slab_has_eight_sides_alike_and_a_cube_all_24() -> None:
    slab = trimesh.creation.box([1.0, 0.2, 1.0])
    assert heights(looks_the_same(slab.vertices, slab.faces)) == [-1.0] * 4 + [1.0] * 4
    cube = trimesh.creation.box([1.0, 1.0, 1.0])
    assert len(looks_the_same(cube.vertices, cube.faces)) == 24


def test_a_chair_is_found_whichever_way_it_faces(
    chair: AffineTemplate, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    mesh = trimesh.Trimesh(chair.decode(VALUES), chair.faces, process=False)
    mesh.export(tmp_path / "chair.ply")
    ways = [Orientation("+z", "-y"), Orientation("-y", "+x")]
    monkeypatch.setattr(orientation_report, "TURNS", ways)
    (shape,) = find_shapes(tmp_path)
    model = load_models(SHIPPED)["chair"]
    found = list(answers(model, shape, (1.0, 1000.0)))
    assert [answer.way for answer in found] == [way for way in ways for _ in range(2)]
    assert all(answer.right and answer.up and not answer.refused for answer in found)
    assert all(answer.gap < 1e-4 for answer in found)


def test_another_orientation_than_the_shapes_own_is_wrong(
    chair: AffineTemplate, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    mesh = trimesh.Trimesh(chair.decode(VALUES), chair.faces, process=False)
    mesh.export(tmp_path / "chair.ply")
    monkeypatch.setattr(orientation_report, "TURNS", [Orientation("+z", "-y")])
    (shape,) = find_shapes(tmp_path)
    model = load_models(SHIPPED)["chair"]
    # As if the service took every upload for one that faces its right side.
    sideways = orientation_report.InferOptions(up="+z", front="+x")
    monkeypatch.setattr(orientation_report, "HINTLESS", sideways)
    (answer,) = answers(model, shape, (1.0,))
    assert not answer.right
    assert answer.up
    assert answer.gap > 0.02
