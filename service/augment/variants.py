"""Variants of one upload: one inference, one binding, and as many edits as are asked for."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from importlib.metadata import version
from typing import Any

from service import deadline, pipeline
from service.augment.draw import Draw
from service.augment.labels import PartLabels, part_labels
from service.augment.options import AugmentOptions
from service.augment.sampling import Sampler, chance, sampler
from service.augment.validity import USUAL, Limits, Validity
from service.augment.variant import Variant
from service.edited import write_edited
from service.encode.basemodel import Model
from service.errors import InvalidRequest, Overloaded, ShapeError, TooComplex
from service.inference import Inference
from service.inferences import Inferences
from service.requests import EditOptions, InferOptions, Upload

TRIES = 6
"""Draws of which the first is taken that leaves the mesh whole."""
SHRINK = 0.7
"""Factor of the strength from one to the next."""


@dataclass(frozen=True)
class Source:
    """An upload that variants are made of.

    Attributes:
        found: what is known of it.
        edit_options: how edits are carried out.
        limits: how much of the mesh may be spoilt.
    """

    found: Inference
    edit_options: EditOptions
    limits: Limits = USUAL

    def variants(self, options: AugmentOptions, begin: int = 0) -> Iterator[Variant]:
        """Those with the indices from `begin` to ``options.count``; see `variants`."""
        for index in range(begin, options.count):
            yield self.variant(options, index)

    def variant(self, options: AugmentOptions, index: int) -> Variant:
        """One of them."""
        problem: ShapeError | None = None
        for attempt in range(TRIES):
            deadline.check()
            rng = chance(options.seed, self.found.upload.mesh_id, index, attempt)
            draw = self._sampler.draw(rng, options.strength * SHRINK**attempt)
            facts = self._facts(options, index, attempt, draw)
            try:
                moved = pipeline.move(self.found, draw.edits, self.edit_options)
                damage = self._validity.damage(moved)
                faults = damage.beyond(self.limits)
                if not faults:
                    edited = write_edited(moved, self.edit_options.format)
                    return Variant(index, draw.edits, facts, damage.figures, edited)
                problem = _damaged(faults)
            except (Overloaded, TooComplex):
                raise
            except ShapeError as error:
                problem, damage = error, None
        assert problem is not None
        figures = damage.figures if damage else {}
        return Variant(index, draw.edits, facts, figures, problem=problem)

    @cached_property
    def labels(self) -> PartLabels:
        """Which part each vertex belongs to: the same for every variant."""
        return part_labels(self.found)

    @cached_property
    def _sampler(self) -> Sampler:
        return sampler(self.found)

    @cached_property
    def _validity(self) -> Validity:
        return Validity.of(self.found)

    def _facts(
        self, options: AugmentOptions, index: int, attempt: int, draw: Draw
    ) -> dict[str, Any]:
        found = self.found
        return {
            "mesh_id": found.upload.mesh_id,
            "category": found.model.name,
            "model": found.model.identity,
            "seed": options.seed,
            "index": index,
            "attempt": attempt,
            "strength": options.strength,
            "share": draw.share,
            "drawn_from": "real shapes" if self._sampler.real else "typical ranges",
            "version": version("shape-parameters"),
        }


@contextmanager
def source(
    upload: Upload,
    models: Mapping[str, Model],
    options: InferOptions,
    edit_options: EditOptions,
    known: Inferences | None = None,
) -> Iterator[Source]:
    """An upload to make variants of, for the length of the block.

    Raises:
        ShapeError: as `pipeline.edit`.
    """
    with pipeline.editable(upload, models, options, edit_options, known) as found:
        yield Source(found, edit_options)


def variants(
    upload: Upload,
    models: Mapping[str, Model],
    options: InferOptions,
    edit_options: EditOptions,
    augment_options: AugmentOptions,
    known: Inferences | None = None,
    begin: int = 0,
) -> Iterator[Variant]:
    """Variants of an upload, drawn towards real shapes.

    Each depends on the file's bytes, the seed and its index alone, so that it is the same whatever
    was made before it.

    Args:
        upload: a mesh file.
        models: the categories.
        options: what the client says of it.
        edit_options: how edits are carried out; as for `pipeline.edit`, which answers the same for
            a variant's edits.
        augment_options: how many, and how they are drawn.
        known: as for `pipeline.infer`.
        begin: index of the first that is wanted.

    Raises:
        ShapeError: as `pipeline.edit`, and for a count, seed or strength that can't be had.
    """
    augment_options.require_sound()
    with source(upload, models, options, edit_options, known) as made:
        yield from made.variants(augment_options, begin)


def _damaged(faults: list[str]) -> InvalidRequest:
    return InvalidRequest(
        "variant_damaged",
        f"no draw of {TRIES} left the mesh whole: {'; '.join(faults)}",
        "Lower the strength, or leave this mesh out.",
    )
