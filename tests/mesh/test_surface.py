from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from service.errors import InvalidMesh
from service.mesh.frame import Orientation
from service.mesh.surface import RADIUS, Normalization, Samples, Surface, sample_surface
from service.template.affine import AffineTemplate
from service.template.loader import load_template

# Right-angled triangles of areas 0.5, 2 and 4.5, each in another plane, and one of no area.
VERTICES = np.array([
    [0, 0, 0], [1, 0, 0], [0, 1, 0],
    [5, 0, 0], [5, 2, 0], [5, 0, 2],
    [0, 9, 0], [0, 9, 3], [3, 9, 0],
    [7, 7, 7], [8, 8, 8],
], float)  # fmt: skip
FACES = np.array([[0, 1, 2], [9, 10, 9], [3, 4, 5], [6, 7, 8]])
AREAS = np.array([0.5, 0.0, 2.0, 4.5])
NORMALS = np.array([[0, 0, 1], [0, 0, 0], [1, 0, 0], [0, 1, 0]], float)


def draw(count: int, seed: int = 0, density: np.ndarray | None = None) -> Samples:
    return sample_surface(VERTICES, FACES, count, np.random.default_rng(seed), density)


@pytest.fixture(scope="module")
def chair() -> AffineTemplate:
    return load_template("paper_chair")


def test_points_are_the_barycentric_means_of_their_faces() -> None:
    samples = draw(500)
    assert samples.points.shape == samples.normals.shape == samples.barycentric.shape == (500, 3)
    assert samples.faces.shape == (500,)
    assert (samples.barycentric >= 0).all()
    np.testing.assert_allclose(samples.barycentric.sum(axis=1), 1.0)
    corners = VERTICES[FACES[samples.faces]]
    expected = (samples.barycentric[:, :, None] * corners).sum(axis=1)
    np.testing.assert_allclose(samples.points, expected, atol=1e-12)


def test_normals_are_those_of_the_faces() -> None:
    samples = draw(500)
    np.testing.assert_allclose(samples.normals, NORMALS[samples.faces], atol=1e-12)


@pytest.mark.parametrize("seed", range(5))
def test_every_face_has_its_share_of_the_points_to_within_two(seed: int) -> None:
    count = 700
    drawn = np.bincount(draw(count, seed).faces, minlength=4)
    assert drawn[1] == 0
    assert np.abs(drawn - count * AREAS / AREAS.sum()).max() <= 2


def test_a_face_too_small_for_a_point_of_its_own_has_one_at_times() -> None:
    drawn = np.array([np.bincount(draw(2, seed).faces, minlength=4) for seed in range(600)])
    np.testing.assert_allclose(drawn.mean(axis=0), 2 * AREAS / AREAS.sum(), atol=0.08)


def test_a_density_shifts_the_shares() -> None:
    density = np.array([4.0, 9.0, 1.0, 0.0])
    drawn = np.bincount(draw(600, density=density).faces, minlength=4)
    assert drawn[[1, 3]].tolist() == [0, 0]
    assert abs(drawn[0] - 300) <= 2


def test_points_are_even_within_a_face() -> None:
    samples = draw(20_000)
    for face in (0, 2, 3):
        corners = VERTICES[FACES[face]]
        own = samples.points[samples.faces == face]
        size = np.sqrt(AREAS[face])
        np.testing.assert_allclose(own.mean(axis=0), corners.mean(axis=0), atol=0.03 * size)
        # The corner next to a vertex that is half as large has a quarter of the area.
        near = samples.barycentric[samples.faces == face] > 0.5
        np.testing.assert_allclose(near.mean(axis=0), 0.25, atol=0.05)


def test_draws_come_in_the_order_of_the_faces_and_repeat_with_the_seed() -> None:
    samples, again, other = draw(300, 1), draw(300, 1), draw(300, 2)
    assert (np.diff(samples.faces) >= 0).all()
    assert np.array_equal(samples.points, again.points)
    assert not np.array_equal(samples.points, other.points)


@pytest.mark.parametrize("fault", ["flat", "nan", "no faces", "no density"])
def test_a_surface_without_area_is_refused(fault: str) -> None:
    vertices, faces, density = VERTICES.copy(), FACES, None
    if fault == "flat":
        vertices[:, 1:] = 0.0
    elif fault == "nan":
        vertices[4] = np.nan
    elif fault == "no faces":
        faces = FACES[:0]
    else:
        density = np.zeros(4)
    with pytest.raises(InvalidMesh) as caught:
        sample_surface(vertices, faces, 10, np.random.default_rng(0), density)
    assert caught.value.code == "degenerate_mesh"


CLOUDS = arrays(np.float64, (12, 3), elements=st.floats(-1e3, 1e3, width=32)).filter(
    lambda cloud: np.ptp(cloud, axis=0).max() > 1e-2
)


@given(CLOUDS)
def test_normalised_clouds_have_zero_mean_and_radius_point_six(cloud: np.ndarray) -> None:
    normalised = Normalization.of(cloud).apply(cloud)
    np.testing.assert_allclose(normalised.mean(axis=0), 0.0, atol=1e-9)
    assert RADIUS == 0.6
    assert np.linalg.norm(normalised, axis=1).max() == pytest.approx(0.6)


@given(CLOUDS)
def test_normalisation_can_be_undone(cloud: np.ndarray) -> None:
    normalization = Normalization.of(cloud)
    np.testing.assert_allclose(
        normalization.invert(normalization.apply(cloud)), cloud, atol=1e-10 * np.abs(cloud).max()
    )


@given(CLOUDS, st.floats(0.01, 100), arrays(np.float64, 3, elements=st.floats(-50, 50)))
def test_size_and_place_make_no_difference(
    cloud: np.ndarray, size: float, place: np.ndarray
) -> None:
    moved = size * cloud + place
    before, after = Normalization.of(cloud), Normalization.of(moved)
    np.testing.assert_allclose(after.apply(moved), before.apply(cloud), atol=1e-6)
    assert after.scale == pytest.approx(before.scale / size, rel=1e-6)


def test_labels_scale_with_the_shape(chair: AffineTemplate) -> None:
    f = (chair.low + chair.high) / 2
    vertices = chair.decode(f)
    normalization = Normalization.of(vertices)
    translation = -normalization.center * normalization.scale
    np.testing.assert_allclose(
        chair.decode(f * normalization.scale) + translation,
        normalization.apply(vertices),
        atol=1e-12,
    )


def test_a_surface_knows_its_canonical_vertices() -> None:
    surface = Surface(VERTICES, FACES, metre=100.0)
    assert surface.canonical is VERTICES
    turned = surface.turned(Orientation("+z", "-y"))
    np.testing.assert_array_equal(turned.canonical[2], [0.0, 0.0, -1.0])
    np.testing.assert_array_equal(turned.canonical[5], [5.0, 2.0, 0.0])
    assert turned.metre == 100.0
