"""Which shapes there really are: draws like the fitted parameters of real ones.

The joint distribution is a Gaussian copula: each value has the quantiles that real shapes have, and
what goes with what is a correlation of normal scores, written as factors.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from service.encode.basemodel import Model
from service.encode.card import DistributionEntry, KindEntry

Array = NDArray[np.float64]

OVERALL_SIZE = "overall_size"
"""What a card calls the size of the whole among the names of parameters."""
ALL = "all"
"""What it calls shapes of whichever kind."""


@dataclass(frozen=True)
class Distribution:
    """Real shapes of a category.

    Attributes:
        names: of the ``p`` values.
        kinds: the copula of each variant of the template that enough real shapes are of, and of
            `ALL`.
    """

    names: tuple[str, ...]
    kinds: dict[str, KindEntry]

    @classmethod
    def of(cls, model: Model) -> Distribution | None:
        """What a model's card has of it; None where it has nothing."""
        written = model.card.get("distribution")
        if written is None:
            return None
        entry = DistributionEntry.model_validate(written)
        return cls(tuple(entry.parameters), entry.kinds)

    def draw(self, rng: np.random.Generator, kind: str = "") -> dict[str, float]:
        """Values by name, as a real shape could have them.

        Args:
            rng: where chance comes from.
            kind: the variant of the template that is wanted.
        """
        copula = self._copula(kind)
        loadings, quantiles = np.array(copula.loadings), np.array(copula.quantiles)
        own = np.sqrt(np.maximum(1.0 - np.square(loadings).sum(axis=0), 0.0))
        score = rng.standard_normal(len(loadings)) @ loadings
        score += own * rng.standard_normal(len(own))
        at = np.linspace(0.0, 1.0, quantiles.shape[1])
        values = [
            float(np.interp(place, at, ends))
            for place, ends in zip(ndtr(score), quantiles, strict=True)
        ]
        return dict(zip(self.names, values, strict=True))

    def ends(self, name: str, kind: str = "") -> tuple[float, float]:
        """The least and the largest of a value that real shapes have; nothing is between them where
        it is not known."""
        if name not in self.names:
            return np.inf, -np.inf
        quantiles = self._copula(kind).quantiles[self.names.index(name)]
        return quantiles[0], quantiles[-1]

    def _copula(self, kind: str) -> KindEntry:
        return self.kinds.get(kind) or self.kinds[ALL]
