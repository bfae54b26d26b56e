"""Installed models: a template, an encoder and the card that says what they are."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from service.encode.discriminator import DISCRIMINATOR_SUFFIX, Discriminator
from service.encode.session import EncoderSession
from service.errors import ModelFault
from service.mesh.surface import Normalization, sample_surface
from service.template.affine import AffineTemplate
from service.template.loader import load_template

SHIPPED = Path(__file__).parent.parent / "models"
"""The folder of the models that come with the service."""
GOLDEN_TOLERANCE = 1e-3
STEEPNESS = 4
"""How fast a score falls with the distance."""
SIGMA_FLOOR = 0.002
"""Least standard deviation claimed for a refined parameter: the repeat error of measuring real
shapes by hand is of this size (in the normalised frame's unit)."""
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


class Model:
    """A category that the service can infer and edit."""

    def __init__(self, card: Mapping[str, Any], template: AffineTemplate, path: Path, threads: int):
        self.card = card
        self.template = template
        self.name: str = card["name"]
        self.version: str = card["version"]
        self.digest: str = card["digest"]
        self._path = path
        self._session = EncoderSession(path, threads)
        self.discriminator = Discriminator(path.with_suffix(DISCRIMINATOR_SUFFIX), threads)

    @property
    def points(self) -> int:
        """Size of the clouds that it encodes."""
        return self._session.points

    def encode(self, points: NDArray[np.floating]) -> Encoding:
        """What the encoder answers for a normalised cloud ``[points, 3]``."""
        outputs = self._session.run(points)
        size = len(self.template.parameters)
        odds = outputs[size + 3 :] if self.template.present else np.zeros(1)
        shares = np.exp(odds - odds.max())
        return Encoding(
            parameters=positive(self.template, outputs[:size]),
            translation=outputs[size : size + 3],
            shares=shares / shares.sum(),
        )

    @property
    def limit_distance(self) -> float:
        """`surface_distance` that 95 % of the category's ordinary shapes stay below."""
        return float(self.card["calibration"]["limit_distance"])

    @property
    def limit_odds(self) -> float:
        """Log odds that 95 % of them exceed."""
        return float(self.card["calibration"]["limit_odds"])

    @property
    def sigma_scale(self) -> NDArray[np.float64]:
        """``[d]`` what a fit's own standard deviations are multiplied by to be honest."""
        scales = self.card.get("calibration", {}).get("sigma_scale", {})
        return np.array([float(scales.get(name, 1.0)) for name in self.template.names])

    def score(self, distance: float, odds: float) -> float:
        """How much a fitted shape is like the category's, from 1 down to 0.

        The lesser of two scores, of the fit's distance and of the discriminator's log odds: each is
        1/2 at its limit.
        """
        near = 1.0 / (1.0 + (distance / self.limit_distance) ** STEEPNESS)
        alike = 1.0 / (1.0 + np.exp(self.limit_odds - odds))
        return float(min(near, alike))

    def verify(self) -> None:
        """Check the files' digests, and a golden request against its recorded answer.

        Raises:
            ModelFault: when either differs.
        """
        discriminator = self._path.with_suffix(DISCRIMINATOR_SUFFIX)
        _require_digest(self._path, self.digest)
        _require_digest(discriminator, self.card["discriminator"]["digest"])
        answer = self._session.run(golden_cloud(self.template, self.points))
        golden = np.array(self.card.get("golden", []))
        gap = float(np.abs(answer - golden).max()) if golden.shape == answer.shape else np.inf
        if not gap < GOLDEN_TOLERANCE:
            raise ModelFault(
                "model_golden",
                f"{self.name} answers its golden request off by {gap:.2g}",
                "Export the model again, or check the installed onnxruntime.",
            )

    def describe(self) -> dict[str, Any]:
        """What `GET /categories/{name}` says."""
        template = self.template
        return {
            "name": self.name,
            "label": template.label,
            "points": self.points,
            "model": {"name": self.name, "version": self.version, "digest": self.digest},
            "keep": list(template.anchors),
            "parameters": [
                *(
                    _entry(p.name, p.label, p.group, (p.low, p.high), p.typical, False, p.paper)
                    for p in template.parameters
                    if not p.nuisance
                ),
                *(
                    _entry(d.name, d.label, d.group, d.typical, d.typical, True, None)
                    for d in template.derived.values()
                ),
            ],
        }


def _entry(
    name: str,
    label: str,
    group: str,
    ends: tuple[float, float],
    typical: tuple[float, float],
    derived: bool,
    paper: str | None,
) -> dict[str, Any]:
    return {
        "name": name,
        "label": label,
        "group": group,
        "unit": "m",
        "kind": "length",
        "range": list(ends),
        "typical": list(typical),
        "step": 0.001 if typical[1] < 0.3 else 0.005,
        "derived": derived,
        "paper_name": paper,
    }


def positive(template: AffineTemplate, parameters: NDArray[np.float64]) -> NDArray[np.float64]:
    """Parameters ``[d]`` with each size no smaller than `SMALLEST`; signed ones stay."""
    return np.where(template.signed, parameters, np.maximum(parameters, SMALLEST))


def _require_digest(path: Path, expected: str) -> None:
    digest = file_digest(path)
    if digest != expected:
        raise ModelFault(
            "model_digest",
            f"{path.name} is {digest}, its card says {expected}",
            "Install the model files and their card from the same export.",
        )


def golden_cloud(template: AffineTemplate, points: int) -> NDArray[np.float32]:
    """A fixed cloud: the template in the middle of its ranges, sampled with a fixed seed."""
    vertices = template.decode((template.low + template.high) / 2)
    cloud = sample_surface(vertices, template.faces, points, np.random.default_rng(0)).points
    return Normalization.of(cloud).apply(cloud).astype(np.float32)


def file_digest(path: Path) -> str:
    """``sha256-<hex>`` of a file."""
    return f"sha256-{hashlib.sha256(path.read_bytes()).hexdigest()}"


def load_models(directory: Path, threads: int = 1) -> dict[str, Model]:
    """Every model of a folder: ``<name>.json`` cards with ``<name>.onnx`` beside them.

    A ``<name>.yaml`` there is the category's template; without one it is a built-in's.

    Raises:
        ModelFault: for a card, network or template that can't be read.
    """
    models = (load_model(path, threads) for path in sorted(directory.glob("*.json")))
    return {model.name: model for model in models}


def load_model(path: Path, threads: int = 1) -> Model:
    """The model of a card, with its network and its own template, if any, beside it.

    Raises:
        ModelFault: for a card, network or template that can't be read, or a template that is not
            the one that the card speaks of.
    """
    own = path.with_suffix(".yaml")
    try:
        card = json.loads(path.read_text("utf-8"))
        template = load_template(template_source(path, card["name"]))
        if own.is_file() and card.get("template_digest", file_digest(own)) != file_digest(own):
            raise ModelFault(
                "template_digest",
                f"{own.name} is not the template that {path.name} was trained on",
                "Train the changed template, or put back the one from the same export.",
            )
        return Model(card, template, path.with_suffix(".onnx"), threads)
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ModelFault(
            "model_unreadable",
            f"{path.name} can't be loaded: {error}",
            "Export the model again, or remove it from the models folder.",
        ) from error


def template_source(card: Path, name: str) -> str | Path:
    """A model's template: the file beside its card, else the built-in of its name."""
    own = card.with_suffix(".yaml")
    return own if own.is_file() else name
