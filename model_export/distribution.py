"""Which shapes there really are, for variants that look like them: fitted parameters of real ones.

``python -m model_export.distribution chair --realistic DIR`` writes the entry ``distribution`` of
an installed card, from the shapes of the training split alone, and nothing else of it.
"""

from __future__ import annotations

import argparse
import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri
from scipy.stats import rankdata

from model_export.realistic import RealisticShape, find_shapes
from service.affineinference import AffineInference
from service.augment.affinesampler import overall_size
from service.augment.distribution import ALL, OVERALL_SIZE
from service.bodyinference import BodyInference
from service.deform.admissible import in_ranges
from service.encode.basemodel import Model
from service.encode.card import read_card
from service.encode.model import SHIPPED, load_models
from service.errors import ShapeError
from service.finding import inferred
from service.inference import IN_DISTRIBUTION
from service.requests import UNITS, InferOptions, Upload
from service.template.anatomy import JOINTS, MIRRORED
from service.template.skinned import NAMES

Array = NDArray[np.float64]

FEWEST = 15
"""Shapes of a kind that have a copula of their own."""
OUTER = 0.02
"""Share of the shapes at either end that draws do not go beyond."""
LENGTH_ENDS, ANGLE_ENDS = 17, 9
"""Quantiles that are told of a length and of an angle."""
FACTORS = 12
"""That the correlation of a body's 69 angles is written by; of lengths it is written whole."""
DECIMALS = 4
SLACK = 1.25
"""Factor by which a shape's extents may be beyond what is typical, to be in metres or centimetres;
other files' units are taken for unknown."""
POSED = NAMES[3 : 3 * len(JOINTS)]


@dataclass(frozen=True)
class Fitted:
    """A real shape as it was fitted.

    Attributes:
        shape: the mesh.
        kind: the variant of the template.
        values: ``[p]``; not a number where one is not known.
    """

    shape: RealisticShape
    kind: str
    values: Array


def value_names(model: Model) -> list[str]:
    """Names of what a distribution is of: lengths and the size of the whole, or angles."""
    if model.kind == "skinned":
        return list(POSED)
    template = model.template
    public = [name for name, seen in zip(template.names, template.public, strict=True) if seen]
    return [*public, OVERALL_SIZE]


def fit_all(model: Model, shapes: Sequence[RealisticShape]) -> list[Fitted]:
    """The shapes to train on that the model takes for its category's, near duplicates once."""
    fitted, seen = [], set()
    options = InferOptions(category=model.name, up="+y", front="+z")
    for shape in shapes:
        key = _alike(shape)
        if shape.held_out or key in seen:
            continue
        try:
            upload = Upload(shape.path.read_bytes(), shape.path.name)
            with inferred(upload, {model.name: model}, options, None) as found:
                if found.best.score < IN_DISTRIBUTION:
                    continue
                values = _body(found) if isinstance(found, BodyInference) else _lengths(found)
        except (ShapeError, OSError) as error:
            print(f"{shape.name}: {error}")
            continue
        if values is not None:
            seen.add(key)
            variant = "" if isinstance(found, BodyInference) else found.fit.template.variant
            fitted.append(Fitted(shape, variant, values))
    return fitted


def _alike(shape: RealisticShape) -> str:
    """What shapes share of which one will do."""
    info = shape.info
    if info.get("character") and info.get("pose"):
        return f"{info['character']} {info['pose']}"
    return str(info.get("near_dup_group") or shape.name)


def _lengths(found: AffineInference) -> Array | None:
    """Logarithms of the shape's proportions and of its size in metres; offsets as shares of the
    size.  None for a fit outside of the ranges at any size."""
    template, parameters = found.fit.template, found.parameters
    if not in_ranges(template, parameters):
        return None
    size = overall_size(template, parameters)
    shares = parameters / size
    with np.errstate(invalid="ignore", divide="ignore"):
        values = np.where(template.signed, shares, np.log(shares))
    return np.append(values[template.public], np.log(size * _metres(found)))


def _metres(found: AffineInference) -> float:
    """Metres per unit of a file that does not tell; not a number where none makes it a usual
    size."""
    extents = {
        name: found.derived_report()[name]["value"]
        for name, dimension in found.model.template.derived.items()
        if dimension.extent is not None
    }
    for metres in (UNITS["m"], UNITS["cm"]):
        if extents and all(
            low / SLACK <= metres * extents[name] <= SLACK * high
            for name in extents
            for low, high in [found.model.template.derived[name].typical]
        ):
            return metres
    return np.nan


def _body(found: BodyInference) -> Array:
    return found.parameters[3 : 3 * len(JOINTS)]


def mirrored(poses: Array) -> Array:
    """``[n, 69]`` poses with left and right changed over."""
    whole = np.concatenate([np.zeros((len(poses), 3)), poses], axis=1)
    turned = whole.reshape(len(poses), -1, 3)[:, list(MIRRORED)] * [1.0, -1.0, -1.0]
    return turned.reshape(len(poses), -1)[:, 3:]


def scores(values: Array) -> Array:
    """``[n, p]`` normal scores of the values' ranks, column by column; unknown ones stay so."""
    result = np.full_like(values, np.nan)
    for column, out in zip(values.T, result.T, strict=True):
        known = np.isfinite(column)
        out[known] = ndtri(rankdata(column[known]) / (known.sum() + 1))
        out[known] /= max(float(out[known].std()), 1e-9)
    return result


def correlation(z: Array, samples: int) -> Array:
    """``[p, p]`` correlation of normal scores, shrunk towards none by as much as so few samples ask
    for (Schaefer and Strimmer 2005).

    Args:
        z: ``[n, p]``; what is unknown is left out pair by pair.
        samples: how many of the rows are independent.
    """
    known = np.isfinite(z)
    z = np.where(known, z, 0.0)
    pairs = np.maximum(known.T.astype(float) @ known, 1.0)
    r = (z.T @ z) / pairs
    variance = ((z**2).T @ z**2 / pairs - r**2) * len(z) / (pairs * samples)
    off = ~np.eye(len(r), dtype=bool)
    shrink = np.clip(variance[off].sum() / max(float((r[off] ** 2).sum()), 1e-9), 0.0, 1.0)
    r[off] *= 1.0 - shrink
    np.fill_diagonal(r, 1.0)
    return np.asarray(r)


def factors(r: Array, count: int) -> Array:
    """``[k, p]`` loadings on the ``count`` strongest factors of a correlation ``[p, p]``, none
    longer than 1."""
    values, vectors = np.linalg.eigh(r)
    strongest = np.argsort(-values)[:count]
    loadings = np.sqrt(np.maximum(values[strongest], 0.0))[:, None] * vectors.T[strongest]
    length = np.linalg.norm(loadings, axis=0)
    return np.asarray(loadings / np.maximum(length, 1.0))


def copula(values: Array, ends: int, count: int, samples: int | None = None) -> dict[str, Any]:
    """What a card says of shapes of one kind.

    Args:
        values: ``[n, p]``.
        ends: how many quantiles to tell.
        count: of factors.
        samples: how many rows are independent; by default all.
    """
    levels = np.linspace(OUTER, 1.0 - OUTER, ends)
    r = correlation(scores(values), samples or len(values))
    return {
        "quantiles": _plain(np.nanquantile(values, levels, axis=0).T),
        "loadings": _plain(factors(r, count)),
    }


def _plain(rows: Array) -> list[list[float]]:
    return [[round(value, DECIMALS) for value in row] for row in rows.tolist()]


def distribution_entry(model: Model, fitted: Sequence[Fitted]) -> dict[str, Any]:
    """The card's entry.

    Raises:
        ValueError: for too few shapes to tell anything.
    """
    if len(fitted) < FEWEST:
        raise ValueError(f"{len(fitted)} shapes are too few: {FEWEST} are needed")
    names, values = value_names(model), np.array([shape.values for shape in fitted])
    if model.kind == "skinned":
        both = np.concatenate([values, mirrored(values)])
        kinds = {ALL: copula(both, ANGLE_ENDS, FACTORS, len(values))}
    else:
        if np.isfinite(values[:, -1]).sum() < FEWEST:
            names, values = names[:-1], values[:, :-1]
        kinds = _by_kind(values, np.array([shape.kind for shape in fitted]))
    licences = Counter(
        str(f.shape.info.get("licence") or f.shape.info.get("license") or "unknown") for f in fitted
    )
    return {
        "source": {
            "shapes": len(fitted),
            "split": "train",
            "kinds": dict(Counter(f.kind for f in fitted if f.kind).most_common()),
            "licences": dict(licences.most_common()),
        },
        "parameters": names,
        "kinds": kinds,
    }


def _by_kind(values: Array, kind: NDArray[np.str_]) -> dict[str, Any]:
    kinds = {}
    for name in ("", *sorted(set(kind.tolist()) - {""})):
        own = values[kind == name] if name else values
        if len(own) < FEWEST:
            continue
        kinds[name or ALL] = _filled(own, kinds)
    return kinds


def _filled(own: Array, kinds: dict[str, Any]) -> dict[str, Any]:
    """The copula of shapes of one kind; what too few of them tell is as it is with all, and goes
    with nothing."""
    known = np.isfinite(own).sum(axis=0) >= FEWEST
    part = copula(own[:, known], LENGTH_ENDS, int(known.sum()))
    if known.all():
        return part
    quantiles = [list(row) for row in kinds[ALL]["quantiles"]]
    for index, row in zip(np.flatnonzero(known), part["quantiles"], strict=True):
        quantiles[index] = row
    loadings = np.zeros((len(part["loadings"]), len(known)))
    loadings[:, known] = part["loadings"]
    return {"quantiles": quantiles, "loadings": loadings.tolist()}


def write_entry(path: Path, entry: dict[str, Any]) -> None:
    """Put an entry into an installed card.

    Raises:
        ModelFault: for what is no card.
    """
    card = read_card(path)
    card["distribution"] = entry
    text = json.dumps(card, indent=2) + "\n"
    path.write_text(text, "utf-8")
    read_card(path)


def add_distribution(card: dict[str, Any], model: Model, shapes: Sequence[RealisticShape]) -> None:
    """Put the entry into a card in the making, where there are shapes enough."""
    try:
        card["distribution"] = distribution_entry(model, fit_all(model, shapes))
    except ValueError as error:
        print(f"no distribution of real shapes: {error}")


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(
        prog="python -m model_export.distribution", description=__doc__
    )
    parser.add_argument("name", help="of the category")
    parser.add_argument("--realistic", type=Path, required=True, help="folder of real meshes")
    parser.add_argument("--out", type=Path, default=SHIPPED, help="models folder")
    arguments = parser.parse_args()
    model = load_models(arguments.out, names=[arguments.name])[arguments.name]
    entry = distribution_entry(model, fit_all(model, find_shapes(arguments.realistic)))
    write_entry(arguments.out / f"{arguments.name}.json", entry)
    print(f"wrote the distribution of {entry['source']['shapes']} shapes")


if __name__ == "__main__":
    main()
