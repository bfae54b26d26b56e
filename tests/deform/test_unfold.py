from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from service.deform.binding import Binding
from service.deform.turning import count_flips
from service.deform.unfold import FARTHEST, Unfolding
from service.deform.weld import weld

SIZE = 24
CELL = 0.01


def sheet() -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """A flat grid of ``SIZE x SIZE`` cells."""
    ticks = CELL * np.arange(SIZE + 1)
    x, y = np.meshgrid(ticks, ticks, indexing="ij")
    corner = np.arange((SIZE + 1) ** 2).reshape(SIZE + 1, SIZE + 1)
    a, b, c, d = (
        m.ravel() for m in (corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:])
    )
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    return np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1), faces


def bound(x_motion: NDArray[np.float64]) -> Binding:
    """Vertices that move along x by so much a unit of the first of two parameters."""
    jacobian = np.zeros((len(x_motion), 3, 2), np.float32)
    jacobian[:, 0, 0] = x_motion
    jacobian[:, 1, 1] = 1.0
    none = np.zeros((len(x_motion), 3), np.float32)
    return Binding(jacobian, none, np.zeros((3, 9, 2), np.float32))


def unfold(
    binding: Binding, vertices: NDArray[np.float64], faces: NDArray[np.int64], index: int = 0
) -> Binding:
    """The binding with one of its parameters looked after."""
    bound = binding.bound([0, 1])
    kept = {cell: column.copy() for cell, column in bound.columns.items()}
    columns = Unfolding(weld(vertices, faces)).evened(bound, index, float(F[index]))
    for cell, column in bound.columns.items():
        np.testing.assert_array_equal(column, kept[cell])
    jacobian = binding.jacobian.copy()
    for (axis, parameter), column in columns.items():
        assert parameter == index
        jacobian[:, axis, parameter] = column
    return replace(binding, jacobian=jacobian)


def flips(binding: Binding, factor: float) -> int:
    vertices, faces = sheet()
    change = np.array([factor - 1, 0.0])
    after = vertices + binding.displace(change)
    return count_flips(vertices, after, faces, binding.linear(change))


def step(width: float) -> Binding:
    """The right half follows the parameter by `width` cells a unit, the left half does not."""
    vertices, _ = sheet()
    return bound(np.where(vertices[:, 0] > CELL * SIZE / 2, CELL * width, 0.0))


F = np.ones(2)


@pytest.mark.parametrize("width", [4.0, 8.0])
def test_a_fold_is_evened_out(width: float) -> None:
    vertices, faces = sheet()
    before = step(width)
    assert flips(before, 0.7) > SIZE
    after = unfold(before, vertices, faces)
    assert flips(after, 0.7) == 0
    assert flips(after, 1.4) == 0


def test_the_repair_stays_near_the_fold_and_in_its_column() -> None:
    vertices, faces = sheet()
    before = step(4.0)
    after = unfold(before, vertices, faces)
    changed = (after.jacobian != before.jacobian).any(axis=1)
    assert not changed[:, 1].any()
    far = np.abs(vertices[:, 0] - CELL * SIZE / 2) > 10 * CELL
    assert changed[:, 0].any()
    assert not changed[far].any()


def test_no_vertex_is_moved_far_to_even_a_fold_out() -> None:
    vertices, faces = sheet()
    vertices *= 20.0
    before = step(4.0)
    before = replace(before, jacobian=20.0 * before.jacobian)
    after = unfold(before, vertices, faces)
    moved = 0.4 * np.abs(after.jacobian - before.jacobian)
    assert 0.0 < moved.max() <= FARTHEST + 1e-6


@pytest.mark.parametrize(("width", "index"), [(0.5, 0), (0.5, 1), (4.0, 1), (0.0, 0)])
def test_what_does_not_fold_is_left_alone(width: float, index: int) -> None:
    bound, welded = step(width).bound([0, 1]), weld(*sheet())
    assert Unfolding(welded).evened(bound, index, 1.0) == {}


def test_flips_are_counted_of_the_mesh_with_its_seams() -> None:
    vertices, faces = sheet()
    corners = np.arange(3 * len(faces)).reshape(-1, 3)
    binding, change = step(8.0), np.array([-0.3, 0.0])
    unfolding = Unfolding(weld(vertices[faces].reshape(-1, 3), corners))
    moved, maps = binding.displace(change), binding.linear(change)
    assert unfolding.flips(moved[faces.ravel()], maps[faces.ravel()]) == flips(binding, 0.7) > SIZE


def test_vertices_at_one_place_keep_moving_as_one() -> None:
    vertices, faces = sheet()
    binding = step(4.0)
    twice = np.concatenate([vertices, vertices])
    faces = np.concatenate([faces[::2], faces[1::2] + len(vertices)])
    double = replace(
        binding,
        jacobian=np.concatenate([binding.jacobian, binding.jacobian]),
        gains=np.concatenate([binding.gains, binding.gains]),
    )
    after = unfold(double, twice, faces)
    used = np.intersect1d(
        faces[faces < len(vertices)], faces[faces >= len(vertices)] - len(vertices)
    )
    assert (after.jacobian != double.jacobian).any()
    np.testing.assert_array_equal(after.jacobian[used], after.jacobian[used + len(vertices)])
