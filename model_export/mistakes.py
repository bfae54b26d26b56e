"""What is wrong with a template that compiles, somewhere in its ranges, and what to do about it."""

from __future__ import annotations

import keyword
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from model_export.new import NAME
from service.template.affine import AffineTemplate

Array = NDArray[np.float64]

DRAWS = 400
CORNERS = 10
"""All corners of the ranges are looked at up to so many parameters, else random ones."""
GAP = 1e-6
"""Parts closer than this share of the shape's size touch."""
RARE = 0.05
"""Share of draws that keep the relations below which drawing is slow."""


@dataclass(frozen=True)
class Mistake:
    """Something wrong: a template with an error can't be trained, one with warnings can."""

    entry: str
    text: str
    error: bool = True

    def __str__(self) -> str:
        return f"{'error' if self.error else 'warning'}: {self.entry}: {self.text}"


def find_mistakes(template: AffineTemplate) -> list[Mistake]:
    """What is wrong with a template that compiles, anywhere in its ranges.

    What may follow from an error is only looked for once there is none.
    """
    found = [
        mistake
        for find in (_names, _anchors_and_points, _fixed, _idle, _absent, _relations)
        for mistake in find(template)
    ]
    for find in (_turned, _apart):
        if not any(mistake.error for mistake in found):
            shapes = draws(template)
            mistakes = [mistake for own in template.variants for mistake in find(own, shapes)]
            found += dict.fromkeys(mistakes)
    return found


def _names(template: AffineTemplate) -> Iterator[Mistake]:
    for name in (*template.names, *template.derived):
        if not NAME.fullmatch(name) or keyword.iskeyword(name):
            yield Mistake(f"parameters {name}", "use small letters, digits and _ in the name")
    for name in set(template.names) & set(template.derived):
        yield Mistake(f"derived {name}", "is a parameter's name too: rename one of them")
    for name, dimension in template.derived.items():
        if dimension.on is not None and dimension.on not in template.parts:
            text = f"no part is named {dimension.on!r}: name one of `parts` in `measure`"
            yield Mistake(f"derived {name}", text)
    for parameter in template.parameters:
        low, high = parameter.typical
        if not low < high:
            text = f"typical {[low, high]} is empty: write [smallest, largest]"
            yield Mistake(f"parameters {parameter.name}", text)


def _anchors_and_points(template: AffineTemplate) -> Iterator[Mistake]:
    for name, rows in template.anchors.items():
        if len(rows) != 3:
            yield Mistake(f"keep {name}", f"has {len(rows)} coordinates: write [x, y, z]")
    if not 256 <= template.points <= 8192:
        text = f"{template.points} is unusual: 1024 to 4096 suit most objects"
        yield Mistake("points", text, error=False)


def _fixed(template: AffineTemplate) -> Iterator[Mistake]:
    for index, name in enumerate(template.parts):
        if np.abs(template.base[template.part == index]).max(initial=0.0) > 0.0:
            yield Mistake(
                f"parts {name}",
                "has a constant length, which can't be recognised since an upload's scale is not "
                "known: make it a parameter, or a share of one",
            )


def _idle(template: AffineTemplate) -> Iterator[Mistake]:
    """Parameters that move nothing, and sets of them that can't be told apart."""
    columns = template.jacobian.reshape(-1, len(template.names))
    size = np.linalg.norm(columns, axis=0)
    for name, length in zip(template.names, size, strict=True):
        if length < GAP:
            yield Mistake(f"parameters {name}", "moves nothing: use it in a part, or leave it out")
    moving = np.flatnonzero(size >= GAP)
    # The place of the whole is inferred too, so that a parameter which only shifts it is idle.
    shifts = np.tile(np.eye(3), (len(template.base), 1)) / np.sqrt(len(template.base))
    scaled = np.hstack([columns[:, moving] / size[moving], shifts])
    _, values, rows = np.linalg.svd(scaled, full_matrices=False)
    for row in rows[values < GAP * values[0]]:
        names = [
            template.names[moving[i]] for i in np.flatnonzero(np.abs(row[: len(moving)]) > 1e-3)
        ]
        if len(names) == 1:
            text = "only shifts the whole shape, which no one can see: leave it out"
        else:
            text = "move the same thing and can't be told apart: leave one of them out"
        yield Mistake(f"parameters {', '.join(names)}", text)


def _absent(template: AffineTemplate) -> Iterator[Mistake]:
    """Parameters that a variant offers for edits without having a part that they move."""
    for own in template.variants:
        for parameter, active in zip(own.parameters, own.active, strict=True):
            if own.variant and not active and not parameter.nuisance:
                yield Mistake(
                    f"variants {own.variant}",
                    f"has no part that {parameter.name} moves: give it one, or make the parameter "
                    "a nuisance",
                )


def _relations(template: AffineTemplate) -> Iterator[Mistake]:
    rows, low, high = template.relations, template.low, template.high
    least = rows[:, 0] + np.minimum(rows[:, 1:] * low, rows[:, 1:] * high).sum(axis=1)
    most = rows[:, 0] + np.maximum(rows[:, 1:] * low, rows[:, 1:] * high).sum(axis=1)
    for text, smallest, largest in zip(template.relation_texts, least, most, strict=True):
        entry = f"relations {text}"
        if largest < 0.0:
            yield Mistake(entry, "is kept nowhere in the ranges: turn its sign or widen the ranges")
        elif smallest >= 0.0:
            text = "is kept everywhere in the ranges: leave it out, or correct it"
            yield Mistake(entry, text, error=False)
    f = np.random.default_rng(0).uniform(low, high, (4000, len(low)))
    share = float((f @ rows[:, 1:].T + rows[:, 0] >= 0.0).all(axis=1).mean())
    if share == 0.0:
        yield Mistake("relations", "together are kept next to nowhere in the ranges: loosen them")
    elif share < RARE:
        text = f"together are kept by {100 * share:.1f} % of the ranges: narrow the ranges"
        yield Mistake("relations", text, error=False)


def draws(template: AffineTemplate) -> Array:
    """``[n, d]`` parameters that keep the relations: the middle, corners of the ranges, and others.

    The middle is the mean of the draws in the ranges that keep the relations; a corner that breaks
    one is drawn back towards the middle until it no longer does.
    """
    low, high, size = template.low, template.high, len(template.names)
    rng = np.random.default_rng(0)
    inside = low + rng.random((4000, size)) * (high - low)
    rows = template.relations
    inside = inside[(inside @ rows[:, 1:].T + rows[:, 0] >= 0.0).all(axis=1)]
    middle = inside.mean(axis=0)
    if size <= CORNERS:
        bits = (np.arange(2**size)[:, None] >> np.arange(size)) & 1
    else:
        bits = rng.integers(0, 2, (2**CORNERS, size))
    corners = np.where(bits == 1, high, low)
    at_middle = rows[:, 0] + rows[:, 1:] @ middle
    at_corner = rows[:, 0] + corners @ rows[:, 1:].T
    fall = np.maximum(at_middle - at_corner, np.finfo(float).tiny)
    way = np.where(at_corner < 0.0, at_middle / fall, 1.0).min(axis=1, initial=1.0)
    corners = middle + way[:, None] * (corners - middle)
    return np.concatenate([middle[None], corners, inside[:DRAWS]])


def _turned(template: AffineTemplate, shapes: Array) -> Iterator[Mistake]:
    """Parts that are inside out, or of no size along a side, somewhere."""
    volumes = np.stack([_volumes(template, template.decode(f)) for f in shapes])
    for index, name in enumerate(template.parts):
        worst = int(volumes[:, index].argmin())
        if volumes[worst, index] <= 0.0 or _is_reversed(template, index, shapes):
            yield Mistake(
                f"parts {name}",
                "is inside out or has no volume somewhere in the ranges (at "
                f"{_values(template, shapes[worst], index)}): correct its size, narrow the "
                "ranges, or add a relation",
            )


def _values(template: AffineTemplate, f: Array, *parts: int) -> str:
    """The values that decide about some parts, in words."""
    moving = np.abs(template.jacobian[np.isin(template.part, parts)]).max(axis=(0, 1)) > 0.0
    rows = zip(template.names, f, moving, strict=True)
    return ", ".join(f"{name} {value:.3g}" for name, value, moves in rows if moves)


def _volumes(template: AffineTemplate, vertices: Array) -> Array:
    """``[P]`` signed volumes of the parts, all of which are closed."""
    a, b, c = (vertices[template.faces[:, corner]] for corner in range(3))
    volume = np.einsum("fc,fc->f", a, np.cross(b, c)) / 6.0
    return np.bincount(template.part[template.faces[:, 0]], volume, len(template.parts))


def _is_reversed(template: AffineTemplate, part: int, shapes: Array) -> bool:
    """Whether a side of the part's frame changes its direction within the ranges."""
    frames = template.frame_base[part] + np.einsum(
        "cke,ne->nck", template.frame_jacobian[part], shapes
    )
    sides = np.diagonal(frames[:, :, :3], axis1=1, axis2=2)
    return bool((sides.min(axis=0) * sides.max(axis=0) <= 0.0).any())


def _apart(template: AffineTemplate, shapes: Array) -> Iterator[Mistake]:
    """Parts that touch nothing in the middle of the ranges, or that leave what they touch there.

    Some may be meant to; a share of draws in pieces says how far that goes.
    """
    gaps = np.stack([_gaps(template, template.decode(f)) for f in shapes])
    touching = gaps <= GAP
    names, count = template.parts, len(template.parts)
    broken = np.array([connected_components(t)[0] > 1 for t in touching])
    for one, two in combinations(range(count), 2):
        worst = int(gaps[:, one, two].argmax())
        if touching[0, one, two] and not touching[worst, one, two]:
            share = float((broken & ~touching[:, one, two]).mean())
            pieces = f" ({100 * share:.0f} % of the draws fall into pieces so)" if share else ""
            yield Mistake(
                f"parts {names[one]}, {names[two]}",
                "touch in the middle of the ranges but come apart at "
                f"{_values(template, shapes[worst], one, two)}{pieces}: express the place of one "
                "by the other's size, or add a relation",
                error=False,
            )
    for index in np.flatnonzero(touching[0].sum(axis=1) == 1) if count > 1 else ():
        yield Mistake(f"parts {names[index]}", "touches no other part", error=False)


def _gaps(template: AffineTemplate, vertices: Array) -> Array:
    """``[P, P]`` how far apart the parts' bounding boxes are, over the shape's size."""
    parts = [vertices[template.part == part] for part in range(len(template.parts))]
    low, high = np.stack([p.min(axis=0) for p in parts]), np.stack([p.max(axis=0) for p in parts])
    gaps: Array = np.maximum(low[:, None] - high, low - high[:, None]).max(axis=2)
    return gaps / np.ptp(vertices, axis=0).max()
