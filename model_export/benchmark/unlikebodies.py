"""Bodies that the paper shows as unlike its training's: long hair, hands almost together."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from model_export.benchmark.bodies import ROWS
from model_export.benchmark.crossed import Crossed
from model_export.benchmark.score import BEST
from model_export.benchmark.validity import contacts, degenerate, flips, gap, pieces
from model_export.realistic import RealisticShape
from model_export.skin_fit import served_fit
from model_export.skin_report import bind_all, edits
from service.encode.bodymodel import BodyModel
from service.mesh.formats import read_mesh
from service.template.anatomy import JOINTS, PARENTS
from service.template.skinning import pose_joints

Array = NDArray[np.float64]
Faces = NDArray[np.int64]

TURN = 30.0
"""Degrees, either way; turned so little no face need face away from where it did."""
LONG = 1.0
"""Metres that hair is no longer than: clothes that reach over the head are none."""


@dataclass(frozen=True)
class Sound:
    """What an edit leaves of one body.

    Attributes:
        flips, degenerate: faces in a thousand.
        gap: 99th percentile of how far what touched comes apart, over the diagonal.
        crossings: pairs of faces that newly run through each other, in ten thousand faces.
    """

    flips: float
    degenerate: float
    gap: float
    crossings: float

    @property
    def passed(self) -> bool:
        """As of rigid shapes whose true edit nobody knows: crossings are told, not judged."""
        return self.flips == 0.0 and self.degenerate < BEST["degenerate"] and self.gap < BEST["gap"]


def unlike(shapes: Sequence[RealisticShape]) -> dict[str, RealisticShape]:
    """Of characters with known joints, the one with the longest hair that is a piece of its own,
    and the one whose hands are nearest to each other."""
    known = [s for s in shapes if "joints_smpl24" in s.info and not _scanned(s)]
    if len(known) < 2:
        return {}
    hands = min(known, key=hands_apart)
    others = [shape for shape in known if shape is not hands]
    return {"long hair": max(others, key=hair_length), "hands almost together": hands}


def _scanned(shape: RealisticShape) -> bool:
    return "scan" in str(shape.info.get("variant", ""))


def joint(shape: RealisticShape, name: str) -> Array:
    """``[3]`` where the manifest has it."""
    joints = np.array(shape.info["joints_smpl24"], np.float64)
    place: Array = joints[JOINTS.index(name)]
    return place


def hands_apart(shape: RealisticShape) -> float:
    """Distance of the hands."""
    return float(np.linalg.norm(joint(shape, "left_hand") - joint(shape, "right_hand")))


def hair_length(shape: RealisticShape) -> float:
    """How far pieces that are over the head, but not the largest, reach below its joint."""
    mesh = read_mesh(shape.path.read_bytes(), shape.path.name)
    head, neck = joint(shape, "head"), joint(shape, "neck")
    up = (head - neck) / np.linalg.norm(head - neck)
    height = (mesh.vertices - head) @ up
    piece = pieces(mesh.faces, len(mesh.vertices))
    size = np.bincount(piece)
    low, high = np.full((2, len(size)), np.inf)
    np.minimum.at(low, piece, height)
    np.minimum.at(high, piece, -height)
    # The crown is a hand's breadth above the joint.
    over = (-high > 0.1) & (low > -LONG) & (np.arange(len(size)) != size.argmax())
    return float(np.max(-low[over], initial=0.0))


def soundness(model: BodyModel, shape: RealisticShape) -> Iterator[tuple[str, Sound]]:
    """Each rule's edits of one body."""
    mesh = read_mesh(shape.path.read_bytes(), shape.path.name)
    x, faces, template = mesh.vertices, mesh.faces, model.template
    body = served_fit(model)(x, faces, np.full((len(JOINTS), 3), np.nan))
    turned = pose_joints(body.rotations, template.joints, PARENTS)[0]
    pivots = template.posed_joints(body)
    touching, crossed = contacts(x, pieces(faces, len(x))), Crossed(x, faces)
    thousand = 1000.0 / len(faces)
    for rule, move in bind_all(x, faces, template, body).items():
        for name, axis, angle in edits():
            if abs(angle) > TURN:
                continue
            index = JOINTS.index(name)
            vector = np.radians(angle) * turned[index][:, "xyz".index(axis)]
            rotation = Rotation.from_rotvec(vector).as_matrix()
            y = move(index, rotation, pivots[index])
            fresh = crossed.found(y).beyond([crossed.before])
            yield (
                rule,
                Sound(
                    thousand * flips(y, x, faces),
                    thousand * degenerate(y, x, faces),
                    gap(x, y, None, faces, touching),
                    10.0 * thousand * len(fresh.faces),
                ),
            )


def sound_table(model: BodyModel, cases: Mapping[str, RealisticShape]) -> str:
    """A line for each body and rule."""
    lines = [
        "| body | rule | edits | flips / 1000 | degenerate / 1000 | gaps | crossings / 10k "
        "| sound, % | crossed, % |",
        "|---" * 9 + "|",
    ]
    for name, shape in cases.items():
        found: dict[str, list[Sound]] = {}
        for rule, sound in soundness(model, shape):
            found.setdefault(rule, []).append(sound)
        for rule, own in found.items():
            flipped, collapsed, opened, crossings = np.mean(
                [list(vars(s).values()) for s in own], 0
            )
            passed = 100 * np.mean([s.passed for s in own])
            crossed = 100 * np.mean([s.crossings > 0.0 for s in own])
            lines.append(
                f"| {name} ({shape.name}) | {ROWS[rule]} | {len(own)} | {flipped:.2f} "
                f"| {collapsed:.2f} | {opened:.1e} | {crossings:.1f} | {passed:.0f} "
                f"| {crossed:.0f} |"
            )
    return "\n".join(lines)
