from __future__ import annotations

import numpy as np
from boxes import PARAMETERS, chair
from planes import airplane, plane_values

from service.deform.discord import discord, group_fields
from service.deform.groups import mirror_groups


def test_it_is_the_distance_that_a_strong_edit_opens():
    template = chair()
    groups = mirror_groups(template)
    local = np.zeros((1, 6, 3), np.float32)
    # The seat's middle, and the top of the back: a higher back moves it, the seat does not.
    local[0, 1, 1] = 0.5
    shares = np.ones((1, 6), np.float32) * np.float32([1, 1, 0.25, 0.25, 0.25, 0.25])
    fields = group_fields(template, shares, local, groups)
    to_group = np.array([[0.0, 0.1, 0.5]], np.float32)
    opened = discord(fields, to_group, PARAMETERS)
    assert opened[0, 0] == 0.0
    np.testing.assert_allclose(opened[0, 1], 0.4 * PARAMETERS[0], rtol=1e-5)


def test_fields_of_tapering_parts_are_their_templates_moves():
    template, f = airplane(), plane_values()
    groups = mirror_groups(template)
    u = np.random.default_rng(0).uniform(-0.5, 0.5, (5, 6, 3)).astype(np.float32)
    shares = np.zeros((5, 6), np.float32)
    shares[:, [0, 1, 3, 4]] = 1.0
    fields = group_fields(template, shares, u, groups).reshape(4, 5, 3, -1)
    df = 0.1 * f
    moved = template.maps(f + df).place(u) - template.maps(f).place(u)
    np.testing.assert_allclose(fields[1] @ df, moved[:, 1], atol=1e-6)
