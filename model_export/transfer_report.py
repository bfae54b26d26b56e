"""How well each transfer rule carries edits: ``python -m model_export.transfer_report``.

Detailed chairs, each parameter scaled to 0.7 and to 1.4, against the true edit.  Lengths are in
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

import numpy as np
from numpy.typing import NDArray

from model_export.detailed import DetailedChair, detailed_chair
from service.deform import blend, paper
from service.deform.binding import Binding
from service.deform.flips import count_flips
from service.template.affine import AffineTemplate
from service.template.loader import load_template

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


def score_chair(
    chair: DetailedChair, template: AffineTemplate, rule: Rule, off: Array
) -> Iterator[Score]:
    """Scores of all parameters and `SCALES` with the fitted parameters wrong by factors `off`."""
    original = chair.mesh(chair.parameters)
    center = original.mean(axis=0)
    scale = 0.6 / np.linalg.norm(original - center, axis=1).max()
    x = (original - center) * scale
    f = chair.parameters * off * scale
    binding = rule(x, chair.faces, template, f, -center * scale)
    for parameter in range(len(f)):
        for factor in SCALES:
            edited = chair.parameters.copy()
            edited[parameter] *= factor
            truth = (chair.mesh(edited) - center) * scale
            df = np.zeros_like(f)
            df[parameter] = f[parameter] * (factor - 1.0)
            y = x + binding.displace(df)
            flips = count_flips(x, y, chair.faces, binding.linear(df))
            yield score_edit(x, y, truth, chair.faces, flips)


def report(chairs: int, rules: dict[str, Rule]) -> str:
    """The table, in Markdown, over chairs 0 to ``chairs - 1``."""
    template = load_template("chair")
    lines = [
        "| rule | parameters | EA | p99 EA | locality | p99 edge | flips | passed |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for name, rule in rules.items():
        for label, error in (("true", 0.0), ("off by 5 %", 0.05)):
            scores = [
                astuple(score)
                for seed in range(chairs)
                for score in score_chair(detailed_chair(seed), template, rule, _off(seed, error))
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
    parser.add_argument("--rule", choices=sorted(RULES), action="append")
    options = parser.parse_args()
    chosen = {name: RULES[name] for name in options.rule or RULES}
    print(report(options.chairs, chosen))


if __name__ == "__main__":
    main()
