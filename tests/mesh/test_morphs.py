from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from gltf_assets import Asset, values
from hypothesis import given, settings
from hypothesis import strategies as st
from mesh_samples import ball, bend, bend_some, still

from service.errors import InvalidMesh, TooLarge
from service.mesh import limits
from service.mesh.formats import read_mesh

VERTICES, FACES, NORMALS = ball()
POINTS = VERTICES.astype("<f4")
WIDER = (POINTS * [0.5, 0, 0]).astype("<f4")
HIGHER = (POINTS * [0, 0.25, 0]).astype("<f4")


def morphed(
    mesh: dict[str, Any], *nodes: dict[str, Any], targets: list[Any] | None = None
) -> Asset:
    """The ball with the targets `WIDER` and `HIGHER`, as accessors 1 and 2, at some nodes."""
    asset = Asset()
    position = asset.accessor(POINTS)
    shapes = [{"POSITION": asset.accessor(array)} for array in (WIDER, HIGHER)]
    entry = {
        "attributes": {"POSITION": position},
        "indices": asset.accessor(FACES.reshape(-1).astype("<u2")),
        "targets": shapes if targets is None else targets,
    }
    number = asset.mesh(entry, **mesh)
    for node in nodes or ({},):
        asset.node(mesh=number, **node)
    return asset


@pytest.mark.parametrize(
    ("mesh", "node", "wider", "higher"),
    [
        ({}, {}, 0, 0),
        ({"weights": [0, 0]}, {}, 0, 0),
        ({"weights": [1, 0.5]}, {}, 1, 0.5),
        ({"weights": [1, 0.5]}, {"weights": [0, -1]}, 0, -1),
        ({"weights": [1]}, {"weights": [0.25]}, 0.25, 0),
    ],
)
def test_weights_of_the_node_come_before_the_meshs(
    mesh: dict[str, Any], node: dict[str, Any], wider: float, higher: float
) -> None:
    found = read_mesh(morphed(mesh, node).glb())
    expected = POINTS + wider * WIDER.astype(float) + higher * HIGHER.astype(float)
    assert np.array_equal(found.vertices, expected)


@pytest.mark.parametrize("node", [{}, {"rotation": [0, 0, 0.6, 0.8], "scale": [2, 1, 1]}])
def test_what_is_shown_moves_and_targets_stay(node: dict[str, Any]) -> None:
    data = morphed({"weights": [1, 0.5]}, node).glb()
    mesh = read_mesh(data)
    new, linear, moved = bend_some(mesh.vertices)
    written = mesh.write(new, linear)
    again = read_mesh(written)
    assert np.allclose(again.vertices, new, atol=1e-6)
    assert np.array_equal(again.vertices[~moved], mesh.vertices[~moved])
    assert all(np.array_equal(values(written, i), values(data, i)) for i in (1, 2, 3))
    back = read_mesh(again.write(mesh.vertices, still(len(new)))).vertices
    assert np.allclose(back, mesh.vertices, atol=1e-6)


def test_nodes_that_weigh_a_mesh_differently_show_it_twice() -> None:
    mesh = read_mesh(morphed({}, {"weights": [1, 0]}, {"weights": [0, 1]}).glb())
    assert np.array_equal(mesh.vertices[:42], POINTS + WIDER.astype(float))
    assert np.array_equal(mesh.vertices[42:], POINTS + HIGHER.astype(float))
    new, linear = bend(mesh.vertices)
    again = read_mesh(mesh.write(new, linear))
    assert np.allclose(again.vertices, new, atol=1e-6)


@pytest.mark.parametrize(
    ("weights", "targets"),
    [
        (["much", 0], None),
        ({}, None),
        ([1], [7]),
        ([1], [{"POSITION": 99}]),
        ([1], [{"POSITION": "1"}]),
        ([1], [{"POSITION": 3}]),
        ([1], {}),
    ],
)
def test_broken_targets_are_malformed(weights: Any, targets: Any) -> None:
    with pytest.raises(InvalidMesh, match="malformed_glb"):
        read_mesh(morphed({"weights": weights}, targets=targets).glb())


def test_targets_have_a_largest_number(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(limits, "VERTICES", 42)
    asset = morphed({"weights": [1] * 17}, targets=[{"POSITION": 1}] * 17)
    with pytest.raises(TooLarge, match="too_many_vertices"):
        read_mesh(asset.glb())


@settings(max_examples=30, deadline=None, database=None)
@given(st.lists(st.floats(-2, 2, width=32), min_size=2, max_size=2))
def test_any_weights_are_undone_on_the_way_back(weights: list[float]) -> None:
    mesh = read_mesh(morphed({"weights": weights}).glb())
    new, linear = bend(mesh.vertices)
    assert np.allclose(read_mesh(mesh.write(new, linear)).vertices, new, atol=2e-6)
