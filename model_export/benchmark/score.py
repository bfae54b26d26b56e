"""All measures of one edit of one input by one rival."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from model_export.benchmark.accuracy import (
    dimension_error,
    edit_accuracy,
    locality,
    surface_accuracy,
)
from model_export.benchmark.case import FACTORS, Case
from model_export.benchmark.crossed import Crossed, Crossing
from model_export.benchmark.detail import edge_ratio, edges_of, laplacian_change
from model_export.benchmark.symmetry import asymmetry
from model_export.benchmark.validity import contacts, degenerate, flips, gap, pieces
from model_export.rivals.subject import Edit, Outcome
from service.mesh.surface import sample_surface

Array = NDArray[np.float64]

MADE_SAMPLES = 200_000
"""Points on a mesh made anew, which stand for it."""
BEST = {"accuracy": 0.1, "locality": 1e-3, "flips": 0.0, "degenerate": 1.0, "gap": 1e-3}
"""An edit below all of these passes; flips must be none."""

RARE = 4
"""Crossings are looked for in one of two factors of every other parameter: a quarter of edits."""


@dataclass(frozen=True)
class Score:
    """Of one edit; None where a measure makes no sense.

    Attributes:
        accuracy, tail: mean and 99th percentile of the error over the mean true motion.
        dimension: per cent by which the dimension misses what was asked for.
        locality: mean motion of what should stay.
        edge, edge_tail: mean and 99th percentile of the ratio of edge lengths to the truth's.
        detail: change of the Laplacian coordinates, where there is no truth.
        flips, degenerate: faces in a thousand.
        gap: 99th percentile of how far what touched comes apart.
        crossings: new pairs of faces that run through each other, per 10,000 faces; of a quarter
            of the edits.
        crossed: whether there are any of pieces that did not run through each other.
        asymmetry: added by the edit.
        order: whether vertices and faces are the input's, in its order.
        near: whether it is accurate, local and without flips,
        passed: and sound besides (see `BEST`).
    """

    accuracy: float | None = None
    tail: float | None = None
    dimension: float | None = None
    locality: float | None = None
    edge: float | None = None
    edge_tail: float | None = None
    detail: float | None = None
    flips: float | None = None
    degenerate: float | None = None
    gap: float | None = None
    crossings: float | None = None
    crossed: bool | None = None
    asymmetry: float | None = None
    order: bool = True
    near: bool = False
    passed: bool = False


class Judge:
    """Scores edits of one input."""

    def __init__(self, case: Case) -> None:
        self.case = case
        self.x, self.faces = case.vertices, case.faces
        self._due: dict[tuple[str, float], Crossing] = {}

    @cached_property
    def _edges(self) -> NDArray[np.int64]:
        return edges_of(self.faces)

    @cached_property
    def _touching(self) -> NDArray[np.int64]:
        return contacts(self.x, pieces(self.faces, len(self.x)))

    @cached_property
    def _crossed(self) -> Crossed:
        return Crossed(self.x, self.faces)

    @cached_property
    def _asymmetry(self) -> float:
        return asymmetry(self.x)

    def score(self, edit: Edit, outcome: Outcome) -> Score:
        """Measure what came of an edit.

        Raises:
            ValueError: for an outcome of another shape than the input's, or with what is no number.
        """
        if not np.isfinite(outcome.vertices).all():
            raise ValueError("not all coordinates are finite")
        if outcome.faces is not None:
            return self._made(edit, outcome.vertices, outcome.faces)
        if outcome.vertices.shape != self.x.shape:
            raise ValueError(f"{len(outcome.vertices)} vertices of {len(self.x)}")
        return self._moved(edit, outcome.vertices)

    def _made(self, edit: Edit, vertices: Array, faces: NDArray[np.int64]) -> Score:
        assert edit.truth is not None
        rng = np.random.default_rng(0)
        points = sample_surface(vertices, faces, MADE_SAMPLES, rng).points
        accuracy, tail, local = surface_accuracy(
            self.x, edit.truth, np.concatenate([vertices, points])
        )
        return Score(accuracy, tail, locality=local, order=False)

    def _moved(self, edit: Edit, y: Array) -> Score:
        x, truth = self.x, edit.truth
        reference = x if truth is None else truth
        thousand = 1000.0 / max(len(self.faces), 1)
        sound = {
            "flips": thousand * flips(y, reference, self.faces),
            "degenerate": thousand * degenerate(y, reference, self.faces),
            "gap": gap(x, y, truth, self.faces, self._touching),
            "asymmetry": max(asymmetry(y) - self._asymmetry, 0.0),
        }
        crossings, crossed = self._crossings(edit, y)
        if truth is None:
            return Score(
                detail=laplacian_change(x, y, self.faces),
                crossings=crossings,
                crossed=crossed,
                passed=_good(sound, ("flips", "degenerate", "gap")),
                **sound,
            )
        accuracy, tail = edit_accuracy(x, y, truth)
        close = {"accuracy": accuracy, "locality": locality(x, y, truth)}
        edge, edge_tail = edge_ratio(y, truth, self._edges)
        return Score(
            tail=tail,
            dimension=dimension_error(x, y, truth, edit.factor),
            edge=edge,
            edge_tail=edge_tail,
            crossings=crossings,
            crossed=crossed,
            near=_good(close | sound, ("accuracy", "locality", "flips")),
            passed=_good(close | sound, tuple(BEST)),
            **close,
            **sound,
        )

    def _crossings(self, edit: Edit, y: Array) -> tuple[float | None, bool | None]:
        # They take longer to find than all else.  Of every input other edits are looked at, the
        # same ones of each rival.
        turn = (edit.index + crc32(self.case.name.encode())) % RARE
        if turn >= len(FACTORS) or edit.factor != FACTORS[turn]:
            return None, None
        known = [self._crossed.before]
        if edit.truth is not None:
            key = edit.name, edit.factor
            if key not in self._due:
                self._due[key] = self._crossed.found(edit.truth, 0.0)
            known.append(self._due[key])
        fresh = self._crossed.found(y).beyond(known)
        return 10_000.0 * len(fresh.faces) / max(len(self.faces), 1), len(fresh.pieces) > 0


def _good(measured: dict[str, float], names: tuple[str, ...]) -> bool:
    return all(measured[name] < BEST[name] or measured[name] == 0.0 for name in names)
