"""Measure a model: ``python -m model_export.evaluate chair --realistic DIR --truth FILE``."""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch
from tqdm import tqdm

from model_export.config import SHIPPED
from model_export.metrics import Recovery, recovery
from model_export.realistic import CLOUD_SIZE, RealisticShape, find_shapes, load_cloud
from model_export.synthetic import Augmentation, SyntheticShapes
from service.encode.estimate import Estimate, estimate
from service.encode.model import Model, load_models
from service.mesh.formats import read_mesh
from service.mesh.surface import Normalization, Samples, sample_surface

TEST_SEED = 10_000_019


def clouds_of(shapes: Sequence[RealisticShape], cache: Path, points: int) -> list[np.ndarray]:
    """Normalised clouds ``[points, 3]`` of real shapes."""
    # Samples come in the order of the faces: spread the choice over all of them.
    chosen = np.linspace(0, CLOUD_SIZE - 1, points).round().astype(int)
    clouds = [load_cloud(shape, cache)[chosen] for shape in shapes]
    return [Normalization.of(cloud).apply(cloud).astype(np.float32) for cloud in clouds]


def synthetic_samples(model: Model, count: int) -> tuple[list[Samples], np.ndarray, np.ndarray]:
    """Clean surface samples of fresh draws, in metres, their normalised labels and variants."""
    shapes = SyntheticShapes(model.template, Augmentation.none(), TEST_SEED)
    parameters, variant = shapes.draw_parameters(count), shapes.draw_variants(count).numpy()
    samples, labels = [], []
    for index, f in enumerate(parameters):
        template = model.template.variants[variant[index]]
        visible = template.faces[~template.hidden]
        rng = np.random.default_rng([TEST_SEED, index])
        drawn = sample_surface(template.decode(f), visible, model.points, rng)
        normalization = Normalization.of(drawn.points)
        samples.append(drawn)
        labels.append([*(f * normalization.scale), *(-normalization.center * normalization.scale)])
    return samples, np.array(labels), variant


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


def infer_shape(model: Model, shape: RealisticShape) -> tuple[Estimate, Samples]:
    """What the service would answer for a canonically oriented file."""
    mesh = read_mesh(shape.path.read_bytes(), shape.path.name)
    rng = np.random.default_rng(0)
    samples = sample_surface(mesh.vertices, mesh.faces, model.points, rng)
    return estimate(model, samples), samples


def real_fits(model: Model, shapes: Sequence[RealisticShape]) -> dict[str, Any]:
    """B2: distance of the fitted template, over the bounding box's diagonal, on real shapes."""
    rows = [(shape, infer_shape(model, shape)[0]) for shape in tqdm(shapes, desc="real")]
    ordinary = [
        fit for shape, fit in rows
        if shape.info.get("base") == "4" and shape.info.get("kind") != "stool"
    ]  # fmt: skip
    table = {"all": [fit for _, fit in rows], "four_legs_and_back": ordinary}
    return {
        name: {
            "shapes": len(fits),
            "median_distance_encoder": _median([fit.encoder_distance for fit in fits]),
            "median_distance_refined": _median([fit.distance for fit in fits]),
        }
        for name, fits in table.items()
        if fits
    }


def _median(values: Sequence[float]) -> float:
    return round(float(np.median(values)), 4)


TRUTH_NAMES = {"back_thickness": "back_depth", "seat_thickness": "seat_height"}


def truth_errors(model: Model, folder: Path, truth: Path) -> dict[str, dict[str, np.ndarray]]:
    """Errors against hand measurements in percent of the shape's height, by parameter.

    Each is the smallest over the defensible readings of the dimension.
    """
    measured = {row["id"]: row for row in map(json.loads, truth.read_text("utf-8").splitlines())}
    errors: dict[str, dict[str, list[float]]] = {"encoder": {}, "refined": {}}
    for shape in tqdm([s for s in find_shapes(folder) if s.name in measured], desc="truth"):
        row = measured[shape.name]
        fit, samples = infer_shape(model, shape)
        points = fit.normalization.apply(samples.points)
        answers = {"encoder": model.encode(points).parameters, "refined": fit.parameters}
        for kind, parameters in answers.items():
            lengths = parameters / fit.normalization.scale
            values = dict(zip(model.template.names, lengths, strict=True))
            for name, gap in _gaps(values, row).items():
                errors[kind].setdefault(name, []).append(gap)
    return {k: {n: np.array(v) for n, v in table.items()} for k, table in errors.items()}


def _gaps(values: dict[str, float], row: dict[str, Any]) -> dict[str, float]:
    height = row["bbox"]["extents"][1]
    other = row.get("alternatives", {}).get("template", {})
    gaps = {}
    for name, value in values.items():
        key = TRUTH_NAMES.get(name, name)
        if row["template_confidence"].get(key) == "undefined":
            continue
        alternatives = other.get(key, [])
        alternatives = alternatives if isinstance(alternatives, list) else [alternatives]
        readings = [row["template"][key], *alternatives]
        gaps[name] = 100 * min(abs(value - reading) for reading in readings) / height
    top = row["measured"]["seat_top_y"] - row["bbox"]["min"][1]
    tops = row.get("alternatives", {}).get("measured", {}).get("seat_top_y", [])
    tops = tops if isinstance(tops, list) else [tops]
    readings = [top, *(other_top - row["bbox"]["min"][1] for other_top in tops)]
    found = values["leg_height"] + values["seat_thickness"]
    gaps["seat_top_height"] = 100 * min(abs(found - reading) for reading in readings) / height
    return gaps


def print_truth(errors: dict[str, dict[str, np.ndarray]]) -> None:
    """Median / 75th / 90th percentile a parameter, as Markdown."""
    print("| parameter | " + " | ".join(errors) + " |")
    print("|---|" + "---|" * len(errors))
    for name in next(iter(errors.values())):
        cells = (np.percentile(table[name], [50, 75, 90]) for table in errors.values())
        print(f"| {name} | " + " | ".join(" / ".join(f"{v:.1f}" for v in c) for c in cells) + " |")


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m model_export.evaluate", description=__doc__)
    parser.add_argument("name", help="of the category")
    parser.add_argument("--models", type=Path, help="models folder (default: the shipped one)")
    parser.add_argument("--realistic", type=Path, help="folder of real meshes")
    parser.add_argument("--truth", type=Path, help="hand measurements of some of them")
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
            print_truth(truth_errors(model, arguments.realistic, arguments.truth))


if __name__ == "__main__":
    main()
