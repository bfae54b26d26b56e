"""What the encoder of an affine category answers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from service.template.affine import AffineTemplate

SMALLEST = 1e-3
"""Least length in the normalised frame, where the shape has radius 0.6."""


@dataclass(frozen=True)
class Encoding:
    """An encoder's answer, in the normalised frame.

    Attributes:
        parameters: ``[d]``, sizes no smaller than `SMALLEST`; signed offsets are as they come.
        translation: ``[3]`` of the template's origin.
        shares: ``[K]`` probabilities of the template's variants.
    """

    parameters: NDArray[np.float64]
    translation: NDArray[np.float64]
    shares: NDArray[np.float64]

    @classmethod
    def of(cls, template: AffineTemplate, outputs: NDArray[np.float64]) -> Encoding:
        """Take the network's outputs ``[d + 3 + K]`` apart."""
        size = len(template.parameters)
        odds = outputs[size + 3 :] if template.present else np.zeros(1)
        shares = np.exp(odds - odds.max())
        return cls(
            parameters=positive(template, outputs[:size]),
            translation=outputs[size : size + 3],
            shares=shares / shares.sum(),
        )


def positive(template: AffineTemplate, parameters: NDArray[np.float64]) -> NDArray[np.float64]:
    """Parameters ``[d]`` with each size no smaller than `SMALLEST`; signed ones stay."""
    return np.where(template.signed, parameters, np.maximum(parameters, SMALLEST))
