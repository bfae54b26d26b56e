"""Installed models: how their files are found and read, and the names that others need of them."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from service.encode.affinemodel import AffineModel as AffineModel
from service.encode.affinemodel import golden_cloud as golden_cloud
from service.encode.affineoutputs import SMALLEST as SMALLEST
from service.encode.affineoutputs import Encoding as Encoding
from service.encode.affineoutputs import positive as positive
from service.encode.basemodel import STEEPNESS as STEEPNESS
from service.encode.basemodel import Model as Model
from service.encode.basemodel import file_digest as file_digest
from service.encode.bodymodel import BodyModel as BodyModel
from service.encode.estimate import SIGMA_FLOOR as SIGMA_FLOOR
from service.errors import ModelFault
from service.template.bodyfile import BodyFileError, load_body
from service.template.loader import load_template

SHIPPED = Path(__file__).parent.parent / "models"
"""The folder of the models that come with the service."""


def load_models(directory: Path, threads: int = 1, body: Path | None = None) -> dict[str, Model]:
    """Every model of a folder: ``<name>.json`` cards with ``<name>.onnx`` beside them.

    A ``<name>.yaml`` there is an affine category's template; without one it is a built-in's.

    Args:
        directory: the folder.
        threads: that one encoding may use.
        body: file of the body that skinned models work with, see `load_body`.

    Raises:
        ModelFault: for a card, network, template or body that can't be read.
    """
    models = (load_model(path, threads, body) for path in sorted(directory.glob("*.json")))
    return {model.name: model for model in models}


def load_model(path: Path, threads: int = 1, body: Path | None = None) -> Model:
    """The model of a card, of the kind that it says, with its network beside it.

    Raises:
        ModelFault: for a card, network, template or body that can't be read, or a template that is
            not the one that the card speaks of.
    """
    try:
        card = json.loads(path.read_text("utf-8"))
        kind = card.get("kind", AffineModel.kind)
        if kind == BodyModel.kind:
            return _skinned(card, path, threads, body)
        if kind == AffineModel.kind:
            return _affine(card, path, threads)
        raise ValueError(f"its kind is {kind!r}, not {AffineModel.kind} or {BodyModel.kind}")
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise ModelFault(
            "model_unreadable",
            f"{path.name} can't be loaded: {error}",
            "Export the model again, or remove it from the models folder.",
        ) from error


def _affine(card: Mapping[str, Any], path: Path, threads: int) -> AffineModel:
    own = path.with_suffix(".yaml")
    template = load_template(template_source(path, card["name"]))
    if own.is_file() and card.get("template_digest", file_digest(own)) != file_digest(own):
        raise ModelFault(
            "template_digest",
            f"{own.name} is not the template that {path.name} was trained on",
            "Train the changed template, or put back the one from the same export.",
        )
    return AffineModel(card, template, path.with_suffix(".onnx"), threads)


def _skinned(card: Mapping[str, Any], path: Path, threads: int, body: Path | None) -> BodyModel:
    try:
        template = load_body(body)
    except BodyFileError as error:
        source = f"BODY_MODEL={str(body)!r}" if body else "the shipped body"
        raise ModelFault(
            "body_model",
            f"{source} can't be used: {error}",
            "Name a body in SMPL's format, .npz or .pkl, or unset BODY_MODEL."
            if body
            else "Install the service again.",
        ) from error
    return BodyModel(card, template, path.with_suffix(".onnx"), threads)


def template_source(card: Path, name: str) -> str | Path:
    """An affine model's template: the file beside its card, else the built-in of its name."""
    own = card.with_suffix(".yaml")
    return own if own.is_file() else name
