"""A picture of variants: ``python -m model_export.augment_sheet FILE ... --out sheet.png``."""

from __future__ import annotations

import argparse
from pathlib import Path

from model_export.pictures import GREY, YELLOW, Panel, save_sheet
from service.augment.options import AugmentOptions
from service.augment.variants import source
from service.encode.model import SHIPPED, load_models
from service.mesh.formats import read_mesh
from service.requests import EditOptions, InferOptions, Upload
from service.shipped import usual_categories


def panels(path: Path, count: int, seed: int) -> list[Panel]:
    """A mesh and variants of it, each in the canonical frame."""
    models = load_models(SHIPPED, names=usual_categories())
    upload = Upload(path.read_bytes(), path.name)
    with source(upload, models, InferOptions(), EditOptions()) as made:
        turn, mesh = made.found.best.orientation, made.found.mesh
        shown = [Panel("", [(turn.to_canonical(mesh.vertices), mesh.faces, YELLOW, 1.0)])]
        for variant in made.variants(AugmentOptions(count, seed)):
            if variant.edited is not None:
                vertices = read_mesh(variant.edited.data, variant.name).vertices
                shown.append(Panel("", [(turn.to_canonical(vertices), mesh.faces, GREY, 1.0)]))
        return shown


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(
        prog="python -m model_export.augment_sheet", description=__doc__
    )
    parser.add_argument("files", type=Path, nargs="+", help="meshes, a row each")
    parser.add_argument("--out", type=Path, required=True, help="the PNG")
    parser.add_argument("--count", type=int, default=7, help="variants of each")
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    shown = []
    for path in arguments.files:
        row = panels(path, 2 * arguments.count, arguments.seed)[: arguments.count + 1]
        shown += row + [Panel("", [])] * (arguments.count + 1 - len(row))
    save_sheet(shown, arguments.out, columns=arguments.count + 1, size=1.6)


if __name__ == "__main__":
    main()
