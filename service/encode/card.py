"""Model cards: the part of them that the service works by, checked."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import BaseModel, Field, FiniteFloat, ValidationError, model_validator

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


Row = Annotated[list[FiniteFloat], Field(min_length=1)]


class KindEntry(BaseModel):
    """Real shapes of one kind: ``p`` rows of quantiles, from the least to the largest value, and
    ``k`` rows of ``p`` loadings of their normal scores on factors."""

    quantiles: list[Annotated[Row, Field(min_length=2)]] = Field(min_length=1)
    loadings: list[Row] = Field(min_length=1)


class DistributionEntry(BaseModel):
    """Which shapes there really are; see `service.augment.distribution`."""

    parameters: list[str] = Field(min_length=1)
    kinds: dict[str, KindEntry]

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        if "all" not in self.kinds:
            raise ValueError("kinds: lacks 'all'")
        count = len(self.parameters)
        for name, kind in self.kinds.items():
            if len(kind.quantiles) != count or len({len(row) for row in kind.quantiles}) > 1:
                raise ValueError(f"kinds.{name}: quantiles are no {count} rows of one length")
            if any(len(row) != count for row in kind.loadings):
                raise ValueError(f"kinds.{name}: loadings are not of {count} parameters")
        return self


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
    distribution: DistributionEntry | None = None


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
