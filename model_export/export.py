"""Export a trained encoder to ONNX with its model card: ``python -m model_export.export chair``."""

from __future__ import annotations

import argparse
import json
import shutil
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import nn

from model_export.calibrate import sigma_scales
from model_export.config import SHIPPED, from_plain
from model_export.discriminate import Data, assess, build
from model_export.distribution import add_distribution
from model_export.evaluate import real_fits, synthetic_table
from model_export.networks import Encoder, build_encoder, fold_batch_norm
from model_export.onnxfile import write_network
from model_export.realistic import RealisticShape, find_shapes
from model_export.refit import refit
from model_export.report import write_report
from model_export.samples import clouds_of
from model_export.templatecopy import template_copy
from model_export.truth import judge, read_truth, rescaled, summary
from service.encode.discriminator import DISCRIMINATOR_SUFFIX
from service.encode.model import AffineModel, file_digest, golden_cloud
from service.encode.session import EncoderSession
from service.template.affine import AffineTemplate
from service.template.loader import load_template, template_path

TOLERANCE = 1e-4
FULL = {"refit": 4000, "count": 1000, "steps": 1500}
QUICK = {"refit": 2000, "count": 200, "steps": 120}
"""How many synthetic shapes to refit to and to measure on, and steps of the discriminator."""
PAPER = "Wei et al., Learning to Infer Semantic Parameters for 3D Shape Editing, 3DV 2020"


def load_encoder(state: dict[str, Any]) -> Encoder:
    """The encoder of a checkpoint, in evaluation mode."""
    weights, config = state["encoder"], state["config"]
    shape = (config[name] for name in ("shared", "head", "keypoints"))
    encoder = build_encoder(weights["mean"], weights["spread"], *shape)
    encoder.load_state_dict(weights)
    return encoder.eval()


def write_onnx(encoder: Encoder, points: int, path: Path) -> None:
    """Write the encoder for one cloud of a fixed size: input ``points``, output ``outputs``."""
    example = torch.zeros(1, points, 3)
    write_network(fold_batch_norm(encoder), example, path, ("points", "outputs"))


def check_onnx(encoder: nn.Module, path: Path, clouds: list[np.ndarray]) -> float:
    """Largest difference between torch and onnxruntime over the clouds.

    Raises:
        ValueError: when it is not below 1e-4.
    """
    session = EncoderSession(path)
    gap = 0.0
    for cloud in clouds:
        with torch.no_grad():
            expected = encoder(torch.as_tensor(cloud, dtype=torch.float32)[None])[0].numpy()
        gap = max(gap, float(np.abs(session.run(cloud) - expected).max()))
    if not gap < TOLERANCE:
        raise ValueError(f"the exported network differs from the trained one by {gap:.2g}")
    return gap


def random_clouds(points: int, count: int, seed: int = 0) -> list[np.ndarray]:
    """Clouds of no shape at all, inside the sphere."""
    rng = np.random.default_rng(seed)
    return [rng.uniform(-0.35, 0.35, (points, 3)).astype(np.float32) for _ in range(count)]


def build_card(
    template: AffineTemplate, state: dict[str, Any], path: Path, version: str
) -> dict[str, Any]:
    """What the card says before anything is measured."""
    golden = EncoderSession(path).run(golden_cloud(template, template.points))
    return {
        "name": template.name,
        "label": template.label,
        "version": version,
        "digest": file_digest(path),
        "source": PAPER,
        "licence": "Apache-2.0",
        "input": {
            "points": template.points,
            "frame": "+Y up, +Z front; zero mean, farthest point at radius 0.6",
        },
        "parameters": [
            {
                "name": p.name, "label": p.label, "paper_name": p.paper, "unit": "m",
                "range": [p.low, p.high], "typical": list(p.typical),
                "nuisance": p.nuisance,
            }
            for p in template.parameters
        ],
        "training": {
            "hours": round(sum(run["seconds"] for run in [*state["earlier"], state]) / 3600, 2),
            "runs": [
                {
                    "steps": run["step"],
                    "hours": round(run["seconds"] / 3600, 2),
                    "place": run["place"],
                    "config": run["config"] | {"template": Path(run["config"]["template"]).name},
                }
                for run in [*state["earlier"], state]
            ],
        },
        "golden": [round(float(value), 6) for value in golden],
    }  # fmt: skip


def describe_data(shapes: list[RealisticShape]) -> dict[str, Any]:
    """What real shapes were used and under which licences."""
    licences = Counter(
        str(shape.info.get("licence") or shape.info.get("license") or "unknown") for shape in shapes
    )
    held_out = sum(shape.held_out for shape in shapes)
    return {
        "synthetic": "drawn from the ranges on the fly, labelled by construction",
        "realistic": {
            "train": len(shapes) - held_out,
            "test": held_out,
            "labels": "none",
            "licences": dict(licences.most_common()),
        },
    }


def template_source(folder: Path, template: str) -> str | Path:
    """What a run trained: its own copy of a template file, or the name of a built-in category."""
    if not template.endswith((".yaml", ".yml")):
        return template
    copy = template_copy(folder, template)
    return copy if copy.is_file() else Path(template)


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m model_export.export", description=__doc__)
    parser.add_argument("name", help="name of the run and of the category")
    parser.add_argument("--run", type=Path, help="its folder (default runs/<name>)")
    parser.add_argument("--realistic", type=Path, help="real meshes, to check and to measure on")
    parser.add_argument("--truth", type=Path, help="hand measurements, to calibrate sigma on")
    parser.add_argument("--ablation", type=Path, help="JSON of further runs' figures to record")
    parser.add_argument("--cache", type=Path, default=Path("cache"), help="for sampled clouds")
    parser.add_argument("--out", type=Path, default=SHIPPED, help="models folder")
    parser.add_argument("--version", default="1.0.0", help="of the model")
    parser.add_argument("--quick", action="store_true", help="minutes on a CPU, as for training")
    parser.add_argument("--refit", type=int, help="synthetic shapes to refit the last layer to")
    parser.add_argument("--count", type=int, help="synthetic shapes to measure on")
    parser.add_argument("--steps", type=int, help="of training the discriminator")
    parser.add_argument(
        "--others", type=Path, nargs="*", default=[],
        help="folders of meshes of other kinds, for the discriminator",
    )  # fmt: skip
    parser.add_argument("--but", help="regular expression: files there that are of the category")
    parser.add_argument(
        "--keep-discriminator", action="store_true",
        help="leave the one that the models folder has, and only measure it anew",
    )  # fmt: skip
    arguments = parser.parse_args()
    for name, size in (QUICK if arguments.quick else FULL).items():
        if getattr(arguments, name) is None:
            setattr(arguments, name, size)
    folder = arguments.run or Path("runs") / arguments.name
    state = torch.load(folder / "checkpoint.pt", map_location="cpu")
    source = template_source(folder, state["config"]["template"])
    template = load_template(source)
    encoder = load_encoder(state)
    if arguments.refit:
        refit(encoder, template, from_plain(state["config"]), arguments.refit)
    arguments.out.mkdir(parents=True, exist_ok=True)
    if isinstance(source, Path):
        shutil.copyfile(source, arguments.out / f"{template.name}.yaml")
    path = arguments.out / f"{template.name}.onnx"
    write_onnx(encoder, template.points, path)
    shapes = find_shapes(arguments.realistic) if arguments.realistic else []
    clouds = clouds_of(shapes[:20], arguments.cache, template.points)
    gap = check_onnx(encoder, path, random_clouds(template.points, 20) + clouds)
    print(f"onnxruntime and torch differ by {gap:.1e} over {20 + len(clouds)} clouds")
    card = build_card(template, state, path, arguments.version)
    card["template_digest"] = file_digest(template_path(source))
    card["training"]["refit_shapes"] = arguments.refit
    card["data"] = describe_data(shapes)
    data = Data(shapes, arguments.others, arguments.but)
    if arguments.keep_discriminator:
        installed = json.loads(path.with_suffix(".json").read_text("utf-8"))
        card["discriminator"] = installed["discriminator"]
    else:
        second = path.with_suffix(DISCRIMINATOR_SUFFIX)
        card["discriminator"] = build(template, data, arguments.steps, second, arguments.cache)
    model = AffineModel(card, template, path, threads=1)
    assess(model, card, data, arguments.cache)
    card["metrics"] = {"synthetic": synthetic_table(model, arguments.count)}
    if shapes:
        held_out = [shape for shape in shapes if shape.held_out]
        card["metrics"]["realistic"] = real_fits(model, held_out)
        add_distribution(card, model, shapes)
    if arguments.realistic and arguments.truth:
        judged = judge(model, arguments.realistic, read_truth(arguments.truth))
        scales = sigma_scales(judged)
        card["calibration"]["sigma_scale"] = scales
        card["metrics"]["truth"] = summary(rescaled(judged, scales))
    if arguments.ablation:
        card["metrics"]["ablation"] = json.loads(arguments.ablation.read_text("utf-8"))
    card_path = path.with_suffix(".json")
    card_path.write_text(json.dumps(card, indent=2) + "\n", "utf-8")
    model.verify()
    print(f"wrote {path} and {card_path}")
    print(f"wrote {write_report(folder, model, shapes)}")


if __name__ == "__main__":
    main()
