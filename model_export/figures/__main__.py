"""Draw the paper's figures on real meshes.

``python -m model_export.figures --chairs DIR --airplanes DIR --humans DIR --out DIR``

Every picture is what the service answers: files are inferred and edited as uploads of which nothing
is said but, of shapes unlike their category, the category.  Progress and the service's warnings go
to the standard error.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

from model_export.config import SHIPPED
from model_export.figures.bodies import bodies
from model_export.figures.choices import NoMeshes
from model_export.figures.overview import overview
from model_export.figures.rigid import airplanes, chairs
from model_export.figures.studio import Studio
from model_export.figures.unlike import unlike
from service.encode.model import load_models
from service.errors import ShapeError

SHEETS: dict[str, Callable[[Studio], Path]] = {
    "overview": overview,
    "chairs": chairs,
    "airplanes": airplanes,
    "bodies": bodies,
    "unlike": unlike,
}
FOLDERS = ("chairs", "airplanes", "humans")


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(
        prog="python -m model_export.figures",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    for kind in FOLDERS:
        parser.add_argument(f"--{kind}", type=Path, help=f"folder of real {kind}")
    parser.add_argument("--models", type=Path, default=SHIPPED, help="models folder")
    parser.add_argument("--out", type=Path, required=True, help="folder for the pictures")
    parser.add_argument("--only", choices=SHEETS, help="draw this sheet alone")
    arguments = parser.parse_args()
    named = {kind: getattr(arguments, kind) for kind in FOLDERS}
    folders = {kind: folder for kind, folder in named.items() if folder is not None}
    arguments.out.mkdir(parents=True, exist_ok=True)
    studio = Studio(load_models(arguments.models), folders, arguments.out)
    for name in [arguments.only] if arguments.only else SHEETS:
        try:
            SHEETS[name](studio)
        except (NoMeshes, ShapeError, OSError) as error:
            parser.error(f"{name}: {error}")


if __name__ == "__main__":
    main()
