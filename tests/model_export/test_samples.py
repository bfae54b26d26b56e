from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from model_export import samples
from model_export.realistic import find_shapes, load_cloud
from service.mesh.surface import Normalization
from service.template.affine import AffineTemplate


def test_clouds_of_real_shapes_are_normalised(meshes: Path, tmp_path: Path) -> None:
    shapes = find_shapes(meshes)[:3]
    clouds = samples.clouds_of(shapes, tmp_path, 400)
    for shape, cloud in zip(shapes, clouds, strict=True):
        assert (cloud.shape, cloud.dtype) == ((400, 3), np.float32)
        np.testing.assert_allclose(np.linalg.norm(cloud, axis=1).max(), 0.6, rtol=1e-5)
        np.testing.assert_allclose(cloud.mean(axis=0), 0, atol=1e-5)
        # A part of the samples shows the whole of the shape, not its first faces only.
        whole = load_cloud(shape, tmp_path)
        normalization = Normalization.of(whole)
        np.testing.assert_allclose(
            np.ptp(cloud, axis=0), np.ptp(whole, axis=0) * normalization.scale, rtol=0.08
        )


def test_synthetic_samples_agree_with_their_labels(mean_model: Any, stand: AffineTemplate) -> None:
    drawn, labels, variant = samples.synthetic_samples(mean_model, 6)
    assert labels.shape == (6, 6)
    assert variant.tolist() == [0] * 6
    for own, label in zip(drawn, labels, strict=True):
        assert own.points.shape == (300, 3)
        normalised = Normalization.of(own.points).apply(own.points)
        vertices = stand.decode(label[:3]) + label[3:]
        visible = stand.faces[~stand.hidden]
        corners = vertices[visible[own.faces]]
        there = np.einsum("nk,nkc->nc", own.barycentric, corners)
        np.testing.assert_allclose(there, normalised, atol=1e-12)
    again = samples.synthetic_samples(mean_model, 6)
    assert np.array_equal(again[1], labels)
    assert np.array_equal(again[0][2].points, drawn[2].points)


def test_files_are_inferred_as_the_service_would(mean_model: Any, meshes: Path) -> None:
    found = samples.infer_shape(mean_model, find_shapes(meshes)[0])
    assert found.samples.points.shape == (300, 3)
    assert found.fit.distance <= found.fit.encoder_distance
    assert found.mesh.vertices.shape[1] == 3
