"""Measure a model: ``python -m model_export.evaluate chair --realistic DIR --truth FILE``."""

from __future__ import annotations

import argparse
import json
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch
from tqdm import tqdm

from model_export.config import SHIPPED
from model_export.metrics import Recovery, recovery
from model_export.realistic import RealisticShape, find_shapes
from model_export.samples import infer_shape, synthetic_samples
from model_export.truth import errors_table, judge, kinds_table, read_truth, save_worst
from service.encode.estimate import Estimate, estimate
from service.encode.model import Model, load_models
from service.mesh.frame import CANONICAL
from service.mesh.surface import Normalization

KINDS = ("kind", "tail")
"""Entries of a manifest that real shapes are told apart by."""


def synthetic_table(model: Model, count: int) -> dict[str, Any]:
    """B1: recovery on template shapes by a constant, by the encoder, and with refinement."""
    samples, labels, variant = synthetic_samples(model, count)
    names = list(model.template.present)
    encoded, refined = [], []
    for drawn in tqdm(samples, desc="synthetic", mininterval=2.0):
        normalization = Normalization.of(drawn.points)
        encoding = model.encode(normalization.apply(drawn.points))
        fit = estimate(model, drawn)
        told = [float(name == fit.template.variant) for name in names]
        shares = encoding.shares if names else []
        encoded.append([*encoding.parameters, *encoding.translation, *shares])
        refined.append([*fit.parameters, *fit.translation, *told])
    constant = np.tile([*labels.mean(axis=0), *np.zeros(len(names))], (count, 1))
    rows = {"constant": constant, "encoder": np.array(encoded), "refined": np.array(refined)}
    table = {
        n: _summary(model, recovery(model.template, r, labels, variant)) for n, r in rows.items()
    }
    return {"shapes": count, "thresholds": [0.01, 0.02, 0.03], **table}


def _summary(model: Model, result: Recovery) -> dict[str, Any]:
    return {
        "vertices_within_percent": [round(100 * share, 2) for share in result.within],
        "edited_within_percent": [round(100 * share, 2) for share in result.edited],
        "variants_told_percent": round(100 * result.variants, 2),
        "mean_error_percent_of_range": {
            name: round(100 * float(error), 2)
            for name, error in zip(model.template.names, result.error, strict=True)
        },
    }


def real_fits(model: Model, shapes: Sequence[RealisticShape]) -> dict[str, Any]:
    """B2: distance of the fitted template, over the bounding box's diagonal, on real shapes.

    Of all of them, and of each kind that the manifest tells.
    """
    groups: dict[str, list[tuple[Estimate, float]]] = defaultdict(list)
    for shape in tqdm(shapes, desc="real"):
        found = infer_shape(model, shape)
        odds = float(model.discriminator.odds(found.samples.points, [CANONICAL])[0])
        row = found.fit, model.score(found.fit.distance, odds)
        kinds = [f"{name} {shape.info[name]}" for name in KINDS if shape.info.get(name)]
        if shape.info.get("base") == "4" and shape.info.get("kind") != "stool":
            kinds.insert(0, "four legs and a back")
        for kind in ["all", *kinds]:
            groups[kind].append(row)
    return {
        name: {
            "shapes": len(rows),
            "median_distance_encoder": _median([fit.encoder_distance for fit, _ in rows]),
            "median_distance_refined": _median([fit.distance for fit, _ in rows]),
            "median_score": _median([score for _, score in rows]),
        }
        for name, rows in sorted(groups.items(), key=lambda item: -len(item[1]))
    }


def _median(values: Sequence[float]) -> float:
    return round(float(np.median(values)), 4)


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m model_export.evaluate", description=__doc__)
    parser.add_argument("name", help="of the category")
    parser.add_argument("--models", type=Path, help="models folder (default: the shipped one)")
    parser.add_argument("--realistic", type=Path, help="folder of real meshes")
    parser.add_argument("--truth", type=Path, help="hand measurements of some of them")
    parser.add_argument("--worst", type=Path, help="PNG to draw the ten worst of these to")
    parser.add_argument("--count", type=int, default=1000, help="synthetic shapes")
    arguments = parser.parse_args()
    model = load_models(arguments.models or SHIPPED)[arguments.name]
    torch.set_num_threads(1)
    if arguments.count:
        print(json.dumps(synthetic_table(model, arguments.count), indent=2))
    if arguments.realistic:
        shapes = find_shapes(arguments.realistic)
        print(json.dumps(real_fits(model, [s for s in shapes if s.held_out]), indent=2))
        if arguments.truth:
            judged = judge(model, arguments.realistic, read_truth(arguments.truth))
            print(errors_table(judged), kinds_table(judged), sep="\n\n")
            if arguments.worst:
                save_worst(model, judged, arguments.worst)


if __name__ == "__main__":
    main()
