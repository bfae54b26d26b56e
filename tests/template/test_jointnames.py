from __future__ import annotations

from service.template.anatomy import JOINTS, MIRRORED
from service.template.jointnames import JOINT_NAMES


def test_every_joint_has_a_name_of_its_own() -> None:
    for names in JOINT_NAMES.values():
        assert len(set(names)) == len(JOINTS)


def test_known_names() -> None:
    elbow, pelvis, foot = (JOINTS.index(name) for name in ("left_elbow", "pelvis", "right_foot"))
    mixamo, vrm = JOINT_NAMES["mixamo"], JOINT_NAMES["vrm"]
    assert (mixamo[elbow], vrm[elbow]) == ("mixamorig:LeftForeArm", "leftLowerArm")
    assert (mixamo[pelvis], vrm[pelvis]) == ("mixamorig:Hips", "hips")
    assert (mixamo[foot], vrm[foot]) == ("mixamorig:RightToeBase", "rightToes")


def test_sides_are_mirrored() -> None:
    for names in JOINT_NAMES.values():
        swapped = [
            name.replace("Left", "?").replace("Right", "Left").replace("?", "Right")
            .replace("left", "?").replace("right", "left").replace("?", "right")
            for name in names
        ]  # fmt: skip
        assert swapped == [names[index] for index in MIRRORED]
