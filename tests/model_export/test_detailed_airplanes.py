from __future__ import annotations

import numpy as np
import pytest
import trimesh
from scipy.sparse.csgraph import connected_components

from model_export.detailed import AIRPLANE_NAMES, DetailedShape, detailed_airplane
from service.encode.distance import Cloud, surface_distance
from service.mesh.surface import Normalization, sample_surface
from service.template.loader import load_template

SEEDS = [0, 1, 2, 4, 5, 6, 10, 12, 14]


def pieces(shape: DetailedShape) -> np.ndarray:
    """``[V]`` the connected piece of each vertex."""
    edges = np.concatenate([shape.faces[:, [0, 1]], shape.faces[:, [1, 2]]])
    count = shape.faces.max() + 1
    return connected_components(trimesh.graph.edges_to_coo(edges, count), directed=False)[1]


def edited(shape: DetailedShape, name: str, factor: float) -> tuple[np.ndarray, float]:
    """How far each vertex moves, and by how much the parameter grows."""
    f = shape.parameters.copy()
    index = AIRPLANE_NAMES.index(name)
    f[index] *= factor
    return shape.mesh(f) - shape.mesh(shape.parameters), f[index] - shape.parameters[index]


def test_the_parameters_are_the_templates_public_ones() -> None:
    public = [p.name for p in load_template("airplane").parameters if not p.nuisance]
    assert tuple(public) == AIRPLANE_NAMES


@pytest.mark.parametrize("seed", SEEDS)
def test_it_is_a_closed_surface(seed: int) -> None:
    shape = detailed_airplane(seed)
    solid = trimesh.Trimesh(shape.mesh(shape.parameters), shape.faces, process=False)
    assert solid.is_watertight
    assert solid.is_winding_consistent
    assert all(part.volume > 0 for part in solid.split())
    assert (solid.body_count == 1) == shape.welded
    assert solid.area_faces.min() > 0.0


@pytest.mark.parametrize("seed", SEEDS)
def test_it_is_as_large_as_its_parameters_say_and_its_sides_are_alike(seed: int) -> None:
    shape = detailed_airplane(seed)
    v = shape.mesh(shape.parameters)
    p = dict(zip(AIRPLANE_NAMES, shape.parameters, strict=True))
    assert np.ptp(v[:, 0]) == pytest.approx(p["fuselage_width"] + 2 * p["wing_length"], rel=0.01)
    body = v[np.abs(v[:, 0]) < 0.1 * p["fuselage_width"]]
    assert np.ptp(body[:, 2]) == pytest.approx(p["fuselage_length"], rel=0.09)
    assert body[:, 1].max() == pytest.approx(
        p["fuselage_height"] / 2 + p["vertical_stabilizer_length"], rel=0.02
    )
    ends = [v[:, 0].max(), -v[:, 0].min()]
    assert ends[0] == pytest.approx(ends[1])


@pytest.mark.parametrize("seed", SEEDS)
def test_longer_wings_change_nothing_but_the_wings(seed: int) -> None:
    shape = detailed_airplane(seed)
    moved, grown = edited(shape, "wing_length", 1.3)
    v = shape.mesh(shape.parameters)
    assert np.abs(moved[:, 0]).max() == pytest.approx(grown)
    np.testing.assert_allclose(moved[v[:, 2] < -0.42 * np.ptp(v[:, 2])], 0.0, atol=1e-9)
    if not shape.welded:
        # Everything but wings and struts moves as it is.
        piece = pieces(shape)
        spread = np.array([np.ptp(moved[piece == i], axis=0).max() for i in range(piece.max() + 1)])
        assert (spread > 1e-9).sum() <= 4
        assert spread.max() >= grown * 0.99


@pytest.mark.parametrize("seed", SEEDS)
def test_the_fin_grows_up_and_takes_a_tailplane_along(seed: int) -> None:
    shape = detailed_airplane(seed)
    moved, grown = edited(shape, "vertical_stabilizer_length", 1.4)
    assert moved[:, 1].max() == pytest.approx(grown)
    np.testing.assert_allclose(moved[:, 0], 0.0, atol=1e-9)
    ahead = shape.mesh(shape.parameters)[:, 2] > 0
    np.testing.assert_array_equal(moved[ahead], 0.0)


@pytest.mark.parametrize("seed", [0, 1, 6])
def test_a_longer_fuselage_keeps_wings_and_fittings(seed: int) -> None:
    shape = detailed_airplane(seed)
    moved, _ = edited(shape, "fuselage_length", 1.4)
    piece = pieces(shape)
    spread = [np.ptp(moved[piece == i], axis=0).max() for i in range(piece.max() + 1)]
    assert sum(one > 1e-9 for one in spread) == 1
    np.testing.assert_allclose(moved[:, :2], 0.0, atol=1e-9)


@pytest.mark.parametrize("seed", SEEDS)
def test_the_template_lies_over_it(seed: int) -> None:
    shape, template = detailed_airplane(seed), load_template("airplane")
    v = shape.mesh(shape.parameters)
    frame = Normalization.of(v)
    f = template.vector(
        dict(zip(shape.names, shape.parameters.tolist(), strict=True)) | shape.nuisances
    )
    samples = sample_surface(frame.apply(v), shape.faces, 3000, np.random.default_rng(0))
    cloud = Cloud(samples.points, samples.normals)
    origin = -frame.center * frame.scale
    near = surface_distance(template, f * frame.scale, origin, cloud)
    assert near < 0.02
    wrong = f * np.where(template.public, 1.25, 1.0)
    assert near < surface_distance(template, wrong * frame.scale, origin, cloud)


@pytest.mark.parametrize("seed", [0, 2])
def test_density_is_how_finely_it_is_cut(seed: int) -> None:
    coarse, fine = detailed_airplane(seed, density=1), detailed_airplane(seed, density=8)
    assert 500 < len(coarse.mesh(coarse.parameters)) < 4_500
    assert len(fine.mesh(fine.parameters)) > 40_000
    np.testing.assert_array_equal(coarse.parameters, fine.parameters)
