"""The variants of an order, one at a time, each with its row of the manifest."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any, Protocol

from service import pipeline
from service.augment.variants import Source, source
from service.edited import write_edited
from service.edits import changes
from service.encode.basemodel import Model
from service.errors import Overloaded, ShapeError, TooComplex
from service.inference import Inference
from service.inferences import Inferences
from service.jobs.job import Failure
from service.jobs.order import Order

FOLDER = "variants"


@dataclass(frozen=True)
class Part:
    """A variant, made or not.

    Attributes:
        name: of its file in the archive; None where there is none.
        data: the file.
        row: what the manifest says of it.
    """

    name: str | None
    data: bytes | None = field(repr=False)
    row: Mapping[str, Any]

    @property
    def line(self) -> str:
        """The row as JSON, without its end of line."""
        return json.dumps(self.row, separators=(",", ":"))


class Making(Protocol):
    """What makes the variants of one order."""

    def part(self, index: int) -> Part:
        """One of them: the same whatever was made before.

        Raises:
            Overloaded, TooComplex: the time is over.
        """

    def labels(self) -> bytes | None:
        """The archive's labels; None where the order has none."""


@contextmanager
def making(
    order: Order, models: Mapping[str, Model], known: Inferences | None = None
) -> Iterator[Making]:
    """What makes an order's variants, for the length of the block.

    Raises:
        ShapeError: when none can be made.
    """
    given = order.upload, models, order.options, order.edit_options, known
    if order.kind == "augment":
        order.draw.require_sound()
        with source(*given) as made:
            yield _Drawn(order, made)
        return
    with pipeline.editable(*given) as found:
        yield _Edits(order, found)


def failed(order: Order, index: int, error: Exception) -> Part:
    """A variant that can't be made."""
    edits = order.edits[index] if order.kind == "edit" else {}
    problem = Failure.of(error).told()
    row = {"index": index, "status": "failed", "file": None, "edits": edits, "problem": problem}
    return Part(None, None, row)


@dataclass(frozen=True)
class _Edits:
    order: Order
    found: Inference

    def part(self, index: int) -> Part:
        options = self.order.edit_options
        try:
            moved = pipeline.move(self.found, changes(self.order.edits[index]), options)
            edited = write_edited(moved, options.format)
        except (Overloaded, TooComplex):
            raise
        except ShapeError as error:
            return failed(self.order, index, error)
        name = _name(index, edited.format)
        row = {
            "index": index,
            "status": "ok",
            "file": name,
            "sha256": hashlib.sha256(edited.data).hexdigest(),
            "format": edited.format,
            "edits": self.order.edits[index],
            **edited.report,
            "problem": None,
        }
        return Part(name, edited.data, row)

    def labels(self) -> bytes | None:
        return None


@dataclass(frozen=True)
class _Drawn:
    order: Order
    made: Source

    def part(self, index: int) -> Part:
        variant = self.made.variant(self.order.draw, index)
        row = variant.row()
        if variant.problem is not None:
            return Part(None, None, {**row, "problem": Failure.of(variant.problem).told()})
        assert variant.edited is not None
        name = _name(index, variant.edited.format)
        return Part(name, variant.edited.data, {**row, "file": name})

    def labels(self) -> bytes | None:
        labels = self.made.labels
        told = {"parts": list(labels.parts), "labels": labels.labels.tolist()}
        return json.dumps(told, separators=(",", ":")).encode()


def _name(index: int, format: str) -> str:
    return f"{FOLDER}/{index:03d}.{format}"
