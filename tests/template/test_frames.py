from __future__ import annotations

import numpy as np
import pytest

from service.template.frames import THINNEST, Frames


@pytest.fixture(scope="module")
def frames() -> Frames:
    """A box; a wing that leans and tapers along x; its mirror image; a mug that tapers along y."""
    box = np.hstack([np.diag([0.4, 0.2, 0.6]), [[0.1], [0.0], [-0.1]]])
    wing = np.array([[0.5, 0, 0, 0.3], [0.05, 0.02, 0, 0.0], [-0.2, 0, 0.15, 0.1]])
    thinner = np.diag([0.0, -0.01, -0.1])
    mirror = np.array([-1.0, 1.0, 1.0])[:, None]
    mug = np.hstack([np.diag([0.3, 0.5, 0.3]), np.zeros((3, 1))])
    return Frames(
        frames=np.stack([box, wing, mirror * wing, mug]),
        tapers=np.stack([np.zeros((3, 3)), thinner, mirror * thinner, np.diag([0.1, 0, 0.1])]),
        run=np.array([0, 0, 0, 1]),
    )


@pytest.fixture(scope="module")
def u() -> np.ndarray:
    """Unit coordinates inside and well beyond the cube, ``[500, 4, 3]``."""
    return np.random.default_rng(0).uniform(-1.5, 1.5, (500, 4, 3))


def test_a_wing_passes_evenly_from_root_to_tip(frames: Frames) -> None:
    def placed(*u: float) -> np.ndarray:
        return frames.place(np.tile(u, (4, 1)))[1]

    # Root: chord 0.15 + 0.05 about z = 0.2, at x = 0.05; tip: chord 0.15 - 0.05 about z = 0.
    np.testing.assert_allclose(placed(-0.5, 0, 0.5), [0.05, -0.025, 0.3])
    np.testing.assert_allclose(placed(-0.5, 0, -0.5), [0.05, -0.025, 0.1])
    np.testing.assert_allclose(placed(0.5, 0, 0.5), [0.55, 0.025, 0.05], atol=1e-15)
    np.testing.assert_allclose(placed(0.5, 0, -0.5), [0.55, 0.025, -0.05], atol=1e-15)
    np.testing.assert_allclose(placed(0, 0, 0.5), [0.3, 0, 0.175])
    np.testing.assert_allclose(placed(-0.5, 0.5, 0), [0.05, -0.0125, 0.2])
    # Beyond the tip the section no longer shrinks, and the wing goes on as it leans.
    np.testing.assert_allclose(placed(1.5, 0, 0.5), [1.05, 0.075, -0.15])


def test_parts_without_a_taper_are_affine(frames: Frames, u: np.ndarray) -> None:
    box = u[:, 0] * [0.4, 0.2, 0.6] + [0.1, 0.0, -0.1]
    np.testing.assert_allclose(frames.place(u)[:, 0], box, atol=1e-15)


def test_the_way_back_undoes_the_way_there(frames: Frames, u: np.ndarray) -> None:
    placed = frames.place(u)
    for part in range(4):
        np.testing.assert_allclose(frames.unit(placed[:, part])[:, part], u[:, part], atol=1e-12)
    x = np.random.default_rng(1).uniform(-1, 1, (300, 3))
    there = frames.place(frames.unit(x))
    np.testing.assert_allclose(there, np.broadcast_to(x[:, None], there.shape), atol=1e-12)


def test_the_derivative_is_that_of_the_way_there(frames: Frames, u: np.ndarray) -> None:
    h = 1e-6
    smooth = (np.abs(np.abs(u) - 0.5) > 2 * h).all(axis=(1, 2))
    derivative = frames.derivative(u)
    assert derivative.shape == (500, 4, 3, 3)
    for axis, step in enumerate(h * np.eye(3)):
        slope = (frames.place(u + step) - frames.place(u - step)) / (2 * h)
        np.testing.assert_allclose(slope[smooth], derivative[smooth][..., axis], atol=1e-8)


def test_sections_without_thickness_still_have_a_way_back() -> None:
    sheet = np.hstack([np.diag([1.0, 0.0, -1e-5]), np.zeros((3, 1))])[None]
    frames = Frames(sheet, np.zeros((1, 3, 3)), np.array([0]))
    u = frames.unit(np.array([[0.2, THINNEST, THINNEST]]))
    np.testing.assert_allclose(u, [[[0.2, 1.0, -1.0]]])
