"""A random edit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from service.edits import Change

FARTHEST = 2.0
"""Factor by which a length grows or shrinks at most: detail that is stretched more looks it."""
LEAST_SHARE = 0.25
"""Of the way that is allowed: what goes less far is hardly a variant."""


@dataclass(frozen=True)
class Draw:
    """A random edit, and the share of the way to a real-looking shape that it goes."""

    edits: Mapping[str, Change]
    share: float


def some(rng: np.random.Generator) -> float:
    """A random share of the way that is allowed."""
    return float(rng.uniform(LEAST_SHARE, 1.0))
