"""Random edits of a source, each reproducible by itself."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from service.affineinference import AffineInference
from service.augment.affinesampler import AffineSampler
from service.augment.bodysampler import BodySampler
from service.augment.draw import Draw
from service.bodyinference import BodyInference
from service.inference import Inference


class Sampler(Protocol):
    """Draws edits of one source."""

    @property
    def real(self) -> bool:
        """Whether draws are like real shapes."""

    def draw(self, rng: np.random.Generator, strength: float) -> Draw:
        """An edit, up to the share ``strength`` of the way to such a shape."""


def sampler(found: Inference) -> Sampler:
    """What draws edits of a source."""
    if isinstance(found, BodyInference):
        return BodySampler(found)
    assert isinstance(found, AffineInference)
    return AffineSampler(found)


def chance(seed: int, mesh_id: str, index: int, attempt: int) -> np.random.Generator:
    """The random numbers of one try at one variant of a file: the same whatever else is drawn."""
    digest = int(mesh_id.removeprefix("sha256-"), 16)
    return np.random.default_rng([seed, digest, index, attempt])
