"""Parts that swell, thin and bend between their ends: offsets of sections along the run.

A frame and a taper take a part's sections evenly from one end to the other.  What a template lists
under ``sections`` is added to that: at each it ``grow``s across the run and ``shift``s, by lengths
that are affine in the parameters, and evenly from one listed section to the next.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from service.template.expressions import parse_affine, parse_rows
from service.template.unitshape import rings

Array = NDArray[np.float64]


def swelling(
    entries: Sequence[Mapping[str, Any]], unit: Array, run: int, names: Sequence[str]
) -> Array:
    """``[n, 3, 1 + d]`` affine rows that the sections add to a part's vertices.

    Args:
        entries: ``at``, from -1/2 to 1/2 along the run and ascending; ``grow`` and ``shift``, two
            lengths each, across the run in the order of the axes.
        unit: ``[n, 3]`` vertices of the unit shape.
        run: the axis that it runs along.
        names: of the parameters.

    Raises:
        ValueError: for sections out of order.
        ExpressionError: for a length that is not affine in the parameters.
    """
    at = np.array([float(entry["at"]) for entry in entries])
    if len(at) == 0 or (np.diff(at) <= 0).any() or np.abs(at).max() > 0.5:
        raise ValueError("sections lie at ascending places from -0.5 to 0.5")
    grow, shift = (
        np.stack([_pair(entry, key, names) for entry in entries]) for key in ("grow", "shift")
    )
    across = [axis for axis in range(3) if axis != run]
    share = _shares(unit[:, run], at)
    rows = np.zeros((len(unit), 3, 1 + len(names)))
    outline = _outline(unit, run)
    rows[:, across] = outline[..., None] * np.einsum("ns,scd->ncd", share, grow)
    rows[:, across] += np.einsum("ns,scd->ncd", share, shift)
    return rows


def _pair(entry: Mapping[str, Any], key: str, names: Sequence[str]) -> Array:
    """``[2, 1 + d]`` rows of an entry's two lengths, nothing where it has none."""
    if key not in entry:
        return np.stack([parse_affine(0, names)] * 2)
    rows = parse_rows(entry[key], names)
    if len(rows) != 2:
        raise ValueError(f"{key} of a section is two lengths")
    return rows


def _shares(s: Array, at: Array) -> Array:
    """``[n, sections]`` how much of each section's offset holds at ``s [n]``: 1 in sum."""
    return np.stack([np.interp(s, at, row) for row in np.eye(len(at))], axis=1)


def _outline(unit: Array, run: int) -> Array:
    """``[n, 2]`` places on the sections, each from -1/2 to 1/2 across; 0 where it is a point."""
    found = rings(unit, run)
    size = (found.high - found.low)[found.of]
    offset = np.delete(unit, run, axis=1) - ((found.low + found.high) / 2)[found.of]
    outline: Array = offset / np.where(size > 1e-9, size, np.inf)
    return outline
