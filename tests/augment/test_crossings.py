"""Crossing faces against brute force."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from service.augment.boxtree import BoxTree
from service.augment.crossings import Crossings

Array = np.ndarray


def soup(seed: int, count: int) -> tuple[Array, Array]:
    """Triangles of random sizes anywhere in a cube."""
    rng = np.random.default_rng(seed)
    middles = rng.random((count, 1, 3))
    corners = middles + rng.normal(scale=0.3, size=(count, 3, 3)) * rng.random((count, 1, 1))
    return corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3)


def side(a: Array, b: Array, c: Array, p: Array) -> float:
    return float(np.linalg.det(np.stack([b - a, c - a, p - a])))


def pierces(edge: tuple[Array, Array], face: Array) -> bool:
    p, q = edge
    if side(*face, p) * side(*face, q) >= 0:
        return False
    sides = [side(p, q, face[i], face[(i + 1) % 3]) for i in range(3)]
    return all(s >= 0 for s in sides) or all(s <= 0 for s in sides)


def crossing(one: Array, other: Array) -> bool:
    return any(
        pierces((f[i], f[(i + 1) % 3]), g)
        for f, g in ((one, other), (other, one))
        for i in range(3)
    )


@pytest.mark.parametrize("count", [3, 17, 70])
def test_crossings_are_those_of_brute_force(count: int) -> None:
    vertices, faces = soup(count, count)
    expected = {
        (a, b)
        for a in range(count)
        for b in range(a + 1, count)
        if crossing(vertices[faces[a]], vertices[faces[b]])
    }
    found = Crossings(vertices, faces).pairs(vertices, deep=0.0)
    assert {tuple(pair) for pair in found.tolist()} == expected
    assert count < 70 or len(expected) > 10


def test_crossings_follow_the_vertices() -> None:
    vertices, faces = soup(1, 40)
    moved, _ = soup(2, 40)
    then = Crossings(vertices, faces).pairs(moved, deep=0.0)
    anew = Crossings(moved, faces).pairs(moved, deep=0.0)
    assert {tuple(p) for p in then.tolist()} == {tuple(p) for p in anew.tolist()}
    assert len(then)


def test_pairs_whose_boxes_are_near_are_all_found_once() -> None:
    vertices, faces = soup(5, 90)
    low, high = vertices[faces].min(axis=1), vertices[faces].max(axis=1)
    reach = 0.02
    apart = (low[:, None] > high[None] + reach).any(axis=2)
    expected = {(a, b) for a, b in zip(*np.nonzero(~(apart | apart.T)), strict=True) if a < b}
    found = [tuple(pair) for pair in BoxTree(vertices, faces).near(vertices, reach).tolist()]
    assert len(found) == len(set(found))
    assert set(found) == expected


def test_a_sound_mesh_crosses_nowhere_though_its_faces_touch() -> None:
    ball = trimesh.creation.icosphere(2)
    assert not len(Crossings(ball.vertices, ball.faces).pairs(ball.vertices, deep=0.0))


def test_boxes_that_lie_flush_do_not_cross() -> None:
    one = trimesh.creation.box((1, 1, 1))
    other = trimesh.creation.box((0.5, 1, 0.5))
    other.apply_translation([0, 1.0 - 1e-4, 0])
    both = trimesh.util.concatenate([one, other])
    assert not len(Crossings(both.vertices, both.faces).pairs(both.vertices))
    sunk = both.vertices.copy()
    sunk[len(one.vertices) :, 1] -= 0.2
    assert len(Crossings(both.vertices, both.faces).pairs(sunk))
