from __future__ import annotations

import numpy as np
from boxes import ORIGIN, PARAMETERS, chair, template_mesh

from service.deform.binding import compile_binding, inverse_frames
from service.deform.blend import bind


def test_a_part_of_full_weight_moves_by_its_frame():
    template = chair()
    inverses = inverse_frames(template.frames(PARAMETERS))
    rng = np.random.default_rng(0)
    u = rng.uniform(-0.5, 0.5, (7, 6, 3)).astype(np.float32)
    weights = np.eye(6, dtype=np.float32)[rng.integers(0, 6, 7)]
    df = rng.uniform(-0.1, 0.1, 8)
    binding = compile_binding(template, inverses, weights, u, np.ones_like(u))
    part = weights.argmax(axis=1)
    own = np.concatenate([u[np.arange(7), part], np.ones((7, 1))], axis=1)
    expected = np.einsum("vij,vj->vi", (template.frame_jacobian @ df)[part], own)
    np.testing.assert_allclose(binding.displace(df), expected, atol=1e-6)


def test_the_linear_map_carries_the_edges_of_each_part():
    template = chair()
    vertices, faces = template_mesh()
    df = PARAMETERS * np.array([0.3, -0.2, 0.3, 0.2, -0.3, 0.4, 0.3, -0.3])
    binding = bind(vertices, faces, template, PARAMETERS, ORIGIN)
    moved = vertices + binding.displace(df)
    start, end = faces[:, 0], faces[:, 1]
    carried = np.einsum("eij,ej->ei", binding.linear(df)[start], vertices[end] - vertices[start])
    np.testing.assert_allclose(carried, moved[end] - moved[start], atol=1e-5)


def test_inverse_frames_invert_and_bear_flat_parts():
    template = chair()
    frames = template.frames(PARAMETERS)
    product = inverse_frames(frames) @ frames[:, :, :3]
    np.testing.assert_allclose(product, np.broadcast_to(np.eye(3), (6, 3, 3)), atol=1e-9)
    assert np.isfinite(inverse_frames(template.frames(np.zeros(8)))).all()
