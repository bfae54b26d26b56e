"""What is edited: a mesh, its edits, and what is known of it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from itertools import product

import numpy as np
from numpy.typing import NDArray

from model_export.benchmark.known import Known
from model_export.rivals.subject import Edit, Subject
from service.deform.followers import following
from service.template.affine import AffineTemplate

Array = NDArray[np.float64]
Faces = NDArray[np.int64]

FACTORS = (0.7, 1.4)


@dataclass(frozen=True)
class Case:
    """An input of the benchmark.

    Attributes:
        source: S, D, R or O; see the package's report.
        name: tells it among these.
        category: its template.
        vertices: ``[V, 3]`` in the normalised canonical frame.
        faces: ``[F, 3]``.
        known: the ways in which its parameters are known, by name.
        truths: ``[V, 3]`` after the true edit, by parameter and factor; empty where it is not
            known.
    """

    source: str
    name: str
    category: AffineTemplate
    vertices: Array
    faces: Faces
    known: Mapping[str, Known]
    truths: Mapping[tuple[str, float], Array] = field(default_factory=dict)

    def subject(self, known: str) -> Subject:
        """What a rival is given."""
        own = self.known[known]
        return Subject(self.vertices, self.faces, following(own.template, own.f), own.f, own.t)

    def edits(self, known: str) -> Iterator[Edit]:
        """Every public parameter that moves anything, times each factor."""
        own = self.known[known]
        for (index, name), factor in product(self._public, FACTORS):
            if not self.truths and not own.template.active[index]:
                continue
            df = np.zeros_like(own.f)
            df[index] = own.f[index] * (factor - 1.0)
            yield Edit(name, index, factor, df, self.truths.get((name, factor)))

    @cached_property
    def _public(self) -> list[tuple[int, str]]:
        parameters = enumerate(self.category.parameters)
        return [(index, p.name) for index, p in parameters if not p.nuisance]
