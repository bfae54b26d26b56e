from __future__ import annotations

import json

import httpx
import numpy as np
import pytest

from model_export.web_samples import FOLDER, SAMPLES, glb
from service.mesh.formats import read_mesh


@pytest.mark.parametrize("name", SAMPLES)
def test_the_shipped_sample_is_what_is_generated(name: str) -> None:
    shipped = read_mesh((FOLDER / f"{name}.glb").read_bytes(), "a.glb")
    made = read_mesh(glb(name, SAMPLES[name]()), "a.glb")
    np.testing.assert_array_equal(shipped.faces, made.faces)
    np.testing.assert_allclose(shipped.vertices, made.vertices, atol=1e-4)


@pytest.mark.parametrize("name", SAMPLES)
def test_it_is_recognised(name: str, service_client: httpx.Client) -> None:
    data = (FOLDER / f"{name}.glb").read_bytes()
    report = service_client.post("/infer", files={"mesh": ("a.glb", data)}).json()
    assert report["category"] == name
    assert report["frame"]["up"] == "+y"
    assert report["frame"]["front"] == "+z"
    assert report["fit"]["in_distribution"]
    assert report["warnings"] == []


def test_normals_are_outward_and_of_unit_length() -> None:
    for make in SAMPLES.values():
        for piece in make():
            vertices, normals, faces = piece.shaded()
            np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-3)
            corners = vertices[faces]
            flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            agree = np.einsum("fi,fi->f", flat, normals[faces].mean(axis=1)) >= 0
            assert agree.mean() > 0.99, piece.name


def test_a_material_has_its_name_and_colour() -> None:
    data = (FOLDER / "chair.glb").read_bytes()
    size = int.from_bytes(data[12:16], "little")
    materials = json.loads(data[20 : 20 + size])["materials"]
    assert [material["name"] for material in materials] == ["Oak", "Wool"]
