"""Rigged characters from GLB files, posed by their own skins: the truth for edits of bodies."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from model_export.rigfile import RigFile, node_worlds
from service.template.anatomy import JOINTS, PARENTS

Array = NDArray[np.float64]
Index = NDArray[np.int64]

_MIXAMO = {
    "pelvis": "Hips", "spine1": "Spine", "spine2": "Spine1", "spine3": "Spine2", "neck": "Neck",
    "head": "Head", "left_collar": "LeftShoulder", "left_shoulder": "LeftArm",
    "left_elbow": "LeftForeArm", "left_wrist": "LeftHand", "left_hand": "LeftHandMiddle1",
    "left_hip": "LeftUpLeg", "left_knee": "LeftLeg", "left_ankle": "LeftFoot",
    "left_foot": "LeftToeBase",
}  # fmt: skip
_UNREAL = {
    "pelvis": "pelvis", "spine1": "spine_01", "spine2": "spine_02", "spine3": "spine_03",
    "neck": "neck_01", "head": "head", "left_collar": "clavicle_l", "left_shoulder": "upperarm_l",
    "left_elbow": "lowerarm_l", "left_wrist": "hand_l", "left_hand": "middle_01_l",
    "left_hip": "thigh_l", "left_knee": "calf_l", "left_ankle": "foot_l", "left_foot": "ball_l",
}  # fmt: skip
POSES: dict[str, dict[str, tuple[float, float, float]]] = {
    "rest": {},
    "stand": {
        "left_shoulder": (0.09, -0.07, -1.28), "right_shoulder": (0.0, -0.11, 1.25),
        "left_elbow": (0.05, -0.26, -0.01), "right_elbow": (0.04, 0.2, -0.1),
    },
    "hands on hips": {
        "left_hip": (-0.1, -0.07, 0.11), "right_hip": (0.01, 0.03, -0.16),
        "left_shoulder": (1.24, -0.46, -0.77), "right_shoulder": (1.26, 0.41, 0.88),
        "left_elbow": (-0.17, -1.75, -0.04), "right_elbow": (-0.01, 1.73, 0.04),
    },
    "arms folded": {
        "left_shoulder": (0.11, -0.45, -0.86), "right_shoulder": (0.13, 0.59, 0.84),
        "left_elbow": (0.07, -1.83, -0.03), "right_elbow": (0.01, 1.89, 0.07),
    },
    "sit": {
        "left_hip": (-1.4, -0.1, 0.03), "right_hip": (-1.53, 0.03, -0.12),
        "left_knee": (1.36, 0.03, -0.01), "right_knee": (1.48, -0.04, -0.09),
        "left_shoulder": (-0.3, -0.53, -1.08), "right_shoulder": (-0.26, 0.46, 1.05),
        "left_elbow": (0.01, -0.91, -0.03), "right_elbow": (-0.01, 0.79, 0.02),
    },
}  # fmt: skip
"""Poses in which edits are made: axis-angle vectors on top of the rig's own rest."""


class RigError(ValueError):
    """A file that holds no rig that could be read."""


@dataclass(frozen=True)
class Rig:
    """A skinned character in some pose, in its file's frame and unit.

    Attributes:
        points: ``[n, 3]`` positions as stored, before any bone.
        faces: ``[m, 3]``.
        bones: ``[n, k]`` which entries of `binds` move each vertex.
        weights: ``[n, k]`` how much, one in sum a row.
        binds: ``[b, 4, 4]`` inverse bind matrices of all skins.
        node: ``[b]`` the node of each.
        worlds: ``[N, 4, 4]`` of the nodes, in this pose.
        parents: ``[N]``, -1 for a root.
        joints: ``[24]`` the node that is each of SMPL's joints, -1 where there is none.
        convention: whose names the joints carry.
    """

    points: Array
    faces: Index
    bones: Index
    weights: Array
    binds: Array
    node: Index
    worlds: Array
    parents: Index
    joints: Index
    convention: str

    @cached_property
    def vertices(self) -> Array:
        """``[n, 3]`` in this pose."""
        return self._blended((self.worlds[self.node] @ self.binds)[:, :3])

    @property
    def positions(self) -> Array:
        """``[24, 3]`` of SMPL's joints; not a number where the rig has none."""
        found = self.worlds[self.joints, :3, 3]
        return np.where(self.joints[:, None] >= 0, found, np.nan)

    def turned(self, joint: str, rotation: Array) -> Rig:
        """The rig with a joint, and all below it, turned by ``rotation [3, 3]`` of space.

        Raises:
            RigError: when the rig has no such joint.
        """
        below = self._below(joint)
        turn = np.eye(4)
        pivot = self.positions[JOINTS.index(joint)]
        turn[:3, :3], turn[:3, 3] = rotation, pivot - rotation @ pivot
        return replace(self, worlds=np.where(below[:, None, None], turn @ self.worlds, self.worlds))

    def moved_by(self, joint: str) -> tuple[Array, Array]:
        """Each vertex's weight below a joint ``[n]``, and the weighted sum ``[n, 3]`` of where
        those bones have it.

        Turned by ``R`` about ``p``, a vertex goes to ``x + (R - I) (sum - weight p)``.

        Raises:
            RigError: when the rig has no such joint.
        """
        below = self._below(joint)[self.node]
        matrices = np.where(below[:, None, None], (self.worlds[self.node] @ self.binds)[:, :3], 0.0)
        return (self.weights * below[self.bones]).sum(axis=1), self._blended(matrices)

    def _below(self, joint: str) -> NDArray[np.bool_]:
        """``[N]`` which nodes a joint carries, its own included."""
        root = int(self.joints[JOINTS.index(joint)])
        if root < 0:
            raise RigError(f"the rig has no {joint}")
        below = np.zeros(len(self.parents), bool)
        below[root] = True
        while True:
            grown = below | (below[self.parents] & (self.parents >= 0))
            if (grown == below).all():
                return below
            below = grown

    def _blended(self, matrices: Array) -> Array:
        """``[n, 3]`` weighted sums of the points under ``matrices [b, 3, 4]``."""
        blended = np.zeros((len(self.points), 3, 4))
        for bone, weight in zip(self.bones.T, self.weights.T, strict=True):
            blended += weight[:, None, None] * matrices[bone]
        moved: Array = np.einsum("nij,nj->ni", blended[:, :, :3], self.points) + blended[:, :, 3]
        return moved


def read_rig(data: bytes) -> Rig:
    """Read the skinned meshes of a GLB's nodes.

    Buffers under ``EXT_meshopt_compression`` need the package ``meshoptimizer``.

    Raises:
        RigError: no GLB, no skin, or joints that carry neither Mixamo's nor Unreal's names.
    """
    try:
        file = RigFile.of(data)
    except ValueError as error:
        raise RigError(str(error)) from error
    document = file.document
    nodes = document.get("nodes", [])
    parents = np.full(len(nodes), -1)
    for index, entry in enumerate(nodes):
        parents[entry.get("children", [])] = index
    worlds = node_worlds(nodes, parents)
    starts: list[int] = []
    binds: list[Array] = []
    owners: list[int] = []
    for skin in document.get("skins", []):
        starts.append(len(owners))
        owners += skin["joints"]
        matrices = file.read(skin["inverseBindMatrices"]).reshape(-1, 4, 4).swapaxes(1, 2)
        binds.append(matrices[: len(skin["joints"])])
    if not owners:
        raise RigError("the file has no skin")
    points, faces, bones, weights = _skinned(file, starts)
    convention, joints = _smpl([str(entry.get("name", "")) for entry in nodes])
    return Rig(
        points=points,
        faces=faces,
        bones=bones,
        weights=weights,
        binds=np.concatenate(binds),
        node=np.array(owners),
        worlds=worlds,
        parents=parents,
        joints=joints,
        convention=convention,
    )


def posed(rig: Rig, pose: dict[str, tuple[float, float, float]]) -> Rig:
    """The rig in a pose of `POSES`; joints come in the order of the tree."""
    worlds = [np.eye(3)]
    for joint, parent in zip(JOINTS[1:], PARENTS[1:], strict=True):
        turn = worlds[parent]
        if joint in pose:
            own = Rotation.from_rotvec(pose[joint]).as_matrix()
            rig = rig.turned(joint, turn @ own @ turn.T)
            turn = turn @ own
        worlds.append(turn)
    return rig


def _skinned(file: RigFile, starts: list[int]) -> tuple[Array, Index, Index, Array]:
    """Positions, faces, bones and weights of all skinned primitives, joined."""
    points: list[Array] = []
    faces: list[Index] = []
    bones: list[Index] = []
    weights: list[Array] = []
    count = 0
    for node in file.document["nodes"]:
        if "mesh" not in node or "skin" not in node:
            continue
        for primitive in file.document["meshes"][node["mesh"]]["primitives"]:
            attributes = primitive["attributes"]
            points.append(file.read(attributes["POSITION"]))
            corners = file.read(primitive["indices"]).astype(np.int64)
            faces.append(corners.reshape(-1, 3) + count)
            chosen = file.read(attributes["JOINTS_0"], scaled=False).astype(np.int64)
            bones.append(chosen + starts[node["skin"]])
            weight = file.read(attributes["WEIGHTS_0"])
            weights.append(weight / np.maximum(weight.sum(axis=1, keepdims=True), 1e-12))
            count += len(points[-1])
    return tuple(np.concatenate(lists) for lists in (points, faces, bones, weights))  # type: ignore[return-value]


def _smpl(names: list[str]) -> tuple[str, Index]:
    """Whose names the joints carry, and ``[24]`` the node of each of SMPL's, -1 where there is
    none."""
    bare = [name.removeprefix("mixamorig:").removeprefix("mixamorig") for name in names]
    for convention, known in (("Mixamo", _MIXAMO), ("Unreal", _UNREAL)):
        if known["pelvis"] not in bare or known["left_hip"] not in bare:
            continue
        chosen = []
        for joint in JOINTS:
            name = known[joint.replace("right_", "left_")]
            if joint.startswith("right_"):
                name = name.replace("Left", "Right")
                name = name.removesuffix("_l") + "_r" if name.endswith("_l") else name
            chosen.append(bare.index(name) if name in bare else -1)
        return convention, np.array(chosen)
    raise RigError("the joints carry neither Mixamo's nor Unreal's names")
