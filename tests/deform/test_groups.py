from __future__ import annotations

import numpy as np
from boxes import chair

from service.deform.followers import following
from service.deform.groups import hub_parts, mirror_groups
from service.template.loader import load_template


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


def test_legs_are_a_group_whatever_follows_what_they_stand_at():
    template = load_template("chair").variants[0]
    values = dict(zip(template.names, (template.low + template.high).tolist(), strict=True))
    f = template.vector({name: value / 2 for name, value in values.items()} | {"seat_taper": 0.1})
    moving = following(template, f)
    front, rear = (moving.parts.index(f"{end}_right_leg") for end in ("front", "rear"))
    width = moving.names.index("seat_width")
    at = moving.frame_jacobian[[front, rear], 0, 3, width]
    assert abs(np.diff(at)[0]) > 0.05
    legs = next(g for g in mirror_groups(moving) if front in g.members)
    assert len(legs.members) == 4
    assert set(legs.partners) == {0, 2}
