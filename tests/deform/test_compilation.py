from __future__ import annotations

import numpy as np
from boxes import PARAMETERS, chair
from planes import airplane, plane_values

from service.deform.binding import Binding, inverse_frames
from service.deform.compilation import compile_binding
from service.deform.loft import lofts
from service.deform.proximity import Boxes
from service.template.affine import AffineTemplate


def compiled(template: AffineTemplate, f: np.ndarray, u: np.ndarray, part: np.ndarray) -> Binding:
    """Points inside parts, each wholly of its own."""
    maps = template.maps(f)
    found = lofts(template, f, maps.frames, maps.tapers, np.full(len(maps.run), -0.5))
    boxes = Boxes(maps.frames, inverse_frames(maps.frames), found)
    weights = np.eye(len(maps.run), dtype=np.float32)[part]
    return compile_binding(template, boxes, weights, u.astype(np.float32), np.ones_like(u))


def test_a_part_of_full_weight_moves_by_its_frame():
    template = chair()
    rng = np.random.default_rng(0)
    u, part = rng.uniform(-0.5, 0.5, (7, 6, 3)), rng.integers(0, 6, 7)
    df = rng.uniform(-0.1, 0.1, 8)
    own = np.concatenate([u[np.arange(7), part], np.ones((7, 1))], axis=1)
    expected = np.einsum("vij,vj->vi", (template.frame_jacobian @ df)[part], own)
    moved = compiled(template, PARAMETERS, u, part).displace(df)
    np.testing.assert_allclose(moved, expected, atol=1e-6)


def test_a_tapering_part_moves_by_its_whole_map():
    template, f = airplane(), plane_values()
    rng = np.random.default_rng(1)
    u, part = rng.uniform(-0.5, 0.5, (40, 6, 3)), rng.integers(0, 6, 40)
    df = 0.2 * f * rng.choice([-1.0, 1.0], len(f))
    moved = compiled(template, f, u, part).displace(df)
    expected = template.maps(f + df).place(u) - template.maps(f).place(u)
    np.testing.assert_allclose(moved, expected[np.arange(40), part], atol=1e-6)


def test_the_linear_maps_of_a_tapering_part_carry_short_edges():
    template, f = airplane(), plane_values()
    rng = np.random.default_rng(2)
    u, part = rng.uniform(-0.45, 0.45, (40, 6, 3)), rng.integers(0, 6, 40)
    df = 0.2 * f * rng.choice([-1.0, 1.0], len(f))
    carried = compiled(template, f, u, part).linear(df)
    rows = np.arange(40)
    before, after = (template.maps(g).derivative(u)[rows, part] for g in (f, f + df))
    np.testing.assert_allclose(carried, after @ np.linalg.inv(before), atol=2e-5)
