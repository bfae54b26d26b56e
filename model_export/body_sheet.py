"""Draw fits and edits of real bodies: ``python -m model_export.body_sheet --realistic DIR``."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from model_export.config import SHIPPED
from model_export.pictures import BLUE, GREY, YELLOW, Panel, save_sheet
from model_export.realistic import RealisticShape, find_shapes
from service.bodyinference import BodyInference
from service.edits import Change
from service.encode.model import Model, load_models
from service.mesh.formats import read_mesh
from service.pipeline import edit, infer
from service.requests import EditOptions, InferOptions, Upload

HUMAN = InferOptions(category="human")

EDITS: tuple[Mapping[str, float], ...] = (
    {"left_elbow_y": -1.0}, {"right_elbow_y": 1.0}, {"left_shoulder_z": 1.2},
    {"right_shoulder_z": -1.2}, {"left_shoulder_y": -1.0}, {"right_shoulder_y": 1.0},
    {"left_hip_x": -1.0}, {"right_hip_x": -1.0}, {"left_hip_x": -1.0, "left_knee_x": 1.2},
    {"left_hip_z": 0.5}, {"left_knee_x": 1.0}, {"right_knee_x": 1.0},
    {"neck_y": 0.6}, {"head_x": 0.5}, {"spine1_x": 0.4, "spine2_x": 0.3},
    {"spine1_y": 0.4, "spine2_y": 0.4}, {"spine2_z": 0.4}, {"left_wrist_z": 0.8},
    {"left_ankle_x": 0.5}, {"shape_0": 2.0}, {"shape_0": -1.5}, {"shape_1": 2.0},
    {"shape_2": 1.5}, {"stature": 0.15},
)  # fmt: skip
"""What is added to which parameters, an edit a picture: radians, coefficients, metres."""


def fit_panel(model: Model, shape: RealisticShape) -> Panel:
    """A real body with the fitted one drawn over it."""
    found = _infer(model, shape)
    template, body = found.model.template, found.fit.body
    return Panel(
        f"{shape.name[:30]}\n{found.fit.distance:.4f} (encoder {found.fit.encoder_distance:.4f})",
        [
            (found.vertices, found.mesh.faces, YELLOW, 1.0),
            (template.decode(body), template.faces, BLUE, 0.25),
        ],
    )


def edit_panels(model: Model, shape: RealisticShape, change: Mapping[str, float]) -> list[Panel]:
    """A real body, and an edit of it."""
    upload = _upload(shape)
    before = read_mesh(upload.data, upload.name)
    changes = {name: Change("add", amount) for name, amount in change.items()}
    edited = edit(upload, {model.name: model}, HUMAN, changes, EditOptions())
    after = read_mesh(edited.data, upload.name)
    title = ", ".join(f"{name} {amount:+g}" for name, amount in change.items())
    return [
        Panel(shape.name[:30], [(before.vertices, before.faces, YELLOW, 1.0)]),
        Panel(title, [(after.vertices, after.faces, GREY, 1.0)]),
    ]


def _upload(shape: RealisticShape) -> Upload:
    return Upload(shape.path.read_bytes(), shape.path.name)


def _infer(model: Model, shape: RealisticShape) -> BodyInference:
    found = infer(_upload(shape), {model.name: model}, HUMAN)
    assert isinstance(found, BodyInference)
    return found


def chosen(shapes: Sequence[RealisticShape], count: int) -> list[RealisticShape]:
    """So many shapes that were not trained on, each once before any comes twice."""
    held_out = [shape for shape in shapes if shape.held_out]
    order = np.random.default_rng(0).permutation(len(held_out))
    return [held_out[order[index % len(order)]] for index in range(count)]


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m model_export.body_sheet", description=__doc__)
    parser.add_argument("--models", type=Path, default=SHIPPED, help="models folder")
    parser.add_argument("--realistic", type=Path, required=True, help="folder of real bodies")
    parser.add_argument("--out", type=Path, default=Path("runs/bodies.png"), help="PNG to write")
    parser.add_argument("--fits", type=int, help="draw so many fits instead of edits")
    arguments = parser.parse_args()
    model = load_models(arguments.models)["human"]
    shapes = find_shapes(arguments.realistic)
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    if arguments.fits:
        panels = [fit_panel(model, shape) for shape in chosen(shapes, arguments.fits)]
        save_sheet(panels, arguments.out)
        return
    pairs = zip(chosen(shapes, len(EDITS)), EDITS, strict=True)
    panels = [panel for pair in pairs for panel in edit_panels(model, *pair)]
    save_sheet(panels, arguments.out, columns=8, aspect=0.8, same_scale=True)


if __name__ == "__main__":
    main()
