"""Draw fits of real shapes.

``python -m model_export.contact_sheet chair --realistic DIR``
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from model_export.config import SHIPPED
from model_export.pictures import BLUE, YELLOW, Panel, save_sheet
from model_export.realistic import RealisticShape, find_shapes
from service.encode.model import Model, load_models
from service.inference import Inference
from service.pipeline import infer
from service.requests import InferOptions, Upload

UPRIGHT = InferOptions(up="+y", front="+z")


def fit_panel(model: Model, shape: RealisticShape) -> Panel:
    """A real shape with its fitted template drawn over it."""
    found = _infer(model, shape)
    fit = found.best.estimate
    template = fit.template
    fitted = template.decode(fit.parameters) + fit.translation
    return Panel(
        f"{shape.name[:30]}\n{fit.distance:.4f} (encoder {fit.encoder_distance:.4f})",
        [
            (found.vertices, found.mesh.faces, YELLOW, 1.0),
            (fitted, template.faces[~template.hidden], BLUE, 0.25),
        ],
    )


def _infer(model: Model, shape: RealisticShape) -> Inference:
    upload = Upload(shape.path.read_bytes(), shape.path.name)
    return infer(upload, {model.name: model}, UPRIGHT)


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m model_export.contact_sheet")
    parser.add_argument("name", help="of the category")
    parser.add_argument("--models", type=Path, help="models folder (default: the shipped one)")
    parser.add_argument("--realistic", type=Path, required=True, help="folder of real meshes")
    parser.add_argument("--out", type=Path, default=Path("runs/sheet.png"), help="PNG to write")
    parser.add_argument("--count", type=int, default=20, help="held-out shapes to draw")
    arguments = parser.parse_args()
    model = load_models(arguments.models or SHIPPED)[arguments.name]
    shapes = find_shapes(arguments.realistic)
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    held_out = [shape for shape in shapes if shape.held_out and shape.info.get("core", True)]
    order = np.random.default_rng(0).permutation(len(held_out))[: arguments.count]
    save_sheet([fit_panel(model, held_out[index]) for index in order], arguments.out)


if __name__ == "__main__":
    main()
