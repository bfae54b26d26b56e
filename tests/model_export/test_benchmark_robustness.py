from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

from model_export.benchmark import robustness, spoilt
from model_export.benchmark.decimation import decimated
from model_export.benchmark.robustness import Stand, drifts, stands, table
from model_export.benchmark.spoilt import SCALES, SPOILERS
from model_export.detailed import detailed_chair
from service.errors import InvalidMesh
from service.mesh.formats import read_mesh

SHAPE = detailed_chair(1, 2)
X, FACES = SHAPE.mesh(SHAPE.parameters), SHAPE.faces


def area(vertices: np.ndarray, faces: np.ndarray) -> float:
    return float(trimesh.triangles.area(vertices[faces]).sum())


def spoil(name: str) -> tuple[np.ndarray, np.ndarray]:
    return SPOILERS[name](X, FACES, np.random.default_rng(0))


@pytest.mark.parametrize("name", SPOILERS)
def test_what_is_spoilt_is_a_mesh_still(name: str) -> None:
    vertices, faces = spoil(name)
    assert np.isfinite(vertices).all()
    assert faces.max() < len(vertices)
    assert not np.array_equal(vertices[faces], X[FACES] if len(faces) == len(FACES) else None)


def test_what_is_lost_is_as_much_as_is_said() -> None:
    share = area(*spoil("30 % cropped")) / area(X, FACES)
    assert share == pytest.approx(0.7, abs=0.01)
    assert 0.5 < area(*spoil("holes")) / area(X, FACES) < 0.95


def test_soup_shares_nothing_and_is_the_same_surface() -> None:
    vertices, faces = spoil("triangle soup")
    assert len(vertices) == 3 * len(FACES)
    assert area(vertices, faces) == pytest.approx(area(X, FACES))


def test_faces_are_turned_and_others_float_about() -> None:
    _, faces = spoil("flipped and stray faces")
    turned = (faces[: len(FACES)] != FACES).any(axis=1).mean()
    assert turned == pytest.approx(spoilt.FLIPPED, abs=0.03)
    assert len(faces) == len(FACES) + spoilt.STRAY


def test_noise_is_of_its_size() -> None:
    vertices, _ = spoil("1 % noise")
    off = (vertices - X) / np.linalg.norm(np.ptp(X, axis=0))
    assert off.std() == pytest.approx(0.01, rel=0.05)


def test_fewer_vertices_stay_near_the_surface() -> None:
    vertices, faces = decimated(X, FACES, 500)
    assert len(vertices) <= 500
    points = trimesh.sample.sample_surface(trimesh.Trimesh(vertices, faces), 4000, seed=0)[0]
    whole = trimesh.sample.sample_surface(trimesh.Trimesh(X, FACES), 40_000, seed=0)[0]
    far = cKDTree(whole).query(points)[0].mean() / np.linalg.norm(np.ptp(X, axis=0))
    assert far < 0.006
    assert area(vertices, faces) == pytest.approx(area(X, FACES), rel=0.1)


def test_a_flat_square_comes_down_to_its_corners() -> None:
    at = np.linspace(0.0, 1.0, 9)
    grid = np.stack([*np.meshgrid(at, at), np.zeros((9, 9))], axis=-1).reshape(-1, 3)
    index = np.arange(81).reshape(9, 9)
    a, b, c, d = (index[i : i + 8, j : j + 8].ravel() for i, j in ((0, 0), (0, 1), (1, 1), (1, 0)))
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    vertices, left = decimated(grid, faces, 30)
    assert len(vertices) <= 30
    np.testing.assert_allclose(vertices[:, 2], 0.0)
    assert len(left) < len(faces)


def test_huge_is_the_same_surface_of_hardly_fewer_vertices(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(spoilt, "MANY", 20_000)
    vertices, faces = spoilt.huge(X, FACES)
    assert 19_500 < len(vertices) <= 20_000
    assert area(vertices, faces) == pytest.approx(area(X, FACES))


def test_uploads_are_turned_and_scaled_as_is_told() -> None:
    sent = list(spoilt.spoilt(X, FACES, 3, many=False))
    assert len(sent) == 3 + len(SCALES) + len(SPOILERS)
    for own in sent[: 3 + len(SCALES)]:
        vertices = read_mesh(own.upload.data, own.upload.name).vertices
        back = own.orientation.to_canonical(vertices) / own.scale
        np.testing.assert_allclose(back, X, atol=1e-6)


def answer(f: list[float], active: list[bool] | None = None) -> Any:
    template = SimpleNamespace(public=np.array([True, True, False]))
    own = SimpleNamespace(active=np.array(active or [True, True, True]))
    return SimpleNamespace(
        parameters=np.array(f),
        model=SimpleNamespace(template=template, name="chair"),
        fit=SimpleNamespace(template=own),
        best=SimpleNamespace(orientation=SimpleNamespace(rotation=np.eye(3))),
    )


def test_drift_is_relative_and_of_what_users_see() -> None:
    np.testing.assert_allclose(
        drifts(answer([1.0, 2.0, 3.0]), answer([11.0, 20.0, 90.0]), 10.0), [0.1, 0.0]
    )
    only = answer([1.0, 2.0, 3.0], [False, True, True])
    np.testing.assert_allclose(drifts(only, answer([9.0, 1.0, 0.0]), 1.0), [0.5])


def test_refusals_and_other_categories_are_told_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = 0

    def infer(upload: Any, models: Any, options: Any) -> Any:
        nonlocal asked
        asked += 1
        if asked == 2:
            raise InvalidMesh("no_faces", "None.", "Send some.")
        found = answer([1.0, 1.0, 1.0])
        if asked == 3:
            found.model.name = "airplane"
        return found

    monkeypatch.setattr(robustness, "infer", infer)
    rows = list(stands({}, "chair", "D", X, FACES, turns=3, many=False))
    assert [row.refusal for row in rows[:3]] == ["no_faces", "", ""]
    assert [row.recognised for row in rows[:3]] == [False, False, True]
    assert not rows[2].upright
    line = next(line for line in table(rows).splitlines() if "24 rotations" in line)
    assert line.split("|")[3:7] == [" 3 ", " 66.7 ", " 33.3 ", " 0.0 "]
    assert line.endswith("| no_faces |")


def test_a_line_of_drifts() -> None:
    rows = [
        Stand("D", "chair", "holes", recognised=True, upright=True, drift=(0.0, 0.04)),
        Stand("D", "chair", "holes", recognised=True, upright=True, drift=(0.06, 0.5)),
    ]
    assert table(rows).splitlines()[2] == (
        "| D, chairs | holes | 2 | 100.0 | 100.0 | 100.0 | 5.0 | 36.8 | 75.0 | none |"
    )
