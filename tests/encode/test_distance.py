from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from service.encode.distance import Cloud, surface_distance
from service.mesh.surface import sample_surface
from service.template.affine import AffineTemplate
from service.template.loader import compile_template

# A cube whose top is a part of its own, hidden unless `open`.
CUBE: dict[str, Any] = {
    "name": "cube",
    "label": "Cube",
    "points": 4000,
    "parameters": {"size": {"label": "Size", "group": "all", "range": [0.5, 2]}},
    "parts": {"all": {"shape": "box", "cells": [4, 4, 4], "center": [0] * 3, "size": ["size"] * 3}},
    "keep": {"center": [0, 0, 0]},
}
ORIGIN = np.zeros(3)


@pytest.fixture(scope="module")
def cube() -> AffineTemplate:
    return compile_template(CUBE)


def sampled(template: AffineTemplate, size: float, seed: int = 3, count: int = 4000) -> Cloud:
    vertices = template.decode(np.array([size]))
    samples = sample_surface(vertices, template.faces, count, np.random.default_rng(seed))
    return Cloud(samples.points, samples.normals)


def test_a_true_fit_has_next_to_no_distance(
    chair: AffineTemplate, plain: np.ndarray, labelled: Any
) -> None:
    for seed in range(3):
        cloud, f, t = labelled(plain, seed=seed)
        assert 0 <= surface_distance(chair, f, t, cloud) < 0.002


def test_distance_grows_with_the_error(
    chair: AffineTemplate, plain: np.ndarray, labelled: Any
) -> None:
    cloud, f, t = labelled(plain)
    for direction in np.eye(3):
        off = [surface_distance(chair, f, t + e * direction, cloud) for e in (0, 0.02, 0.05, 0.1)]
        assert (np.diff(off) > 0.001).all()
    for index in (0, 3, 4, 5):
        wrong = f.copy()
        off = []
        for factor in (1.0, 1.2, 1.5):
            wrong[index] = f[index] * factor
            off.append(surface_distance(chair, wrong, t, cloud))
        assert (np.diff(off) > 0.001).all()


def test_size_place_and_unit_make_no_difference(
    chair: AffineTemplate, plain: np.ndarray, labelled: Any
) -> None:
    cloud, f, t = labelled(plain)
    t = t + np.array([0, 0.05, 0.02])
    expected = surface_distance(chair, f, t, cloud)
    larger = Cloud(70 * cloud.points, cloud.normals)
    assert surface_distance(chair, 70 * f, 70 * t, larger) == pytest.approx(expected, rel=1e-6)
    place = np.array([3.0, -2.0, 1.0])
    moved = Cloud(cloud.points + place, cloud.normals)
    assert surface_distance(chair, f, t + place, moved) == pytest.approx(expected, rel=1e-6)


def test_the_gap_between_concentric_cubes_is_its_own_measure(cube: AffineTemplate) -> None:
    # Every point of the smaller cube is 0.05 from the larger; back, edges and corners add a bit.
    expected = 0.05 / (1.1 * np.sqrt(3))
    distance = surface_distance(cube, np.array([1.0]), ORIGIN, sampled(cube, 1.1))
    assert expected * 0.97 < distance < expected * 1.1


def test_both_ways_count_alike(cube: AffineTemplate) -> None:
    # A cloud that lacks half of the cube: one way is nothing, the other is what is missing.
    whole = sampled(cube, 1.0, count=8000)
    half = whole.points[:, 1] < 0
    distance = surface_distance(
        cube, np.array([1.0]), ORIGIN, Cloud(whole.points[half], whole.normals[half])
    )
    # Of the template, the top (1/6 of the area) is 0.5 away and more inside, the upper sides
    # (1/3 of it) up to 0.5; the mean of both ways is half of that.
    diagonal = np.sqrt(1 + 1 + 0.25)
    top, sides = 0.5 / 6, 0.25 / 3
    assert 0.5 * sides / diagonal < distance < 0.5 * (1.3 * top + sides) / diagonal


def test_the_spacing_of_the_samples_is_no_distance(cube: AffineTemplate) -> None:
    for count in (300, 1000, 4000):
        assert surface_distance(cube, np.ones(1), ORIGIN, sampled(cube, 1.0, count=count)) < 3e-3


def test_hidden_faces_are_no_part_of_the_surface(
    chair: AffineTemplate, plain: np.ndarray, labelled: Any
) -> None:
    f = plain.copy()
    f[chair.names.index("leg_depth")] = f[chair.names.index("leg_width")] = 0.16
    cloud, f, t = labelled(f)
    vertices = chair.decode(f) + t
    closed = sample_surface(vertices, chair.faces[chair.hidden], 500, np.random.default_rng(0))
    inside = Cloud(
        np.concatenate([cloud.points, closed.points]),
        np.concatenate([cloud.normals, closed.normals]),
    )
    # Points under the seat are on the seat's own bottom: nothing is gained by hidden faces.
    assert surface_distance(chair, f, t, inside) < 0.003


def test_it_is_the_same_each_time(chair: AffineTemplate, plain: np.ndarray, labelled: Any) -> None:
    cloud, f, t = labelled(plain, noise=0.01)
    assert surface_distance(chair, f, t, cloud) == surface_distance(chair, f, t, cloud)
