"""Which category, and which way up: discriminators rank the readings, fits settle close ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from service.encode.basemodel import STEEPNESS, Fit, Model
from service.encode.straighten import leans
from service.mesh.frame import CANONICAL, Orientation
from service.mesh.frame import orientations as all_orientations
from service.mesh.surface import Normalization, Samples, Surface
from service.stages import stage

CUSTOM = {CANONICAL: 3.0, Orientation("+z", "-y"): 1.5}
"""How much likelier than others the orientations are that most files keep to: glTF's, Blender's.
They decide where a shape looks the same from several sides."""
DECIDED = 0.97
"""Readings are fitted until so much of the probability is seen to,"""
FINALISTS = 4
"""but no more than these."""
STRAIGHTER = 1.05
"""A lean is taken out where the fit's distance is then at most so many times as long."""
NEARER = 0.1
"""A fit is told in another orientation if the trace of its turn is larger there by so much."""
LISTED = 3
"""Readings that are told of at least, where there are so many."""


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
    estimate: Fit

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
    surface: Surface | None = None,
) -> list[Candidate]:
    """Readings of an upload, best first.

    Args:
        models: the categories it may be of.
        samples: the upload's samples in its own frame, by cloud size.
        orientations: those it may have.
        refined: refine the answer.  To choose between readings the best few are refined roughly,
            whatever this says.
        surface: the upload, which some models look at beside its samples.

    Returns:
        At least one candidate; the first is the answer.
    """
    views = _views(models, samples, orientations, surface)
    finalists = 1 + int(np.searchsorted(np.cumsum([v.probability for v in views]), DECIDED))
    finalists = min(finalists, FINALISTS, len(views))
    if finalists == 1:
        listed = [view.candidate(refined=False) for view in views[:LISTED]]
    else:
        fitted = _weighed([view.candidate(refined=True) for view in views[:finalists]])
        listed = [*fitted, *(view.candidate(refined=False) for view in views[finalists:LISTED])]
    with stage("refine"):
        best = straightened(settled(listed[0], samples, orientations))
    whole = surface and surface.turned(best.orientation)
    answer = best.model.estimate(best.samples, refined, surface=whole)
    return [replace(best, estimate=answer), *listed[1:]]


def settled(
    candidate: Candidate, samples: dict[int, Samples], orientations: Sequence[Orientation]
) -> Candidate:
    """The candidate in the orientation, of those it may have, that its fit stands upright in."""
    model = candidate.model
    own = candidate.orientation.rotation.T @ candidate.estimate.turn
    upright = [float(np.trace(way.rotation @ own)) for way in orientations]
    way = orientations[int(np.argmax(upright))]
    now = float(np.trace(candidate.estimate.turn))
    if max(upright) < now + NEARER:
        return candidate
    return replace(candidate, orientation=way, samples=turned(samples[model.points], way))


def straightened(candidate: Candidate) -> Candidate:
    """The candidate without its lean, if it has one and fits about as well or better without."""
    model, samples = candidate.model, candidate.samples
    if model.turns_freely:
        return candidate
    points = Normalization.of(samples.points).apply(samples.points)
    best, least = candidate, np.inf
    for lean in leans(points, model.stands):
        if not np.isfinite(least):
            least = STRAIGHTER * model.estimate(samples, True, rough=True).distance
        turn = CANONICAL.leaning(lean)
        own = turned(samples, turn)
        fit = model.estimate(own, True, rough=True)
        if fit.distance < least:
            orientation = candidate.orientation.leaning(lean)
            best, least = replace(candidate, orientation=orientation, samples=own), fit.distance
    return best


@dataclass(frozen=True)
class _View:
    """A reading that has not been fitted yet; its samples are in the upload's own frame."""

    model: Model
    orientation: Orientation
    samples: Samples
    odds: float
    probability: float
    surface: Surface | None

    def candidate(self, refined: bool) -> Candidate:
        own = turned(self.samples, self.orientation)
        whole = self.surface and self.surface.turned(self.orientation)
        fit = self.model.estimate(own, refined, rough=True, surface=whole)
        return Candidate(self.model, self.orientation, own, self.odds, self.probability, fit)


def _views(
    models: Sequence[Model],
    samples: dict[int, Samples],
    orientations: Sequence[Orientation],
    surface: Surface | None,
) -> list[_View]:
    """All readings with their probabilities, the likeliest first.

    A model that turns freely has one reading: of the likeliest orientation, with the odds of the
    likeliest way of all to turn the upload.
    """
    readings: list[tuple[Model, Orientation, float, float]] = []
    for model in models:
        cloud = samples[model.points].points
        if not model.turns_freely:
            odds = model.discriminator.odds(cloud, orientations)
            worths = odds - model.limit_odds + _custom(orientations)
            readings += [
                (model, way, float(own), float(worth))
                for way, own, worth in zip(orientations, odds, worths, strict=True)
            ]
            continue
        ways = all_orientations()
        odds = model.discriminator.odds(cloud, ways)
        worths = odds - model.limit_odds + _custom(ways)
        way = max(orientations, key=lambda way: worths[ways.index(way)])
        readings.append((model, way, float(odds.max()), float(worths.max())))
    worth = np.array([reading[3] for reading in readings])
    share = np.exp(worth - worth.max())
    share /= share.sum()
    views = [
        _View(model, way, samples[model.points], odds, float(probability), surface)
        for (model, way, odds, _), probability in zip(readings, share, strict=True)
    ]
    return sorted(views, key=lambda view: -view.probability)


def _custom(ways: Sequence[Orientation]) -> NDArray[np.float64]:
    """``[k]`` logarithms of `CUSTOM`."""
    return np.log([CUSTOM.get(way, 1.0) for way in ways])


def _weighed(candidates: list[Candidate]) -> list[Candidate]:
    """Candidates with their probabilities after their fits were seen, the likeliest first."""
    ratio = [c.model.limit_distance / max(c.estimate.distance, 1e-9) for c in candidates]
    prior = np.array([candidate.probability for candidate in candidates])
    share = prior * np.array(ratio) ** STEEPNESS
    share *= prior.sum() / share.sum()
    weighed = [replace(c, probability=float(p)) for c, p in zip(candidates, share, strict=True)]
    return sorted(weighed, key=lambda candidate: -candidate.probability)
