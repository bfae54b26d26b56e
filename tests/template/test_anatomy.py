from __future__ import annotations

import numpy as np

from service.template.anatomy import GROUPS, JOINTS, MIRRORED, PARENTS, descendants, limits


def test_the_tree_has_smpls_joints_each_after_its_parent() -> None:
    assert len(JOINTS) == len(PARENTS) == len(set(JOINTS)) == 24
    assert PARENTS[0] == -1
    assert all(0 <= parent < joint for joint, parent in enumerate(PARENTS) if joint)
    assert JOINTS[PARENTS[JOINTS.index("left_elbow")]] == "left_shoulder"
    assert JOINTS[PARENTS[JOINTS.index("right_ankle")]] == "right_knee"


def test_mirroring_swaps_the_sides_and_keeps_the_tree() -> None:
    assert JOINTS[MIRRORED[JOINTS.index("left_hand")]] == "right_hand"
    assert MIRRORED[JOINTS.index("neck")] == JOINTS.index("neck")
    for joint, other in enumerate(MIRRORED):
        assert MIRRORED[other] == joint
        assert joint == 0 or MIRRORED[PARENTS[joint]] == PARENTS[other]


def test_groups_hold_every_joint_but_the_root_once() -> None:
    named = [name for group in GROUPS.values() for name in group]
    assert sorted(named) == sorted(JOINTS[1:])


def test_limits_hold_rest_and_are_mirrored() -> None:
    low, high = limits()
    assert low.shape == high.shape == (24, 3)
    assert (low < 0).all()
    assert (high > 0).all()
    assert np.allclose(high[0], np.pi)
    assert np.allclose(low[0], -np.pi)
    # A mirror image in x turns the other way about y and z, and the same way about x.
    for joint, other in enumerate(MIRRORED):
        if other == joint:
            continue
        assert np.allclose(low[other], [low[joint, 0], -high[joint, 1], -high[joint, 2]])
        assert np.allclose(high[other], [high[joint, 0], -low[joint, 1], -low[joint, 2]])


def test_what_is_in_the_middle_bends_to_both_sides_alike() -> None:
    low, high = limits()
    for joint, other in enumerate(MIRRORED):
        if other == joint:
            assert np.allclose(low[joint, 1:], -high[joint, 1:])


def test_joints_carry_those_that_hang_from_them() -> None:
    carries = descendants()
    assert carries.shape == (24, 24)
    assert carries.diagonal().all()
    assert carries[0].all()
    elbow = JOINTS.index("left_elbow")
    carried = {JOINTS[joint] for joint in np.flatnonzero(carries[elbow])}
    assert carried == {"left_elbow", "left_wrist", "left_hand"}
    for joint in range(24):
        ancestors = set()
        at = joint
        while at >= 0:
            ancestors.add(at)
            at = PARENTS[at]
        assert set(np.flatnonzero(carries[:, joint])) == ancestors
