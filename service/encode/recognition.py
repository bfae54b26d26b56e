"""Which category and which way up: the best fit among models and axis-aligned orientations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from service.encode.estimate import Estimate, estimate
from service.encode.model import Model
from service.encode.refine import Settings
from service.mesh.frame import CANONICAL, Orientation
from service.mesh.surface import Normalization, Samples, sample_surface

FINALISTS = 4
"""How many of the encoder's best orientations are refined, roughly, before one is chosen."""
PRIOR = 0.9
"""The canonical orientation wins when its distance times this is the least: files mostly keep to
the convention, and near-symmetric shapes fit several ways."""
PROBES = 500
"""Points that the first ranking looks at."""
ROUGH = Settings(iterations=8, template_points=600)
"""Enough refinement to tell orientations apart; it sees every third sample."""


@dataclass(frozen=True)
class Candidate:
    """One reading of an upload.

    Attributes:
        model: the category.
        orientation: the upload's up and front.
        samples: the upload's samples, turned to the canonical frame.
        estimate: of the answer as asked for; of the others, roughly refined.
    """

    model: Model
    orientation: Orientation
    samples: Samples
    estimate: Estimate

    @property
    def rank(self) -> float:
        """What the choice is made by: smaller is better."""
        prior = PRIOR if self.orientation == CANONICAL else 1.0
        return self.estimate.distance * prior / self.model.usual_distance


def turned(samples: Samples, orientation: Orientation) -> Samples:
    """The samples in the canonical frame."""
    return replace(
        samples,
        points=orientation.to_canonical(samples.points),
        normals=orientation.to_canonical(samples.normals),
    )


def recognise(
    models: Sequence[Model],
    samples: dict[int, Samples],
    orientations: Sequence[Orientation],
    refined: bool,
) -> list[Candidate]:
    """Readings of an upload, best first.

    Args:
        models: the categories it may be of.
        samples: the upload's samples in its own frame, by cloud size.
        orientations: those it may have, the canonical one first.
        refined: refine the answer.  To choose between orientations the best few are refined
            roughly, whatever this says.

    Returns:
        At least one candidate for each model; the first is the answer.
    """
    if len(models) == len(orientations) == 1:
        own = turned(samples[models[0].points], orientations[0])
        return [Candidate(models[0], orientations[0], own, estimate(models[0], own, refined))]
    candidates = [
        candidate
        for model in models
        for candidate in _search(model, samples[model.points], orientations)
    ]
    ranked = sorted(candidates, key=lambda candidate: candidate.rank)
    best = ranked[0]
    answer = estimate(best.model, best.samples, refined)
    return [replace(best, estimate=answer), *ranked[1:]]


def _search(model: Model, samples: Samples, orientations: Sequence[Orientation]) -> list[Candidate]:
    """Roughly refined candidates for the best few orientations.

    A first orientation that fits as well as shapes of the category usually do is taken at once.
    """
    first = roughly(model, samples, orientations[0])
    if len(orientations) == 1 or first.estimate.distance <= model.usual_distance:
        return [first]
    others = sorted(orientations[1:], key=lambda o: _encoded_distance(model, samples, o))
    return [first, *(roughly(model, samples, other) for other in others[:FINALISTS])]


def roughly(model: Model, samples: Samples, orientation: Orientation) -> Candidate:
    """A candidate refined just enough to be compared."""
    own = turned(samples, orientation)
    return Candidate(model, orientation, own, estimate(model, own, True, ROUGH, stride=3))


def _encoded_distance(model: Model, samples: Samples, orientation: Orientation) -> float:
    """Mean two-way distance of a few points for the encoder's answer alone."""
    points = turned(samples, orientation).points
    points = Normalization.of(points).apply(points)
    parameters, translation = model.encode(points)
    template = model.template
    vertices: NDArray[np.float64] = template.decode(parameters) + translation
    visible = template.faces[~template.hidden]
    fitted = sample_surface(vertices, visible, PROBES, np.random.default_rng(2)).points
    # Samples come in the order of the faces: every so-many-th is a fair draw.
    probes = points[:: max(1, len(points) // PROBES)]
    there = cKDTree(probes).query(fitted)[0].mean()
    return float(there + cKDTree(fitted).query(probes)[0].mean())
