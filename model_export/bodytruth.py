"""Errors of inferred bodies against known joints: synthetic ones, and real characters' own rigs."""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from model_export.bodies import Garments, SyntheticBodies
from model_export.realistic import RealisticShape
from service.encode.bodyestimate import BodyEncoder, BodyEstimate, estimate_body
from service.mesh.formats import read_mesh
from service.mesh.surface import Samples, sample_surface
from service.template.anatomy import JOINTS
from service.template.skinned import SkinnedTemplate

Array = NDArray[np.float64]

STATURE = 1.7
"""Metres: errors are given for a body that tall."""
TORSO = [
    JOINTS.index(name)
    for name in ("pelvis", "left_hip", "right_hip", "spine2", "spine3", "neck", "left_shoulder",
                 "right_shoulder")
]  # fmt: skip
"""Joints that tell which way a body faces."""
RIGHT = 30.0
"""Degrees within which that is right."""
TEST_SEED = 10_000_019


@dataclass(frozen=True)
class KnownBody:
    """A body whose joints are known.

    Attributes:
        name, source: what it is, and where it is from.
        samples: of its surface, metres, as it stands in its file.
        joints: ``[24, 3]`` likewise.
        stature: its height when upright, in metres.
    """

    name: str
    source: str
    samples: Samples
    joints: Array
    stature: float

    def turned(self, rotation: Array) -> KnownBody:
        """The same body turned by ``rotation [3, 3]`` of space."""
        samples = Samples(
            self.samples.points @ rotation.T,
            self.samples.normals @ rotation.T,
            self.samples.faces,
            self.samples.barycentric,
        )
        return KnownBody(self.name, self.source, samples, self.joints @ rotation.T, self.stature)


@dataclass(frozen=True)
class BodyError:
    """How far off an answer is.

    Attributes:
        known: the truth.
        encoder, refined: ``[24, 3]`` joints answered less the true ones, in millimetres at a
            stature of 1.7 m, in the axes of the truth's torso.
        facing: degrees between the torso's orientations.
        seconds: of processor time that the refined answer took.
    """

    known: KnownBody
    encoder: Array
    refined: Array
    facing: float
    seconds: float


def character_bodies(shapes: Sequence[RealisticShape], points: int) -> list[KnownBody]:
    """Characters with rigs; the manifest has their joints (``joints_smpl24``) in metres."""
    bodies = []
    for shape in shapes:
        mesh = read_mesh(shape.path.read_bytes(), shape.path.name)
        rng = np.random.default_rng(0)
        samples = sample_surface(mesh.vertices, mesh.visible, points, rng)
        joints = np.array(shape.info["joints_smpl24"], dtype=np.float64)
        stature = float(shape.info.get("stature_m") or _stature(joints))
        source = str(shape.info.get("character", shape.name)).split("_")[0]
        bodies.append(KnownBody(shape.name, source, samples, joints, stature))
    return bodies


def _stature(joints: Array) -> float:
    """Height of a body when it stands straight, from the lengths of its bones."""
    chain = ("head", "neck", "spine3", "spine2", "spine1", "pelvis")
    spine = sum(_gap(joints, a, b) for a, b in pairwise(chain))
    legs = [
        _gap(joints, f"{side}_hip", f"{side}_knee") + _gap(joints, f"{side}_knee", f"{side}_ankle")
        for side in ("left", "right")
    ]
    # Sole below the ankle, crown above the head's joint, hips below the pelvis.
    return spine + float(np.mean(legs)) + 0.27


def _gap(joints: Array, a: str, b: str) -> float:
    return float(np.linalg.norm(joints[JOINTS.index(a)] - joints[JOINTS.index(b)]))


def synthetic_bodies(
    template: SkinnedTemplate, garments: Garments, count: int, points: int
) -> list[KnownBody]:
    """Fresh bodies, in metres of their own stature."""
    batch = SyntheticBodies(template, garments, TEST_SEED).batch(count, points)
    bodies = []
    for index in range(count):
        scale = float(batch.scale[index])
        cloud = batch.points[index].numpy().astype(np.float64) / scale
        normals = batch.normals[index].numpy().astype(np.float64)
        none = np.zeros(points, dtype=np.int64)
        samples = Samples(cloud, normals, none, np.zeros((points, 3)))
        joints = batch.joints[index].numpy().astype(np.float64) / scale
        rest = template.shaped(batch.shape[index].numpy().astype(np.float64))[0]
        stature = float(np.ptp(rest[:, 1]))
        bodies.append(KnownBody(f"synthetic_{index}", "synthetic", samples, joints, stature))
    return bodies


def body_errors(
    model: BodyEncoder, bodies: Iterable[KnownBody], turn: np.random.Generator | None = None
) -> list[BodyError]:
    """Errors of a model's answers; with a generator, for bodies turned every way."""
    errors = []
    for known in bodies:
        if turn is not None:
            known = known.turned(Rotation.random(random_state=turn).as_matrix())
        rough = estimate_body(model, known.samples, refined=False, metre=1.0)
        began = time.process_time()
        fit = estimate_body(model, known.samples, refined=True, metre=1.0)
        seconds = time.process_time() - began
        own, rotation = torso(known.joints), STATURE / known.stature * 1000.0
        joints = [_joints(model.template, answer) for answer in (rough, fit)]
        encoder, refined = ((found - known.joints) * rotation @ own for found in joints)
        between = Rotation.from_matrix(torso(joints[1]).T @ own)
        facing = float(np.degrees(between.magnitude()))
        errors.append(BodyError(known, encoder, refined, facing, seconds))
    return errors


def _joints(template: SkinnedTemplate, answer: BodyEstimate) -> Array:
    return answer.normalization.invert(template.posed_joints(answer.body))


def torso(joints: Array) -> Array:
    """``[3, 3]`` columns: a body's left, up along its spine, and front, from ``joints [24, 3]``."""
    left = sum(
        joints[JOINTS.index(f"left_{name}")] - joints[JOINTS.index(f"right_{name}")]
        for name in ("hip", "shoulder")
    )
    up = joints[JOINTS.index("neck")] - joints[JOINTS.index("pelvis")]
    up = up / np.linalg.norm(up)
    front = np.cross(left, up)
    front /= np.linalg.norm(front)
    return np.stack([np.cross(up, front), up, front], axis=1)


def without_offsets(errors: Sequence[BodyError]) -> list[Array]:
    """``[24, 3]`` of each answer, less each joint's mean over its source: where rigs put joints
    differs by centimetres."""
    means = {
        source: np.mean([e.refined for e in errors if e.known.source == source], axis=0)
        for source in {e.known.source for e in errors}
    }
    return [error.refined - means[error.known.source] for error in errors]


def mpjpe(rows: Sequence[Array]) -> float:
    """Mean joint error in millimetres."""
    return round(float(np.mean([np.linalg.norm(row, axis=1) for row in rows])), 1)


def body_summary(errors: Sequence[BodyError]) -> dict[str, object]:
    """What a card says of them."""
    joint = np.mean([np.linalg.norm(error.refined, axis=1) for error in errors], axis=0)
    return {
        "bodies": len(errors),
        "encoder_mm": mpjpe([error.encoder for error in errors]),
        "refined_mm": mpjpe([error.refined for error in errors]),
        "refined_median_mm": round(
            float(np.median([np.linalg.norm(e.refined, axis=1).mean() for e in errors])), 1
        ),
        "refined_without_offsets_mm": mpjpe(without_offsets(errors)),
        "facing_right_percent": round(100 * float(np.mean([e.facing < RIGHT for e in errors])), 1),
        "seconds_median": round(float(np.median([error.seconds for error in errors])), 3),
        "joints_mm": {
            name: round(float(value), 1) for name, value in zip(JOINTS, joint, strict=True)
        },
    }
