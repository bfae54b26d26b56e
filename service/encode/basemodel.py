"""What every category's model is: a card, an encoder, a discriminator, and a judgement of fits."""

from __future__ import annotations

import hashlib
import json
from abc import ABC, abstractmethod
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from service.encode.discriminator import DISCRIMINATOR_SUFFIX, Discriminator
from service.encode.session import EncoderSession
from service.encode.session import file_digest as file_digest
from service.errors import ModelFault
from service.mesh.surface import Normalization, Samples, Surface

GOLDEN_TOLERANCE = 1e-3
STEEPNESS = 4
"""How fast a score falls with the distance."""


class Fit(Protocol):
    """What is known of a fitted shape, whatever its kind."""

    @property
    def distance(self) -> float:
        """`surface_distance` of the fit."""

    @property
    def encoder_distance(self) -> float:
        """The same for the encoder's answer alone."""

    @property
    def normalization(self) -> Normalization:
        """From the canonical frame."""

    @property
    def inside_out(self) -> bool:
        """Whether the upload's faces are wound the wrong way round."""

    @property
    def turn(self) -> NDArray[np.float64]:
        """``[3, 3]`` how the shape is turned in the canonical frame."""


class Model(ABC):
    """A category that the service can infer and edit."""

    kind: ClassVar[str]
    """What cards call models of the class."""
    turns_freely: ClassVar[bool]
    """Whether a fit finds by itself how a shape is turned: then there is no lean to take out, and
    one orientation is as good to begin with as another."""
    recognised: ClassVar[bool] = True
    """Whether `auto` may take an upload for one of the category."""

    def __init__(self, card: Mapping[str, Any], path: Path, threads: int):
        """
        Args:
            card: what is known of the model.
            path: the encoder's file; the discriminator's is beside it.
            threads: that one encoding may use.

        Raises:
            ModelFault: for a network that is not the card's, or can't be read.
            KeyError: for what the card lacks.
        """
        self.card = card
        self.name: str = card["name"]
        self.version: str = card["version"]
        self.digest: str = card["digest"]
        self._session = EncoderSession(path, threads, self.digest)
        self.discriminator = Discriminator(
            path.with_suffix(DISCRIMINATOR_SUFFIX), threads, card["discriminator"]["digest"]
        )

    @property
    @abstractmethod
    def label(self) -> str:
        """The category's name for people."""

    @property
    @abstractmethod
    def keeps(self) -> tuple[str, ...]:
        """Points that an edit can hold in place, the usual one first."""

    @property
    def stands(self) -> bool:
        """Shapes of the category stand on a floor."""
        return self.keeps[0] == "floor"

    @property
    @abstractmethod
    def outputs(self) -> int:
        """How many numbers the encoder has to answer."""

    @abstractmethod
    def entries(self) -> list[dict[str, Any]]:
        """What is said of each parameter and derived dimension; see `entry`."""

    @abstractmethod
    def golden_cloud(self) -> NDArray[np.float32]:
        """The ``[points, 3]`` that the card records the encoder's answer to."""

    @abstractmethod
    def estimate(
        self, samples: Samples, refined: bool, rough: bool = False, surface: Surface | None = None
    ) -> Fit:
        """Infer a shape's parameters.

        Args:
            samples: `points` samples in canonical orientation, any scale and place.
            refined: go on from the encoder's answer by refinement.
            rough: only as well as is needed to tell readings apart.
            surface: that the samples were drawn from, turned likewise.
        """

    @property
    def points(self) -> int:
        """Size of the clouds that it encodes."""
        return self._session.points

    @property
    def limit_distance(self) -> float:
        """`surface_distance` that 95 % of the category's ordinary shapes stay below."""
        return float(self.card["calibration"]["limit_distance"])

    @property
    def limit_odds(self) -> float:
        """Log odds that 95 % of them exceed."""
        return float(self.card["calibration"]["limit_odds"])

    def score(self, distance: float, odds: float) -> float:
        """How much a fitted shape is like the category's, from 1 down to 0.

        The lesser of two scores, of the fit's distance and of the discriminator's log odds: each is
        1/2 at its limit.
        """
        near = 1.0 / (1.0 + (distance / self.limit_distance) ** STEEPNESS)
        alike = 1.0 / (1.0 + np.exp(self.limit_odds - odds))
        return float(min(near, alike))

    def verify(self) -> None:
        """Put a golden request to the encoder: it must answer as the card has recorded.

        Raises:
            ModelFault: when it does not.
        """
        answer = self._session.run(self.golden_cloud())
        if answer.shape != (self.outputs,):
            raise ModelFault(
                "model_shape",
                f"the encoder of {self.name} answers {answer.size} numbers, not {self.outputs}",
                "Install the encoder and the template from the same export.",
            )
        golden = np.array(self.card.get("golden", []))
        gap = float(np.abs(answer - golden).max()) if golden.shape == answer.shape else np.inf
        if not gap < GOLDEN_TOLERANCE:
            raise ModelFault(
                "model_golden",
                f"{self.name} answers its golden request off by {gap:.2g}",
                "Export the model again, or check the installed onnxruntime.",
            )

    @property
    def identity(self) -> dict[str, str]:
        """Which model it is."""
        return {"name": self.name, "version": self.version, "digest": self.digest}

    @property
    def template_digest(self) -> str | None:
        """Digest of the template, where the card tells it."""
        return self.card.get("template_digest")

    @cached_property
    def fingerprint(self) -> str:
        """Digest, in hex, of what its answers depend on: its card, networks and template."""
        facts = json.dumps([self.card, self.template_digest], sort_keys=True)
        return hashlib.sha256(facts.encode()).hexdigest()

    def describe(self) -> dict[str, Any]:
        """What `GET /categories/{name}` says."""
        return {
            "name": self.name,
            "label": self.label,
            "points": self.points,
            "model": self.identity,
            "keep": list(self.keeps),
            "parameters": self.entries(),
        }
