from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from service.encode.distance import Cloud
from service.encode.residuals import EXTENT_SCALE, Matcher, MovingSamples, normal_equations
from service.mesh.surface import sample_surface
from service.template.affine import AffineTemplate
from service.template.loader import compile_template

SLAB = compile_template({
    "name": "slab", "label": "Slab", "points": 500,
    "parameters": {
        "width": {"label": "Width", "group": "slab", "range": [0.2, 1.0]},
        "height": {"label": "Height", "group": "slab", "range": [0.02, 1.0]},
    },
    "parts": {"slab": {"shape": "box", "cells": [4, 4, 4], "center": [0, 0, 0],
                       "size": ["width", "height", "width"]}},
    "keep": {"middle": [0, 0, 0]},
})  # fmt: skip


def cloud_of(template: AffineTemplate, f: Any, count: int = 4000) -> Cloud:
    vertices = template.decode(np.asarray(f, float))
    samples = sample_surface(vertices, template.faces, count, np.random.default_rng(1))
    return Cloud(samples.points, samples.normals)


def fitted(cloud: Cloud, start: Any, scale: float, steps: int = 25) -> np.ndarray:
    """``[d]`` where plain Gauss-Newton steps end."""
    state = np.array([*start, 0.0, 0.0, 0.0])
    moving, matcher = MovingSamples(SLAB, state[:2], 800), Matcher(cloud, 0.1)
    for _ in range(steps):
        system = normal_equations(moving, matcher, state, scale)
        state = state - np.linalg.solve(system.hessian + 1e-9 * np.eye(5), system.gradient)
    return state


def test_at_the_answer_there_is_nothing_to_do() -> None:
    cloud, state = cloud_of(SLAB, [0.6, 0.1]), np.array([0.6, 0.1, 0, 0, 0])
    moving, matcher = MovingSamples(SLAB, state[:2], 800), Matcher(cloud, 0.1)
    system = normal_equations(moving, matcher, state, 0.05)
    assert system.hessian.shape == (5, 5)
    np.testing.assert_allclose(system.hessian, system.hessian.T, atol=1e-12)
    assert np.linalg.eigvalsh(system.hessian).min() > 0
    step = np.linalg.solve(system.hessian, -system.gradient)
    assert np.abs(step).max() < 2e-3
    away = normal_equations(moving, matcher, state + 0.05 * np.eye(5)[0], 0.05)
    assert away.cost > 1.5 * system.cost


def test_extents_move_with_the_vertices_that_reach_them() -> None:
    moving = MovingSamples(SLAB, np.array([0.6, 0.1]), 100)
    ends, rows = moving.extents(np.array([0.6, 0.1, 0.0, 0.2, 0.0]))
    np.testing.assert_allclose(ends, [[-0.3, 0.15, -0.3], [0.3, 0.25, 0.3]])
    np.testing.assert_allclose(rows[:, 0, 0], [-0.5, 0.5])
    np.testing.assert_allclose(rows[:, 1, 1], [-0.5, 0.5])
    np.testing.assert_allclose(rows[..., 2:], np.broadcast_to(np.eye(3), (2, 3, 3)))


def test_the_template_grows_to_the_extents_of_the_upload() -> None:
    cloud = cloud_of(SLAB, [0.6, 0.1])
    state = fitted(cloud, [0.57, 0.1], 0.04)
    extents = np.ptp(cloud.points, axis=0)
    assert state[0] == pytest.approx(extents[0], abs=2e-3)
    assert state[1] == pytest.approx(extents[1], abs=2e-3)


def test_a_pole_far_outside_is_no_extent() -> None:
    cloud = cloud_of(SLAB, [0.6, 0.1])
    pole = np.stack([np.zeros(60), np.linspace(0.1, 10 * EXTENT_SCALE, 60), np.zeros(60)], axis=1)
    normals = np.tile([1.0, 0.0, 0.0], (60, 1))
    both = Cloud(np.concatenate([cloud.points, pole]), np.concatenate([cloud.normals, normals]))
    state = fitted(both, [0.6, 0.1], 0.04)
    assert state[1] == pytest.approx(0.1, abs=0.01)


def test_a_box_encloses_a_rounded_shape() -> None:
    # A disc of the width's diameter: the mean of its rim lies well inside of the square around it.
    angle = np.random.default_rng(0).uniform(0, 2 * np.pi, 3000)
    radius = 0.3 * np.sqrt(np.random.default_rng(1).uniform(0, 1, 2000))
    rim = np.stack([0.3 * np.cos(angle), np.linspace(-0.03, 0.03, 3000), 0.3 * np.sin(angle)], 1)
    inner = angle[:2000]
    flat = np.stack([radius * np.cos(inner), np.full(2000, 0.03), radius * np.sin(inner)], axis=1)
    up = np.tile([0.0, 1.0, 0.0], (2000, 1))
    outward = rim * [1, 0, 1] / 0.3
    cloud = Cloud(
        np.concatenate([rim, flat, flat * [1, -1, 1]]), np.concatenate([outward, up, -up])
    )
    width = fitted(cloud, [0.55, 0.06], 0.04)[0]
    assert 0.55 < width < 0.62
