"""Installed models: how their files are found and read, and the names that others need of them."""

from __future__ import annotations

from collections.abc import Collection, Mapping
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
from service.encode.card import read_card, unreadable
from service.encode.debugmodel import DebugModel as DebugModel
from service.encode.estimate import SIGMA_FLOOR as SIGMA_FLOOR
from service.errors import ModelFault
from service.shipped import SHIPPED as SHIPPED
from service.template.bodyfile import BodyFileError, load_body
from service.template.loader import load_template, template_path


def load_models(
    directory: Path,
    threads: int = 1,
    body: Path | None = None,
    names: Collection[str] | None = None,
) -> dict[str, Model]:
    """The models of a folder: ``<name>.json`` cards with ``<name>.onnx`` beside them.

    A ``<name>.yaml`` there is an affine category's template; without one it is a built-in's.

    Args:
        directory: the folder.
        threads: that one encoding may use.
        body: file of the body that skinned models work with, see `load_body`.
        names: of those that are wanted; by default all.

    Raises:
        ModelFault: for a card, network, template or body that can't be read.
    """
    cards = sorted(directory.glob("*.json"))
    wanted = [card for card in cards if names is None or card.stem in names]
    models = [load_model(card, threads, body) for card in wanted]
    return {model.name: model for model in models}


def load_model(path: Path, threads: int = 1, body: Path | None = None) -> Model:
    """The model of a card, of the kind that it says, with its network beside it.

    Raises:
        ModelFault: for a card, network, template or body that can't be read, or a template that is
            not the one that the card speaks of.
    """
    card = read_card(path)
    try:
        match card.get("kind", AffineModel.kind):
            case BodyModel.kind:
                return _skinned(card, path, threads, body)
            case AffineModel.kind:
                return _affine(AffineModel, card, path, threads)
            case DebugModel.kind:
                return _affine(DebugModel, card, path, threads)
            case kind:
                raise unreadable(path, f"its kind is {kind!r}, which this service does not know")
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise unreadable(path, str(error)) from error


def _affine(
    kind: type[AffineModel], card: Mapping[str, Any], path: Path, threads: int
) -> AffineModel:
    source = template_path(template_source(path, card["name"]))
    expected = card.get("template_digest")
    if expected is not None and source.is_file() and file_digest(source) != expected:
        raise ModelFault(
            "template_digest",
            f"{source.name} is not the template that {path.name} was trained on",
            "Train the changed template, or put back the one from the same export.",
        )
    return kind(card, load_template(source), path.with_suffix(".onnx"), threads)


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
