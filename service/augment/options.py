"""What may be asked of variants."""

from __future__ import annotations

from dataclasses import dataclass

from service.errors import InvalidRequest

MOST = 1000
"""Variants of one mesh at a time."""
LARGEST_SEED = 2**63 - 1


@dataclass(frozen=True)
class AugmentOptions:
    """How many variants, and how they are drawn.

    Attributes:
        count: their number; variant ``i`` is the same whatever the count.
        seed: another seed gives other variants.
        strength: how far from the upload towards a draw from real shapes, from 0 to 1.
    """

    count: int = 10
    seed: int = 0
    strength: float = 1.0

    def require_sound(self) -> None:
        """Raise `InvalidRequest` (``count_out_of_range``, ``seed_out_of_range``,
        ``strength_out_of_range``) for what can't be had."""
        for name, value, low, high in (
            ("count", self.count, 1, MOST),
            ("seed", self.seed, 0, LARGEST_SEED),
            ("strength", self.strength, 0.0, 1.0),
        ):
            if not low <= value <= high:
                raise InvalidRequest(
                    f"{name}_out_of_range",
                    f"{name} is {value}, not from {low:g} to {high:g}",
                    f"Choose a {name} within these bounds.",
                )
