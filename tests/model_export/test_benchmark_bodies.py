from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import trimesh

from model_export.benchmark import bodies, bodysection, unlikebodies
from model_export.benchmark.bodies import (
    Posed,
    brought,
    changes,
    joint_table,
    moved_scores,
    moved_table,
    pose_errors,
    pose_table,
    synthetic,
    turn_errors,
)
from model_export.benchmark.characters import COARSE, Character, characters
from model_export.benchmark.unlikebodies import hair_length, sound_table, unlike
from model_export.realistic import RealisticShape
from service.mesh.surface import Normalization
from service.template.anatomy import JOINTS
from service.template.bodyfile import load_body
from service.template.skinned import Body, body_of

TEMPLATE = load_body()
MODEL: Any = SimpleNamespace(template=TEMPLATE, points=500)
HANDS = [JOINTS.index("left_hand"), JOINTS.index("right_hand")]


@pytest.fixture(scope="module")
def own() -> list[Character]:
    return characters(TEMPLATE, 2)


def rest(*_: Any) -> Body:
    return TEMPLATE.at_rest()


def bent() -> Body:
    vectors = np.zeros((24, 3))
    vectors[JOINTS.index("left_elbow"), 1] = -0.6
    return body_of(vectors, np.zeros(3), 1.0, np.array([0.1, 0.0, 0.0]))


def test_characters_wear_something_and_their_rig_knows_their_pose(own: list[Character]) -> None:
    dressed, coarse = own
    assert len(dressed.rig.points) == len(TEMPLATE.rest)
    assert len(coarse.rig.points) <= COARSE
    off = np.linalg.norm(dressed.rig.points - TEMPLATE.rest, axis=1)
    assert off.mean() > 0.005
    for one in own:
        np.testing.assert_allclose(one.rig.weights.sum(axis=1), 1.0, atol=1e-6)
        np.testing.assert_allclose(one.rig.worlds[:, :3, :3], one.turned)
        bone = JOINTS.index("left_knee"), JOINTS.index("left_hip")
        length = np.linalg.norm(np.subtract(*one.rig.positions[list(bone)]))
        assert 0.25 < length < 0.6
    assert not np.allclose(own[0].turned, own[1].turned)


@pytest.fixture
def at_rest(monkeypatch: pytest.MonkeyPatch) -> None:
    """The service finds every body at rest."""
    frame = Normalization(np.zeros(3), 1.0)
    answer = SimpleNamespace(body=rest(), normalization=frame)
    monkeypatch.setattr(bodies, "estimate_body", lambda *_, **__: answer)
    monkeypatch.setattr("model_export.bodytruth.estimate_body", lambda *_, **__: answer)
    monkeypatch.setattr(bodies, "served_fit", lambda _: rest)
    monkeypatch.setattr(unlikebodies, "served_fit", lambda _: rest)


def test_joints_and_turns_are_measured_against_the_rig(own: list[Character], at_rest: None) -> None:
    first = next(synthetic(MODEL, own))
    known = replace(first.known, joints=TEMPLATE.joints + 0.01, stature=1.7)
    turned = np.tile(np.eye(3), (24, 1, 1))
    turned[3] = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
    body = Posed(known, turned)
    np.testing.assert_allclose(turn_errors(MODEL, body, refined=True), np.eye(24)[3] * 90.0)
    cells = joint_table(MODEL, [body]).splitlines()[-1].split("|")
    assert cells[1:3] == [" synthetic ", " 1 "]
    assert float(cells[3]) == float(cells[4]) == pytest.approx(10 * np.sqrt(3), abs=0.1)
    assert float(cells[5]) == 0.0
    assert cells[6] == " 3.8 / 0.0 "
    assert cells[8] == " 1 of 1 "


def test_every_rule_is_scored_against_the_rigs(own: list[Character], at_rest: None) -> None:
    straight = replace(
        own[0],
        rig=replace(own[0].rig, worlds=np.linalg.inv(own[0].rig.binds)),
        turned=np.tile(np.eye(3), (24, 1, 1)),
    )
    lines = moved_table(moved_scores(MODEL, [straight])).splitlines()[2:]
    figures = {line.split("|")[1].strip(): float(line.split("|")[3]) for line in lines}
    assert list(figures) == list(bodies.ROWS.values())
    assert figures["blend (skinning)"] < figures["paper, k = 32"]


def test_a_body_is_brought_to_another_pose_and_keeps_its_size() -> None:
    large = replace(rest(), scale=2.0)
    after = brought(TEMPLATE, large, bent())
    assert after.scale == 2.0
    np.testing.assert_allclose(TEMPLATE.posed_joints(after)[0], TEMPLATE.posed_joints(bent())[0])
    x = TEMPLATE.decode(large)
    made = changes(x, TEMPLATE.faces, TEMPLATE, large, after)
    off = {
        rule: np.linalg.norm(y - TEMPLATE.decode(after), axis=1).mean() for rule, y in made.items()
    }
    assert off["nearest"] < 1e-6
    assert max(off.values()) < 0.01


def written(folder: Path, body: Body, name: str, **info: Any) -> RealisticShape:
    path = folder / f"{name}.ply"
    mesh = trimesh.Trimesh(TEMPLATE.decode(body), TEMPLATE.faces, process=False)
    mesh.export(path)
    joints = TEMPLATE.posed_joints(body).tolist()
    return RealisticShape(name, path, True, {"joints_smpl24": joints, **info})


def test_files_of_one_character_are_compared_vertex_by_vertex(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    one, two = rest(), bent()
    shapes = [
        written(tmp_path, body, name, character="a", vertices=9, height_m=1.7)
        for body, name in ((one, "rest"), (two, "bent"))
    ]
    shapes.append(written(tmp_path, one, "alone", character="b", vertices=9))
    fits = iter([one, two])
    monkeypatch.setattr(bodies, "served_fit", lambda _: lambda *mesh: next(fits))
    errors = pose_errors(MODEL, shapes)
    assert {len(own) for own in errors.values()} == {2}
    assert np.mean(errors["as it was"]) > 90.0
    assert np.mean(errors["nearest"]) < 0.1
    assert np.mean(errors["skin"]) < 1.0
    assert "| nearest vertex's weights | 2 | 0.0 | 0.0 |" in pose_table(errors)


def haired(shape: RealisticShape, length: float) -> RealisticShape:
    """With a strip of hair from above the head down below its joint."""
    mesh = trimesh.load(shape.path, process=False)
    head = np.array(shape.info["joints_smpl24"])[JOINTS.index("head")]
    strip = head + np.array([[0, 0.2, 0.0], [0.05, -length, -0.2], [-0.05, -length, -0.2]])
    vertices = np.concatenate([mesh.vertices, strip])
    faces = np.concatenate([mesh.faces, len(mesh.vertices) + np.array([[0, 1, 2]])])
    trimesh.Trimesh(vertices, faces, process=False).export(shape.path)
    return shape


def test_hair_and_hands_choose_the_unlike_bodies(tmp_path: Path) -> None:
    bald = written(tmp_path, rest(), "bald")
    short = haired(written(tmp_path, rest(), "short"), 0.1)
    long = haired(written(tmp_path, rest(), "long"), 0.4)
    near = written(tmp_path, bent(), "near")
    scan = haired(written(tmp_path, rest(), "scan", variant="virtual-scan"), 0.6)
    assert hair_length(bald) == 0.0
    assert hair_length(short) < hair_length(long)
    assert unlike([bald, short, long, near, scan]) == {
        "long hair": long, "hands almost together": near,
    }  # fmt: skip
    assert unlike([bald]) == {}


def test_unlike_bodies_are_judged_by_each_rule(tmp_path: Path, at_rest: None) -> None:
    lines = sound_table(MODEL, {"plain": written(tmp_path, rest(), "plain")}).splitlines()[2:]
    assert [line.split("|")[2].strip() for line in lines] == [
        bodies.ROWS[rule] for rule in ("skin", "nearest", "inpainted", "paper")
    ]
    assert all(line.startswith("| plain (plain) |") for line in lines)
    assert {line.split("|")[3].strip() for line in lines} == {"32"}


def test_a_section_has_what_the_folder_allows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(bodysection, "BodyModel", SimpleNamespace)
    monkeypatch.setattr(bodysection, "joint_table", lambda *_: "joints")
    monkeypatch.setattr(bodysection, "moved_scores", lambda *_: [])
    monkeypatch.setattr(bodysection, "moved_table", lambda *_: "moved")
    monkeypatch.setattr(bodysection, "sound_table", lambda *_: "sound")
    monkeypatch.setattr(bodysection, "real", lambda *_: [])
    said: list[str] = []
    page = bodysection.body_section(MODEL, 1, None, said.append)
    assert "joints" in page
    assert "sound" not in page
    rows = []
    for index in range(12):
        shape = written(tmp_path, rest(), f"c{index}")
        rows.append({"file": shape.path.name, "character": f"c{index}",
                     "joints_smpl24": shape.info["joints_smpl24"]})  # fmt: skip
    (tmp_path / "manifest.jsonl").write_text("\n".join(map(json.dumps, rows)), "utf-8")
    assert bodysection.body_section(MODEL, 1, tmp_path, said.append).endswith("sound")
