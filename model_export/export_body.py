"""Export a trained body encoder with its model card: ``python -m model_export.export_body``."""

from __future__ import annotations

import argparse
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import torch

from model_export.bodies import Garments
from model_export.bodynet import BodyEncoder
from model_export.bodytruth import (
    BodyError,
    body_errors,
    body_summary,
    character_bodies,
    synthetic_bodies,
)
from model_export.config import SHIPPED
from model_export.discriminate import Data, assess, build
from model_export.export import PAPER, check_onnx, describe_data, random_clouds
from model_export.onnxfile import write_network
from model_export.realistic import RealisticShape
from model_export.samples import clouds_of
from model_export.train_mesh import median_error, network_of
from model_export.train_mesh import write_onnx as write_mesh_onnx
from service.encode.basemodel import file_digest
from service.encode.bodymodel import BodyModel, golden_cloud
from service.encode.bodyoutputs import ANCHORS, spread_first
from service.encode.discriminator import DISCRIMINATOR_SUFFIX
from service.encode.meshencoder import MESH_SUFFIX
from service.encode.session import EncoderSession
from service.template.bodyfile import load_body
from service.template.skinned import SkinnedTemplate

PARTIAL = replace(Garments(), partial=0.0)
"""Test bodies in clothes, with noise and holes, seen from all sides."""


def load_encoder(state: dict[str, Any]) -> BodyEncoder:
    """The encoder of a checkpoint, in evaluation mode."""
    config = state["config"]
    encoder = BodyEncoder(config["width"], config["depth"], config["neighbours"])
    encoder.load_state_dict(state["encoder"])
    return encoder.eval()


def write_onnx(encoder: BodyEncoder, points: int, path: Path) -> None:
    """Write the encoder for one cloud of a fixed size: input ``points``, output ``outputs``."""
    example = 0.2 * torch.randn(1, points, 3, generator=torch.Generator().manual_seed(0))
    write_network(encoder, example, path, ("points", "outputs"))


def build_card(
    template: SkinnedTemplate, state: dict[str, Any], path: Path, version: str
) -> dict[str, Any]:
    """What the card says before anything is measured."""
    session = EncoderSession(path)
    golden = session.run(golden_cloud(session.points))
    run = {
        "steps": state["step"],
        "hours": round(state["seconds"] / 3600, 2),
        "place": state["place"],
        "config": state["config"],
    }
    return {
        "name": template.name,
        "kind": BodyModel.kind,
        "label": template.label,
        "version": version,
        "digest": file_digest(path),
        "template_digest": template.digest,
        "source": PAPER,
        "licence": "Apache-2.0; the body is CC0 (MakeHuman; weights by NAVER)",
        "input": {
            "points": session.points,
            "frame": "zero mean, farthest point at radius 0.6; the first "
            f"{ANCHORS} points are far from one another",
        },
        "training": {"hours": run["hours"], "runs": [run]},
        "golden": [round(float(value), 6) for value in golden],
    }


def export_mesh(folder: Path, template: SkinnedTemplate, path: Path) -> dict[str, Any]:
    """Write a run's mesh encoder beside the encoder's ``path``; the card's ``mesh_encoder``.

    Raises:
        ValueError: when it was trained with another body.
    """
    state = torch.load(folder / "checkpoint.pt", map_location="cpu")
    if state["template"] != template.digest:
        raise ValueError(f"the mesh encoder in {folder} was trained with another body")
    network = network_of(state, template)
    file = path.with_suffix(MESH_SUFFIX)
    write_mesh_onnx(network, len(template.rest), file)
    return {
        "digest": file_digest(file),
        "steps": state["step"],
        "batch": state["batch"],
        "hours": round(state["seconds"] / 3600, 2),
        "place": state["place"],
        "median_turn_error_degrees": round(median_error(network, template, 20), 1),
    }


def measure(model: BodyModel, shapes: list[RealisticShape], count: int) -> dict[str, Any]:
    """Errors on synthetic bodies, and on the characters that were not trained on, by source."""
    naked = replace(Garments.none(), tilt=0.5)
    table: dict[str, Any] = {
        "synthetic": body_summary(
            body_errors(model, synthetic_bodies(model.template, naked, count, model.points))
        ),
        "synthetic_clothed": body_summary(
            body_errors(model, synthetic_bodies(model.template, PARTIAL, count, model.points))
        ),
    }
    known = [shape for shape in shapes if shape.held_out and "joints_smpl24" in shape.info]
    if not known:
        return table
    bodies = character_bodies(known, model.points)
    errors = body_errors(model, bodies)
    turned = body_errors(model, bodies, np.random.default_rng(0))
    table["characters"] = by_source(errors)
    table["characters_turned_any_way"] = by_source(turned)
    return table


def by_source(errors: list[BodyError]) -> dict[str, Any]:
    """Summaries of all and of each source."""
    sources = sorted({error.known.source for error in errors})
    return {"all": body_summary(errors)} | {
        source: body_summary([e for e in errors if e.known.source == source]) for source in sources
    }


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m model_export.export_body", description=__doc__)
    parser.add_argument("--run", type=Path, default=Path("runs/human"), help="folder of the run")
    parser.add_argument(
        "--mesh-run", type=Path, default=Path("runs/human-mesh"),
        help="folder of the mesh encoder's run; none is exported where there is none",
    )  # fmt: skip
    parser.add_argument("--body", type=Path, help="body file (default: the shipped body)")
    parser.add_argument("--realistic", type=Path, help="real bodies, to measure on")
    parser.add_argument("--cache", type=Path, default=Path("cache"), help="for sampled clouds")
    parser.add_argument("--out", type=Path, default=SHIPPED, help="models folder")
    parser.add_argument("--version", default="1.0.0", help="of the model")
    parser.add_argument("--count", type=int, default=200, help="synthetic bodies to measure on")
    parser.add_argument("--steps", type=int, default=1500, help="of training the discriminator")
    parser.add_argument(
        "--others", type=Path, nargs="*", default=[],
        help="folders of meshes of other kinds, for the discriminator",
    )  # fmt: skip
    parser.add_argument("--but", help="regular expression: files there that are bodies")
    parser.add_argument(
        "--keep-discriminator", action="store_true",
        help="leave the one that the models folder has, and only measure it anew",
    )  # fmt: skip
    arguments = parser.parse_args()
    state = torch.load(arguments.run / "checkpoint.pt", map_location="cpu")
    template = load_body(arguments.body)
    encoder = load_encoder(state)
    points = state["config"]["points"]
    arguments.out.mkdir(parents=True, exist_ok=True)
    path = arguments.out / f"{template.name}.onnx"
    write_onnx(encoder, points, path)
    data = Data.of(arguments.realistic, arguments.others, arguments.but)
    shapes = list(data.shapes)
    clouds = random_clouds(points, 20) + clouds_of(shapes[:20], arguments.cache, points)
    gap = check_onnx(encoder, path, [cloud[spread_first(cloud, ANCHORS)] for cloud in clouds])
    print(f"onnxruntime and torch differ by {gap:.1e} over {len(clouds)} clouds")
    card = build_card(template, state, path, arguments.version)
    card["data"] = describe_data(shapes)
    if arguments.keep_discriminator:
        installed = json.loads(path.with_suffix(".json").read_text("utf-8"))
        card["discriminator"] = installed["discriminator"]
    else:
        second = path.with_suffix(DISCRIMINATOR_SUFFIX)
        card["discriminator"] = build(template, data, arguments.steps, second, arguments.cache)
    if (arguments.mesh_run / "checkpoint.pt").is_file():
        card["mesh_encoder"] = export_mesh(arguments.mesh_run, template, path)
    model = BodyModel(card, template, path, threads=1)
    assess(model, card, data, arguments.cache)
    card["metrics"] = measure(model, shapes, arguments.count)
    card_path = path.with_suffix(".json")
    card_path.write_text(json.dumps(card, indent=2) + "\n", "utf-8")
    model.verify()
    print(f"wrote {path} and {card_path}")


if __name__ == "__main__":
    main()
