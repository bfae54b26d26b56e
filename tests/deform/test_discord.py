from __future__ import annotations

import numpy as np
from boxes import PARAMETERS, chair

from service.deform.compilation import Moves
from service.deform.discord import discord
from service.deform.groups import mirror_groups


def test_it_is_the_distance_that_a_strong_edit_opens():
    template = chair()
    groups = mirror_groups(template)
    local = np.zeros((1, 6, 3), np.float32)
    # The seat's middle, and the top of the back: a higher back moves it, the seat does not.
    local[0, 1, 1] = 0.5
    shares = np.ones((1, 6), np.float32) * np.float32([1, 1, 0.25, 0.25, 0.25, 0.25])
    fields = Moves.of(template).fields(groups, shares, local)
    to_group = np.array([[0.0, 0.1, 0.5]], np.float32)
    opened = discord(fields, to_group, PARAMETERS)
    assert opened[0, 0] == 0.0
    np.testing.assert_allclose(opened[0, 1], 0.4 * PARAMETERS[0], rtol=1e-5)
