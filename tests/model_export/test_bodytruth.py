from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from model_export.bodies import Garments
from model_export.bodytruth import (
    BodyError,
    KnownBody,
    body_errors,
    body_summary,
    character_bodies,
    mpjpe,
    synthetic_bodies,
    torso,
    without_offsets,
)
from model_export.realistic import find_shapes
from service.encode.bodyoutputs import BodyEncoding
from service.mesh.frame import Orientation
from service.mesh.surface import sample_surface
from service.template.anatomy import JOINTS
from service.template.bodyfile import load_body
from service.template.skinned import SkinnedTemplate, body_of

COUNT = len(JOINTS)


class Rigid:
    """A model that takes every body for the one at rest, upright and where the cloud is."""

    def __init__(self, human: SkinnedTemplate) -> None:
        self.template = human
        self.discriminator = self

    def odds(
        self, cloud: NDArray[np.float64], orientations: Sequence[Orientation]
    ) -> NDArray[np.float64]:
        """The first is right."""
        return -50.0 * np.arange(len(orientations))

    def encode(self, points: NDArray[np.float64]) -> BodyEncoding:
        """The body at rest, its height that of the cloud."""
        rest = self.template.rest
        scale = float(np.ptp(points[:, 1]) / np.ptp(rest[:, 1]))
        middle = rest.mean(axis=0)
        joints = scale * (self.template.joints - middle)
        return BodyEncoding(joints, np.tile(np.eye(3), (COUNT, 1, 1)), np.zeros(3), scale)


def error(source: str, gaps: NDArray[np.float64], facing: float = 0.0) -> BodyError:
    human = load_body()
    bodies = synthetic_bodies(human, Garments.none(), 1, 50)
    return BodyError(replace(bodies[0], source=source), gaps, gaps, facing, 0.1)


def test_synthetic_bodies_are_in_metres(human: SkinnedTemplate) -> None:
    bodies = synthetic_bodies(human, Garments.none(), 8, 300)
    assert len(bodies) == 8
    for body in bodies:
        assert 1.2 < body.stature < 2.2
        shin = body.joints[JOINTS.index("left_knee")] - body.joints[JOINTS.index("left_ankle")]
        assert 0.3 < np.linalg.norm(shin) < 0.6


def test_characters_are_read_with_their_joints(human: SkinnedTemplate, tmp_path: Path) -> None:
    trimesh.Trimesh(human.rest, human.faces, process=False).export(tmp_path / "a.ply")
    row = {
        "id": "a",
        "file": "a.ply",
        "character": "kit_07",
        "joints_smpl24": human.joints.tolist(),
    }
    (tmp_path / "manifest.jsonl").write_text(json.dumps(row) + "\n")
    (body,) = character_bodies(find_shapes(tmp_path), 200)
    assert body.source == "kit"
    assert body.samples.points.shape == (200, 3)
    assert np.allclose(body.joints, human.joints)
    assert body.stature == pytest.approx(1.70, abs=0.06)


def test_a_body_at_rest_is_found_and_a_turned_one_is_not(human: SkinnedTemplate) -> None:
    rest = synthetic_at_rest(human)
    model = Rigid(human)
    (found,) = body_errors(model, [rest])
    assert mpjpe([found.refined]) < 15
    assert found.facing < 5
    assert found.seconds > 0.0
    turned = rest.turned(Rotation.from_euler("y", 180, degrees=True).as_matrix())
    assert np.allclose(turned.joints[:, 0], -rest.joints[:, 0])
    (lost,) = body_errors(model, [turned])
    assert lost.facing > 90
    summary = body_summary([found, lost])
    assert summary["facing_right_percent"] == 50.0
    assert summary["bodies"] == 2


def synthetic_at_rest(human: SkinnedTemplate) -> KnownBody:
    body = body_of(np.zeros((COUNT, 3)), np.zeros(3), 1.0, np.zeros(3))
    samples = sample_surface(human.decode(body), human.faces, 900, np.random.default_rng(0))
    return KnownBody("rest", "synthetic", samples, human.posed_joints(body), 1.7)


def test_the_torso_tells_which_way_a_body_faces(human: SkinnedTemplate) -> None:
    axes = torso(human.joints)
    assert np.allclose(axes.T @ axes, np.eye(3))
    assert np.allclose(axes, np.eye(3), atol=0.1)
    turn = Rotation.from_euler("xyz", (0.5, -1.0, 2.0)).as_matrix()
    assert np.allclose(torso(human.joints @ turn.T), turn @ axes)


def test_offsets_of_a_source_are_taken_out() -> None:
    rng = np.random.default_rng(0)
    offset = 50.0 * rng.standard_normal((COUNT, 3))
    noise = rng.standard_normal((6, COUNT, 3))
    errors = [error("rig", offset + own) for own in noise]
    errors.append(error("other", 3.0 * offset))
    rows = without_offsets(errors)
    assert mpjpe([e.refined for e in errors]) > 60
    assert mpjpe(rows[:6]) < 3
    assert mpjpe(rows[6:]) == 0.0
