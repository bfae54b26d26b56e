from __future__ import annotations

import numpy as np
from boxes import ORIGIN, PARAMETERS, chair, template_mesh

from service.deform.binding import inverse_frames
from service.deform.blend import bind


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


def test_displacements_are_the_jacobians_and_nothing_else_moves():
    binding = bind(*template_mesh(), chair(), PARAMETERS, ORIGIN)
    df = 0.1 * PARAMETERS
    np.testing.assert_allclose(binding.displace(df), binding.jacobian @ df, atol=1e-6)
    wider = binding.displace(np.where(np.arange(8) == 4, 0.1, 0.0))
    assert wider[:, 0].any()
    assert not wider[:, 1:].any()
