"""Model cards: the part of them that the service works by, checked."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, Field, FiniteFloat, ValidationError

from service.errors import ModelFault

Scale = Annotated[FiniteFloat, Field(gt=0)]


class FileEntry(BaseModel):
    """A network beside the encoder."""

    digest: str


class Calibration(BaseModel):
    """What fits are judged by."""

    limit_distance: Scale
    limit_odds: FiniteFloat
    sigma_scale: dict[str, Scale] = {}


class Card(BaseModel):
    """A card's entries that are relied on; it may have any others."""

    name: str = Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$", max_length=60)
    version: str = Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.+-]*$", max_length=60)
    digest: str
    kind: str = "affine"
    golden: list[float] = []
    discriminator: FileEntry
    mesh_encoder: FileEntry | None = None
    template_digest: str | None = None
    calibration: Calibration


def read_card(path: Path) -> dict[str, Any]:
    """The whole of a card.

    Raises:
        ModelFault: when it can't be read, or an entry that is relied on makes no sense.
    """
    try:
        card = json.loads(path.read_text("utf-8"))
        Card.model_validate(card)
    except ValidationError as error:
        wrong = error.errors()[0]
        entry = ".".join(map(str, wrong["loc"])) or "the card"
        raise unreadable(path, f"{entry}: {wrong['msg']}") from error
    except (OSError, ValueError, RecursionError) as error:
        raise unreadable(path, str(error)) from error
    return dict(card)


def unreadable(path: Path, reason: str) -> ModelFault:
    """What is wrong with a model whose card, or what belongs to it, can't be used."""
    return ModelFault(
        "model_unreadable",
        f"{path.name} can't be loaded: {reason}",
        "Export the model again, or remove it from the models folder.",
    )
