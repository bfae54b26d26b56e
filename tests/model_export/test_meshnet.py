from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
import torch
import trimesh

from model_export.meshnet import OUTPUTS, FeaStConv, MeshNet, one_rings, region_middles
from service.template.skinned import SkinnedTemplate

MIDDLES = np.array([3, 20, 36])


@pytest.fixture(scope="module")
def ball() -> trimesh.Trimesh:
    return trimesh.creation.icosphere(subdivisions=2)


@pytest.fixture
def vertices(ball: trimesh.Trimesh) -> torch.Tensor:
    shape = torch.as_tensor(np.asarray(ball.vertices), dtype=torch.float32)
    generator = torch.Generator().manual_seed(0)
    return 0.6 * shape * (1.0 + 0.3 * torch.rand(len(shape), 1, generator=generator))


def trained(network: MeshNet) -> MeshNet:
    """With a last layer that answers something."""
    torch.manual_seed(1)
    torch.nn.init.normal_(network.last.weight, std=0.1)
    return network


def test_rings_hold_each_vertex_and_its_neighbours(ball: trimesh.Trimesh) -> None:
    rings, share = one_rings(ball.faces, len(ball.vertices))
    for index, known in enumerate(ball.vertex_neighbors):
        counted = share[index] > 0.0
        assert rings[index, 0] == index
        assert sorted(rings[index][counted]) == sorted({index, *known})
        assert (rings[index][~counted] == index).all()
    assert np.allclose(share.sum(axis=1), 1.0)


def test_a_convolution_is_the_mean_over_the_ring_of_what_each_head_makes(
    ball: trimesh.Trimesh,
) -> None:
    torch.manual_seed(0)
    layer = FeaStConv(5, 4, heads=3)
    torch.nn.init.normal_(layer.mix.weight)
    rings, share = one_rings(ball.faces, len(ball.vertices))
    features = torch.randn(1, len(ball.vertices), 5)
    asked = [0, 7, 30]
    with torch.no_grad():
        found = layer(
            features, torch.as_tensor(rings[asked]), torch.as_tensor(share[asked]).float()
        )
        assert found.shape == (1, 3, 4)
        for place, index in enumerate(asked):
            ring = rings[index][share[index] > 0.0]
            expected = layer.mix.bias.clone()
            for other in ring:
                away = features[0, other] - features[0, index]
                heads = layer.assign(away).softmax(dim=0)
                for head, matrix in zip(heads, layer.mix.weight.split(5, dim=1), strict=True):
                    expected += head * (matrix @ features[0, other]) / len(ring)
            assert torch.allclose(found[0, place], expected, atol=1e-5)


def test_a_fresh_convolution_loses_nothing_of_the_rings_mean(ball: trimesh.Trimesh) -> None:
    torch.manual_seed(0)
    layer = FeaStConv(3, 8, heads=4)
    rings, share = map(torch.as_tensor, one_rings(ball.faces, len(ball.vertices)))
    features = torch.randn(1, len(ball.vertices), 3)
    mean = (features[0, rings] * share[..., None].float()).sum(1)
    found = layer(features, rings, share.float())[0]
    assert torch.allclose(found.norm(dim=1), 1.4 * mean.norm(dim=1), atol=1e-4)


def test_a_fresh_network_answers_an_upright_body(
    ball: trimesh.Trimesh, vertices: torch.Tensor
) -> None:
    network = MeshNet(ball.faces, len(vertices), MIDDLES, heads=2)
    outputs = network(vertices[None])
    assert outputs.shape == (1, OUTPUTS)
    upright = torch.tensor([1.0, 0, 0, 0, 1, 0])
    assert torch.equal(outputs[0, :144].reshape(24, 6), upright.expand(24, 6))
    assert (outputs[0, 144:] == 0).all()


def test_each_mean_sees_its_own_surroundings(ball: trimesh.Trimesh, vertices: torch.Tensor) -> None:
    torch.manual_seed(0)
    network = MeshNet(ball.faces, len(vertices), MIDDLES, heads=2)
    moved = vertices.clone()
    moved[MIDDLES[0]] += 0.05
    with torch.no_grad():
        first, second = (network.pooled(v[None])[0].unflatten(0, (3, 128)) for v in
                         (vertices, moved))  # fmt: skip
    change = (first - second).norm(dim=1)
    # Five edges away are all that a mean sees.
    graph = ball.vertex_adjacency_graph
    near = {MIDDLES[0]}
    for _ in range(5):
        near |= {other for vertex in near for other in graph[vertex]}
    assert change[0] > change[1:].max()
    assert [bool(c > 0) for c in change] == [middle in near for middle in MIDDLES]


def test_the_order_of_the_vertices_does_not_matter(
    ball: trimesh.Trimesh, vertices: torch.Tensor
) -> None:
    torch.manual_seed(0)
    count = len(vertices)
    network = trained(MeshNet(ball.faces, count, MIDDLES, heads=2))
    order = np.random.default_rng(0).permutation(count)
    place = np.argsort(order)
    other = MeshNet(place[ball.faces], count, place[MIDDLES], heads=2)
    other.load_state_dict(dict(network.named_parameters()), strict=False)
    with torch.no_grad():
        assert torch.allclose(network(vertices[None]), other(vertices[None, order]), atol=1e-5)


def test_regions_are_four_of_each_joint_and_lie_apart(human: SkinnedTemplate) -> None:
    middles = region_middles(human)
    owners = Counter(human.weights[middles].argmax(axis=1).tolist())
    assert owners == dict.fromkeys(range(24), 4)
    assert len(set(middles.tolist())) == 96
    assert np.array_equal(middles, region_middles(human))
