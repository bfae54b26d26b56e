"""What other skeletons call SMPL's joints.

Mixamo's files and VRM's humanoids turn no joint in the T-pose, as SMPL does not, so that rotations
mean the same under each of the names.
"""

from __future__ import annotations

from service.template.anatomy import JOINTS

_MIDDLE = {
    "pelvis": ("Hips", "hips"),
    "spine1": ("Spine", "spine"),
    "spine2": ("Spine1", "chest"),
    "spine3": ("Spine2", "upperChest"),
    "neck": ("Neck", "neck"),
    "head": ("Head", "head"),
}
_SIDES = {
    "hip": ("UpLeg", "UpperLeg"),
    "knee": ("Leg", "LowerLeg"),
    "ankle": ("Foot", "Foot"),
    "foot": ("ToeBase", "Toes"),
    "collar": ("Shoulder", "Shoulder"),
    "shoulder": ("Arm", "UpperArm"),
    "elbow": ("ForeArm", "LowerArm"),
    "wrist": ("Hand", "Hand"),
    "hand": ("HandMiddle1", "MiddleProximal"),
}


def _both(joint: str) -> tuple[str, str]:
    if joint in _MIDDLE:
        mixamo, vrm = _MIDDLE[joint]
        return f"mixamorig:{mixamo}", vrm
    side, name = joint.split("_")
    mixamo, vrm = _SIDES[name]
    return f"mixamorig:{side.capitalize()}{mixamo}", f"{side}{vrm}"


JOINT_NAMES: dict[str, tuple[str, ...]] = {
    "smpl": JOINTS,
    "mixamo": tuple(_both(joint)[0] for joint in JOINTS),
    "vrm": tuple(_both(joint)[1] for joint in JOINTS),
}
"""Names in the order of `JOINTS`, by whose they are."""
