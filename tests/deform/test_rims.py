from __future__ import annotations

import numpy as np
import pytest
import trimesh
from boxes import ORIGIN, PARAMETERS, block, chair, change, joined, template_mesh

from model_export.primitives import slab
from service.deform.blend import bind
from service.deform.rims import Rim

SEAT = (0.42, 0.05, 0.45)


def seat(fillet: float, size: tuple[float, float, float] = SEAT) -> tuple[np.ndarray, np.ndarray]:
    """A rounded seat on four legs; the seat comes first."""
    vertices, faces = slab(ORIGIN, size, fillet, 3)
    legs = [
        block((x - 0.02, -0.425, z - 0.02), (x + 0.02, -0.025, z + 0.02))
        for x in (-0.185, 0.185)
        for z in (-0.2, 0.2)
    ]
    return joined((vertices, faces), *legs)


def moved(mesh: tuple[np.ndarray, np.ndarray], name: str, by: float) -> np.ndarray:
    return np.asarray(bind(*mesh, chair(), PARAMETERS, ORIGIN).displace(change(name, by)))


@pytest.mark.parametrize(("name", "axis"), [("seat_width", 0), ("seat_depth", 2)])
@pytest.mark.parametrize("by", [0.2, -0.12])
def test_a_wider_seat_keeps_the_radius_of_its_edges(name: str, axis: int, by: float) -> None:
    fillet = 0.010
    vertices, faces = seat(fillet)
    count = len(slab(ORIGIN, SEAT, fillet, 3)[0])
    x = (vertices - ORIGIN)[:count, axis]
    y = x + moved((vertices, faces), name, by)[:count, axis]
    rim = x > SEAT[axis] / 2 - fillet - 1e-9
    np.testing.assert_allclose(y[rim] - x[rim], by / 2, atol=2e-5)
    assert np.ptp(y) == pytest.approx(SEAT[axis] + by, abs=1e-4)
    # Between the rims it stretches evenly.
    inner = ~rim & (x > 0.0)
    ratio = (SEAT[axis] + by - 2 * fillet) / (SEAT[axis] - 2 * fillet)
    np.testing.assert_allclose(y[inner], x[inner] * ratio, atol=2e-4)


def test_a_thicker_seat_keeps_it_too() -> None:
    fillet = 0.006
    vertices, faces = seat(fillet)
    count = len(slab(ORIGIN, SEAT, fillet, 3)[0])
    x = (vertices - ORIGIN)[:count, 1]
    y = moved((vertices, faces), "seat_thickness", 0.02)[:count, 1]
    np.testing.assert_allclose(y[x > SEAT[1] / 2 - fillet - 1e-9], 0.01, atol=2e-5)


def test_wide_rims_give_way_before_what_is_between_them_folds() -> None:
    vertices, faces = seat(0.0225)
    count = len(slab(ORIGIN, SEAT, 0.0225, 3)[0])
    x = vertices[:count, 1]
    y = x + moved((vertices, faces), "seat_thickness", -0.6 * SEAT[1])[:count, 1]
    order = np.argsort(x, kind="stable")
    steps, before = np.diff(y[order]), np.diff(x[order])
    assert (steps[before > 1e-9] > 0.0).all()


@pytest.mark.parametrize(
    "mesh",
    [
        # Sharp edges.
        block((-0.21, -0.025, -0.225), (0.21, 0.025, 0.225)),
        # Round all over.
        (
            trimesh.creation.icosphere(3).vertices * [0.21, 0.025, 0.225] + ORIGIN,
            np.array(trimesh.creation.icosphere(3).faces),
        ),
    ],
)
def test_what_has_no_rims_stretches_evenly(mesh: tuple[np.ndarray, np.ndarray]) -> None:
    x = (mesh[0] - ORIGIN)[:, 0]
    np.testing.assert_allclose(moved(mesh, "seat_width", 0.1)[:, 0], x * 0.1 / 0.42, atol=2e-5)


def test_a_rounded_rod_has_none() -> None:
    size = (0.40, 0.03, 0.03)
    rod = slab(ORIGIN + np.array([0, -0.15, 0.2]), size, 0.01, 3)
    whole = joined(rod, template_mesh())
    count = len(rod[0])
    x, y = whole[0][:count, 1], moved(whole, "leg_height", 0.1)[:count, 1]
    # No rim holds its upper and lower edges: all of it goes down alike, or stretches evenly.
    fit = np.polyfit(x, y, 1)
    np.testing.assert_allclose(y, np.polyval(fit, x), atol=1e-4)


def test_normals_know_of_the_rims() -> None:
    vertices, faces = seat(0.010)
    binding = bind(vertices, faces, chair(), PARAMETERS, ORIGIN)
    df = change("seat_width", 0.2)
    count = len(slab(ORIGIN, SEAT, 0.010, 3)[0])
    x, maps = (vertices - ORIGIN)[:count, 0], binding.linear(df)[:count]
    rim = np.abs(x) > 0.21 - 0.010 + 1e-6
    np.testing.assert_allclose(maps[rim, 0, 0], 1.0, atol=1e-5)
    inner = np.abs(x) < 0.21 - 0.010 - 1e-6
    np.testing.assert_allclose(maps[inner, 0, 0], 1.0 + 0.2 / (0.42 - 0.020), atol=2e-3)


def test_an_end_without_a_rim_goes_with_what_lies_between() -> None:
    knots = np.array([[-0.5, -0.5, 0.4, 0.5]], np.float32)
    held = np.array([[-0.5, -0.5, 0.5, 0.5]], np.float32)
    rim = Rim(0, 1, np.array([True]), knots, held)
    u = np.zeros((4, 1, 3), np.float32)
    u[:, 0, 1] = [-0.5, -0.05, 0.4, 0.45]
    rows, slope = rim.hold(u, np.zeros(4, np.int64))
    assert rows.tolist() == [0, 1, 2, 3]
    np.testing.assert_allclose(u[:, 0, 1], [-0.5, 0.0, 0.5, 0.5], atol=1e-6)
    np.testing.assert_allclose(slope, [1 / 0.9, 1 / 0.9, 1 / 0.9, 0.0], rtol=1e-5)
