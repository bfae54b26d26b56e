"""How well each transfer rule carries edits: ``python -m model_export.transfer_report``.

Detailed chairs, each parameter scaled to 0.7 and to 1.4, against the true edit: with the true
parameters, with wrong ones, and with those that the model infers.  Lengths are in
units of the bounding box's diagonal.  Per pair of chair and edit:

- EA: mean error over the mean distance to the truth before the edit; 0 perfect, 1 did nothing.
- p99 EA: the error's 99th percentile over the same.
- locality: mean displacement of vertices that the truth leaves alone.
- p99 edge: 99th percentile of the ratio, or its inverse, of edge lengths to the truth's.
- flips: faces that turn against their own normal carried along, in 1 / 1000.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from dataclasses import astuple, dataclass
from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from model_export.config import SHIPPED
from model_export.detailed import NAMES, DetailedChair, detailed_chair
from service.deform import blend, paper
from service.deform.binding import Binding
from service.deform.followers import following
from service.deform.turning import count_flips
from service.encode.estimate import estimate
from service.encode.model import Model, load_models
from service.mesh.surface import Normalization, sample_surface
from service.template.affine import AffineTemplate

Array = NDArray[np.float64]
Rule = Callable[[Array, NDArray[np.int64], AffineTemplate, Array, Array], Binding]

SCALES = (0.7, 1.4)


@dataclass(frozen=True)
class Score:
    """One edit of one chair; see the module's text."""

    accuracy: float
    tail: float
    locality: float
    edge: float
    flips: float


def global_scale(
    vertices: Array, faces: NDArray[np.int64], template: AffineTemplate, f: Array, t: Array
) -> Binding:
    """What a viewer offers: a thickness, height, width or depth scales the whole mesh."""
    axes = np.array([1, 2, 1, 2, 0, 1, 2, 0])
    x = np.asarray(vertices - t, np.float32)
    jacobian = np.zeros((*x.shape, len(f)), np.float32)
    stretches = np.zeros((3, 9, len(f)), np.float32)
    for parameter, axis in enumerate(axes):
        jacobian[:, axis, parameter] = x[:, axis] / f[parameter]
        stretches[axis, 4 * axis, parameter] = 1.0 / f[parameter]
    return Binding(jacobian, np.ones_like(x), stretches)


def _paper(k: int) -> Rule:
    return lambda v, faces, template, f, t: paper.bind(v, faces, template, f, t, k=k)


RULES: dict[str, Rule] = {
    "global scale": global_scale,
    "paper, k = 1": _paper(1),
    "paper, k = 8": _paper(8),
    "paper, k = 32": _paper(32),
    "blend": blend.bind,
}


def score_edit(x: Array, y: Array, truth: Array, faces: NDArray[np.int64], flips: int) -> Score:
    """Compare an edited mesh ``y [V, 3]`` of ``x`` with the ``truth``."""
    diagonal = np.linalg.norm(np.ptp(x, axis=0))
    moved = np.linalg.norm(truth - x, axis=1)
    error = np.linalg.norm(y - truth, axis=1)
    still = moved < 1e-9
    ends = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    ratio = _lengths(y, ends) / _lengths(truth, ends)
    return Score(
        accuracy=error.mean() / moved.mean(),
        tail=np.quantile(error, 0.99) / moved.mean(),
        locality=(error[still].mean() if still.any() else 0.0) / diagonal,
        edge=float(np.exp(np.quantile(np.abs(np.log(ratio)), 0.99))),
        flips=1000.0 * flips / len(faces),
    )


def _lengths(vertices: Array, ends: NDArray[np.int64]) -> Array:
    length = np.linalg.norm(vertices[ends[:, 0]] - vertices[ends[:, 1]], axis=1)
    return np.maximum(length, 1e-9)


@dataclass(frozen=True)
class Known:
    """What is taken to be known of a chair before it is edited.

    Attributes:
        normalization: from the chair's frame in metres.
        template: the variant.
        f, t: ``[d]`` and ``[3]`` parameters and place in the normalised frame.
    """

    normalization: Normalization
    template: AffineTemplate
    f: Array
    t: Array


def told(chair: DetailedChair, category: AffineTemplate, off: Array) -> Known:
    """The truth, with the public parameters wrong by factors ``off [8]``."""
    normalization = Normalization.of(chair.mesh(chair.parameters))
    values = dict(zip(NAMES, (chair.parameters * off).tolist(), strict=True))
    usual, armchair, *_ = category.variants
    f = category.vector(values | chair.nuisances) * normalization.scale
    origin = -normalization.center * normalization.scale
    return Known(normalization, armchair if chair.arms else usual, f, origin)


def inferred(chair: DetailedChair, model: Model) -> Known:
    """What the service infers of the chair, upright as it stands."""
    vertices = chair.mesh(chair.parameters)
    samples = sample_surface(vertices, chair.faces, model.points, np.random.default_rng(0))
    fit = estimate(model, samples)
    return Known(fit.normalization, fit.template, fit.parameters, fit.translation)


def score_chair(chair: DetailedChair, known: Known, rule: Rule) -> Iterator[Score]:
    """Scores of all public parameters times `SCALES`."""
    normalization, f = known.normalization, known.f
    x = normalization.apply(chair.mesh(chair.parameters))
    binding = rule(x, chair.faces, following(known.template, f), f, known.t)
    for parameter, factor in product(range(len(NAMES)), SCALES):
        edited = chair.parameters.copy()
        edited[parameter] *= factor
        truth = normalization.apply(chair.mesh(edited))
        df = np.zeros_like(f)
        df[parameter] = f[parameter] * (factor - 1.0)
        y = x + binding.displace(df)
        flips = count_flips(x, y, chair.faces, binding.linear(df))
        yield score_edit(x, y, truth, chair.faces, flips)


def report(chairs: int, rules: dict[str, Rule], model: Model) -> str:
    """The table, in Markdown, over chairs 0 to ``chairs - 1``."""
    lines = [
        "| rule | parameters | EA | p99 EA | locality | p99 edge | flips | passed |",
        "|---|---|---|---|---|---|---|---|",
    ]
    drawn = [detailed_chair(seed) for seed in range(chairs)]
    known = {
        "true": [told(chair, model.template, np.ones(len(NAMES))) for chair in drawn],
        "off by 5 %": [
            told(chair, model.template, _off(seed, 0.05)) for seed, chair in enumerate(drawn)
        ],
        "inferred": [inferred(chair, model) for chair in drawn],
    }
    for name, rule in rules.items():
        for label, all_known in known.items():
            scores = [
                astuple(score)
                for chair, own in zip(drawn, all_known, strict=True)
                for score in score_chair(chair, own, rule)
            ]
            table = np.array(scores)
            passed = (table[:, 0] < 0.1) & (table[:, 2] < 1e-3) & (table[:, 4] == 0.0)
            ea, tail, locality, edge, flips = table.mean(axis=0)
            lines.append(
                f"| {name} | {label} | {ea:.3f} | {tail:.2f} | {locality:.1e} | {edge:.3f} "
                f"| {flips:.3f} | {100 * passed.mean():.0f} % |"
            )
    return "\n".join(lines)


def _off(seed: int, error: float) -> Array:
    signs = np.random.default_rng([7, seed]).choice([-1.0, 1.0], 8)
    return 1.0 + error * signs


def main() -> None:
    """Print the report."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--chairs", type=int, default=20)
    parser.add_argument("--models", type=Path, default=SHIPPED, help="folder of the chair's model")
    parser.add_argument("--rule", choices=sorted(RULES), action="append")
    options = parser.parse_args()
    chosen = {name: RULES[name] for name in options.rule or RULES}
    print(report(options.chairs, chosen, load_models(options.models)["chair"]))


if __name__ == "__main__":
    main()
