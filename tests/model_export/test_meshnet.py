from __future__ import annotations

import numpy as np
import pytest
import torch
import trimesh

from model_export.meshnet import OUTPUTS, FeaStConv, MeshNet, one_rings


@pytest.fixture(scope="module")
def ball() -> trimesh.Trimesh:
    return trimesh.creation.icosphere(subdivisions=1)


def test_rings_hold_each_vertex_and_its_neighbours(ball: trimesh.Trimesh) -> None:
    neighbours, share = one_rings(ball.faces, len(ball.vertices))
    for index, known in enumerate(ball.vertex_neighbors):
        counted = share[index] > 0.0
        assert set(neighbours[index][counted]) == {index, *known}
        assert (neighbours[index][~counted] == index).all()
    assert np.allclose(share.sum(axis=1), 1.0)


def test_a_convolution_is_the_mean_over_the_ring_of_what_each_head_makes(
    ball: trimesh.Trimesh,
) -> None:
    torch.manual_seed(0)
    layer = FeaStConv(5, 4, heads=3)
    neighbours, share = one_rings(ball.faces, len(ball.vertices))
    features = torch.randn(1, len(ball.vertices), 5)
    with torch.no_grad():
        found = layer(features, torch.as_tensor(neighbours), torch.as_tensor(share).float())
        for index in (0, 7, 30):
            ring = neighbours[index][share[index] > 0.0]
            expected = layer.mix.bias.clone()
            for other in ring:
                away = features[0, other] - features[0, index]
                heads = layer.assign(away).softmax(dim=0)
                for head, matrix in zip(heads, layer.mix.weight.split(5, dim=1), strict=True):
                    expected += head * (matrix @ features[0, other]) / len(ring)
            assert torch.allclose(found[0, index], expected, atol=1e-5)


def test_a_fresh_network_answers_an_upright_body(ball: trimesh.Trimesh) -> None:
    torch.manual_seed(0)
    network = MeshNet(ball.faces, len(ball.vertices), heads=2)
    outputs = network(torch.as_tensor(np.asarray(ball.vertices), dtype=torch.float32)[None] * 0.6)
    assert outputs.shape == (1, OUTPUTS)
    assert (outputs[0, :144].reshape(24, 6) - torch.tensor([1.0, 0, 0, 0, 1, 0])).abs().max() < 0.6


def test_the_order_of_the_vertices_does_not_matter(ball: trimesh.Trimesh) -> None:
    torch.manual_seed(0)
    count = len(ball.vertices)
    vertices = torch.as_tensor(np.asarray(ball.vertices), dtype=torch.float32)
    vertices = vertices * (1.0 + 0.3 * torch.rand(count, 1))
    network = MeshNet(ball.faces, count, heads=2)
    order = np.random.default_rng(0).permutation(count)
    other = MeshNet(np.argsort(order)[ball.faces], count, heads=2)
    own = {k: v for k, v in network.state_dict().items() if k not in ("neighbours", "share")}
    other.load_state_dict(own, strict=False)
    with torch.no_grad():
        assert torch.allclose(network(vertices[None]), other(vertices[None, order]), atol=1e-5)
