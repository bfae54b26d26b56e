from __future__ import annotations

from boxes import chair

from service.deform.groups import hub_parts, mirror_groups


def test_the_legs_are_a_group_and_know_their_images():
    template = chair()
    groups = mirror_groups(template)
    assert [[template.parts[m] for m in g.members] for g in groups] == [
        ["seat"],
        ["back"],
        ["front_right_leg", "front_left_leg", "rear_right_leg", "rear_left_leg"],
    ]
    assert groups[2].partners == {0: (1, 0, 3, 2), 2: (2, 3, 0, 1)}
    assert not groups[0].partners


def test_the_seat_is_the_hub():
    assert hub_parts(chair()).tolist() == [True, False, False, False, False, False]
