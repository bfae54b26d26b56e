"""The unit shapes by the names that template files give them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from service.template.box import box
from service.template.panel import panel
from service.template.rounds import ellipsoid, fuselage, tube
from service.template.unitshape import UnitShape

BUILDERS: dict[str, tuple[Callable[..., UnitShape], tuple[int, ...], tuple[str, ...]]] = {
    "box": (box, (1, 1, 1), ()),
    "tube": (tube, (4, 1), ("power",)),
    "ellipsoid": (ellipsoid, (4, 2), ("power",)),
    "fuselage": (fuselage, (4, 3), ("nose", "tail", "upsweep", "power")),
    "panel": (panel, (1, 2), ()),
}
"""Each shape's builder, the least of its `cells`, and its options."""

LAID = {
    "tube": {"x": "yzx", "y": "zxy", "z": "xyz"},
    "ellipsoid": {"x": "yzx", "y": "zxy", "z": "xyz"},
    "panel": {"x": "xyz", "y": "yxz", "z": "zyx"},
}
"""How shapes that can lie along any axis are turned to it (see `UnitShape.turned`)."""

RUN = {"box": "y", "tube": "y", "ellipsoid": "y", "fuselage": "z", "panel": "x"}
"""The axis that each shape runs along when the file says none."""


def unit_shape(entry: Mapping[str, Any], along: str) -> UnitShape:
    """The unit shape of a part's entry, laid along an axis.

    Args:
        entry: ``shape``, ``cells`` and the shape's own options.
        along: ``"x"``, ``"y"`` or ``"z"``; boxes and fuselages stay as they are.

    Raises:
        ValueError: for an unknown shape, or cells or options out of range.
    """
    kind = entry["shape"]
    if kind not in BUILDERS:
        raise ValueError(f"no shape is named {kind!r}; there are {', '.join(BUILDERS)}")
    build, least, options = BUILDERS[kind]
    cells = tuple(int(count) for count in entry["cells"])
    if len(cells) != len(least) or any(n < m for n, m in zip(cells, least, strict=True)):
        raise ValueError(f"cells of a {kind} are {len(least)} numbers, {list(least)} at the least")
    shape = build(cells, **{name: float(entry[name]) for name in options if name in entry})
    return shape.turned(LAID[kind][along]) if kind in LAID else shape
