"""Which category and which way up: the best fit among models and axis-aligned orientations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from service.encode.inference import Estimate, estimate
from service.encode.model import Model
from service.mesh.frame import CANONICAL, Orientation
from service.mesh.surface import Normalization, Samples, sample_surface

FINALISTS = 3
"""How many of the encoder's best orientations are refined before one is chosen."""
PRIOR = 0.9
"""The canonical orientation wins when its distance times this is the least: files mostly keep to
the convention, and near-symmetric shapes fit several ways."""
PROBES = 500
"""Points that the first, rough ranking looks at."""


@dataclass(frozen=True)
class Candidate:
    """One reading of an upload.

    Attributes:
        model: the category.
        orientation: the upload's up and front.
        samples: the upload's samples, turned to the canonical frame.
        estimate: refined when refinement was asked for or needed to choose.
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
    turn = orientation.rotation.T
    return Samples(
        samples.points @ turn, samples.normals @ turn, samples.faces, samples.barycentric
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
        refined: refine; where there is more than one orientation to choose from, the best few are
            refined to choose between them whatever this says.

    Returns:
        At least one candidate for each model; the first is the answer.
    """
    candidates: list[Candidate] = []
    for model in models:
        drawn = samples[model.points]
        if len(orientations) == 1:
            turned_samples = turned(drawn, orientations[0])
            answer = estimate(model, turned_samples, refined)
            candidates.append(Candidate(model, orientations[0], turned_samples, answer))
            continue
        candidates += _search(model, drawn, orientations)
    ranked = sorted(candidates, key=lambda candidate: candidate.rank)
    best = ranked[0]
    if not refined and len(orientations) > 1:
        plain = estimate(best.model, best.samples, refined=False)
        ranked[0] = Candidate(best.model, best.orientation, best.samples, plain)
    return ranked


def _search(model: Model, samples: Samples, orientations: Sequence[Orientation]) -> list[Candidate]:
    """Refined candidates for the best few orientations.

    A first orientation that fits as well as shapes of the category usually do is taken at once.
    """
    found: list[Candidate] = []
    first = turned(samples, orientations[0])
    found.append(Candidate(model, orientations[0], first, estimate(model, first)))
    if found[0].estimate.distance <= model.usual_distance:
        return found
    rough = [(_rough_distance(model, samples, o), o) for o in orientations[1:]]
    rough.sort(key=lambda pair: pair[0])
    for _, orientation in rough[:FINALISTS]:
        turned_samples = turned(samples, orientation)
        found.append(Candidate(model, orientation, turned_samples, estimate(model, turned_samples)))
    return found


def _rough_distance(model: Model, samples: Samples, orientation: Orientation) -> float:
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
