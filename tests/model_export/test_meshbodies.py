from __future__ import annotations

import torch

from model_export.meshbodies import MeshBodies
from service.template.skinned import SkinnedTemplate


def test_bodies_are_drawn_with_their_torso_upright(human: SkinnedTemplate) -> None:
    vertices, turned, shape = MeshBodies(human, 0).batch(3)
    assert vertices.shape == (3, len(human.rest), 3)
    assert torch.allclose(vertices.norm(dim=2).amax(dim=1), torch.full((3,), 0.6), atol=1e-5)
    assert (turned[:, 3, 1, 1] > 0.7).all()
    assert shape.shape == (3, 3)
    again = MeshBodies(human, 0).batch(3)
    assert torch.equal(vertices, again[0])
