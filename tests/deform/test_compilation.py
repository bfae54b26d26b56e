from __future__ import annotations

import numpy as np
from boxes import PARAMETERS, chair
from planes import airplane, plane_values

from service.deform.binding import Binding, inverse_frames
from service.deform.compilation import Compiler, Moves
from service.deform.groups import Group, mirror_groups
from service.deform.loft import lofts
from service.deform.proximity import Boxes
from service.deform.weld import weld
from service.template.affine import AffineTemplate


def compiled(template: AffineTemplate, f: np.ndarray, u: np.ndarray, part: np.ndarray) -> Binding:
    """Points inside parts, each wholly of its own."""
    maps = template.maps(f)
    found = lofts(template, f, maps.frames, maps.tapers, np.full(len(maps.run), -0.5))
    boxes = Boxes(maps.frames, inverse_frames(maps.frames), found)
    near = np.eye(len(maps.run), dtype=np.float32)[part]
    groups = [Group((part,), {}) for part in range(len(maps.run))]
    local, shares = u.astype(np.float32), np.ones_like(near)
    fields = Moves.of(template).fields(groups, shares, local)
    compiler = Compiler(template, boxes, groups, len(u))
    compiler.add(slice(0, len(u)), fields, shares, near, local, np.ones_like(local))
    points = np.arange(3.0 * len(u)).reshape(-1, 3)
    return compiler.binding(weld(points, np.empty((0, 3), np.int64)))


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


def test_fields_of_tapering_parts_are_their_templates_moves():
    template, f = airplane(), plane_values()
    groups = mirror_groups(template)
    u = np.random.default_rng(0).uniform(-0.5, 0.5, (5, 6, 3)).astype(np.float32)
    shares = np.zeros((5, 6), np.float32)
    shares[:, [0, 1, 3, 4]] = 1.0
    field = Moves.of(template).fields(groups, shares, u)[1]
    df = 0.1 * f
    moved = np.zeros((5, 3))
    for index, values in field.items():
        axis, parameter = divmod(index, len(f))
        moved[:, axis] += values * df[parameter]
    expected = template.maps(f + df).place(u) - template.maps(f).place(u)
    np.testing.assert_allclose(moved, expected[:, 1], atol=1e-6)


def test_vertices_at_one_place_are_bound_as_one():
    template, f = chair(), PARAMETERS
    maps = template.maps(f)
    boxes = Boxes(maps.frames, inverse_frames(maps.frames))
    groups = mirror_groups(template)
    welded = weld(np.array([[0.0, 0, 0], [1, 0, 0], [0.0, 0, 0]]), np.empty((0, 3), np.int64))
    local = np.random.default_rng(3).uniform(-0.5, 0.5, (2, 6, 3)).astype(np.float32)
    shares, near = np.ones((2, 6), np.float32), np.full((2, 3), 1 / 3, np.float32)
    compiler = Compiler(template, boxes, groups, 2)
    fields = Moves.of(template).fields(groups, shares, local)
    compiler.add(slice(0, 2), fields, shares, near, local, np.ones_like(local))
    binding = compiler.binding(welded)
    assert binding.jacobian.shape == (3, 3, len(f))
    np.testing.assert_array_equal(binding.jacobian[0], binding.jacobian[2])
    np.testing.assert_array_equal(binding.gains[0], binding.gains[2])
    assert (binding.jacobian[0] != binding.jacobian[1]).any()
