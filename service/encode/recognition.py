"""Which category, and which way up: discriminators rank the readings, fits settle close ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from service.encode.estimate import Estimate, estimate
from service.encode.model import STEEPNESS, Model
from service.encode.refine import Settings
from service.encode.straighten import leans
from service.mesh.frame import CANONICAL, Orientation
from service.mesh.surface import Normalization, Samples

CUSTOM = {CANONICAL: 3.0, Orientation("+z", "-y"): 1.5}
"""How much likelier than others the orientations are that most files keep to: glTF's, Blender's.
They decide where a shape looks the same from several sides."""
DECIDED = 0.97
"""Readings are fitted until so much of the probability is seen to,"""
FINALISTS = 4
"""but no more than these."""
STRAIGHTER = 1.05
"""A lean is taken out where the fit's distance is then at most so many times as long."""
LISTED = 3
"""Readings that are told of at least, where there are so many."""
ROUGH = Settings(iterations=8, rough=0, template_points=600)
"""Enough refinement to tell readings apart; it sees every third sample."""


@dataclass(frozen=True)
class Candidate:
    """One reading of an upload.

    Attributes:
        model: the category.
        orientation: the upload's up and front.
        samples: the upload's samples, turned to the canonical frame.
        odds: the discriminator's log odds.
        probability: of this reading among all that were asked for.
        estimate: of the answer as asked for; of the others a rough one.
    """

    model: Model
    orientation: Orientation
    samples: Samples
    odds: float
    probability: float
    estimate: Estimate

    @property
    def score(self) -> float:
        """How much it looks and fits like one of its category."""
        return self.model.score(self.estimate.distance, self.odds)


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
        orientations: those it may have.
        refined: refine the answer.  To choose between readings the best few are refined roughly,
            whatever this says.

    Returns:
        At least one candidate; the first is the answer.
    """
    views = _views(models, samples, orientations)
    finalists = 1 + int(np.searchsorted(np.cumsum([v.probability for v in views]), DECIDED))
    finalists = min(finalists, FINALISTS, len(views))
    if finalists == 1:
        listed = [view.candidate(refined=False) for view in views[:LISTED]]
    else:
        fitted = _weighed([view.candidate(refined=True) for view in views[:finalists]])
        listed = [*fitted, *(view.candidate(refined=False) for view in views[finalists:LISTED])]
    best = straightened(listed[0])
    answer = estimate(best.model, best.samples, refined)
    return [replace(best, estimate=answer), *listed[1:]]


def straightened(candidate: Candidate) -> Candidate:
    """The candidate without its lean, if it has one and fits about as well or better without."""
    model, samples = candidate.model, candidate.samples
    points = Normalization.of(samples.points).apply(samples.points)
    best, least = candidate, np.inf
    for lean in leans(points, model.template.stands):
        if not np.isfinite(least):
            least = STRAIGHTER * _rough(model, samples).distance
        turn = CANONICAL.leaning(lean)
        own = turned(samples, turn)
        fit = _rough(model, own)
        if fit.distance < least:
            orientation = candidate.orientation.leaning(lean)
            best, least = replace(candidate, orientation=orientation, samples=own), fit.distance
    return best


def _rough(model: Model, samples: Samples, refined: bool = True) -> Estimate:
    """An estimate that is good enough to tell readings apart."""
    return estimate(model, samples, refined, ROUGH, stride=3)


@dataclass(frozen=True)
class _View:
    """A reading that has not been fitted yet; its samples are in the upload's own frame."""

    model: Model
    orientation: Orientation
    samples: Samples
    odds: float
    probability: float

    def candidate(self, refined: bool) -> Candidate:
        own = turned(self.samples, self.orientation)
        fit = _rough(self.model, own, refined)
        return Candidate(self.model, self.orientation, own, self.odds, self.probability, fit)


def _views(
    models: Sequence[Model], samples: dict[int, Samples], orientations: Sequence[Orientation]
) -> list[_View]:
    """All readings with their probabilities, the likeliest first."""
    odds = [m.discriminator.odds(samples[m.points].points, orientations) for m in models]
    customary = np.log([CUSTOM.get(way, 1.0) for way in orientations])
    worth = np.stack([o - m.limit_odds for o, m in zip(odds, models, strict=True)]) + customary
    share = np.exp(worth - worth.max())
    share /= share.sum()
    views = [
        _View(model, way, samples[model.points], float(odds[m][w]), float(share[m, w]))
        for m, model in enumerate(models)
        for w, way in enumerate(orientations)
    ]
    return sorted(views, key=lambda view: -view.probability)


def _weighed(candidates: list[Candidate]) -> list[Candidate]:
    """Candidates with their probabilities after their fits were seen, the likeliest first."""
    ratio = [c.model.limit_distance / max(c.estimate.distance, 1e-9) for c in candidates]
    prior = np.array([candidate.probability for candidate in candidates])
    share = prior * np.array(ratio) ** STEEPNESS
    share *= prior.sum() / share.sum()
    weighed = [replace(c, probability=float(p)) for c, p in zip(candidates, share, strict=True)]
    return sorted(weighed, key=lambda candidate: -candidate.probability)
