from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from service.template.shapes import BUILDERS, RUN, unit_shape

ENTRIES: dict[str, dict[str, Any]] = {
    "box": {"cells": [2, 3, 4]},
    "tube": {"cells": [8, 4], "power": 3},
    "ellipsoid": {"cells": [8, 6]},
    "fuselage": {"cells": [8, 12], "nose": 0.2, "tail": 0.4},
    "panel": {"cells": [4, 6]},
}


def test_every_shape_has_an_entry_here() -> None:
    assert set(ENTRIES) == set(BUILDERS) == set(RUN)


@pytest.mark.parametrize("kind", ENTRIES)
def test_shapes_fill_the_unit_cube_whichever_way_they_lie(kind: str) -> None:
    for along in "xyz":
        shape = unit_shape({"shape": kind, **ENTRIES[kind]}, along)
        ends = [shape.vertices.min(axis=0), shape.vertices.max(axis=0)]
        np.testing.assert_allclose(ends, [[-0.5] * 3, [0.5] * 3], atol=1e-12)


@pytest.mark.parametrize("kind", ["tube", "panel"])
@pytest.mark.parametrize("along", ["x", "y", "z"])
def test_the_flat_ends_lie_across_the_run(kind: str, along: str) -> None:
    shape = unit_shape({"shape": kind, **ENTRIES[kind]}, along)
    axis = "xyz".index(along)
    for side, place in (("start", -0.5), ("end", 0.5)):
        faces = shape.faces[shape.side == shape.sides.index(side)]
        assert (shape.vertices[faces][..., axis] == place).all()


def test_options_reach_the_shape() -> None:
    square = unit_shape({"shape": "tube", "cells": [8, 3], "power": 50}, "z")
    round_ = unit_shape({"shape": "tube", "cells": [8, 3]}, "z")
    assert np.linalg.norm(square.vertices[1, :2]) > 1.3 * np.linalg.norm(round_.vertices[1, :2])


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        ({"shape": "sphere", "cells": [8, 8]}, "no shape is named 'sphere'; there are box, tube"),
        ({"shape": "box", "cells": [8, 8]}, "cells of a box are 3 numbers"),
        ({"shape": "box", "cells": [1, 0, 1]}, "cells of a box are 3 numbers"),
        ({"shape": "tube", "cells": [2, 8]}, "cells of a tube are 2 numbers, .4, 1. at the least"),
        ({"shape": "tube", "cells": [6, 8]}, "6 vertices around at power 2"),
        (
            {"shape": "tube", "cells": [8, 8], "power": 0},
            "give a multiple of 4 and a positive power",
        ),
        ({"shape": "ellipsoid", "cells": [8, 5]}, "10 vertices around"),
        ({"shape": "panel", "cells": [8]}, "cells of a panel are 2 numbers"),
        ({"shape": "fuselage", "cells": [8, 8], "nose": 0.7, "tail": 0.7}, "nose 0.7 and tail 0.7"),
    ],
)
def test_what_makes_no_shape_is_refused(entry: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        unit_shape(entry, "y")
