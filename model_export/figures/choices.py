"""Which meshes are drawn: of a folder that has the docs' own those, of any other the first ones."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from model_export.realistic import find_shapes

CHAIRS: Mapping[str, str] = {
    "sh3d-bsby-kitchenchair": "originals/sh3d-bsby-kitchenchair/kitchenChair.obj",
    "skfb-armchair-5a7320": "",
    "basemesh-wooden-lab-stool": "",
    "sh3d-bs0-silla2": "",
    "skfb-office-chair-9f9534": "",
    "basemesh-lounge-chair-01": "",
}
"""A ladderback, an upholstered armchair, a stool, a bar stool and an office chair on a column, and
a wooden armchair: by name, the file to take if not the manifest's."""

AIRPLANES: Mapping[str, str] = {
    "hks-plane-a350": "originals/hks-plane-a350.glb",
    "jsfs-airplane-crj-900-cityjet": "",
    "jsfs-shenyang-j31-gyrfalcon": "",
    "hks-plane-prop": "",
    "jsfs-underpoly-free-sailplane-glider": "",
    "quat-smallplane": "",
}
"""An airliner, a T-tail, a fighter with two fins, a high wing, a glider and a low wing with a
propeller.  The last two were trained on, without labels: no held-out one may be shown."""

BODY = {"valid_MENA_M_1_stand_weight_left": ""}
LONG_HAIR = {"mh_06_hands_on_hips": ""}
HANDS_TOGETHER = {"valid_X_MENA_F_1_arms_folded": ""}
OVERVIEW_CHAIR = {"quaternius-dungeon-chair": ""}
OVERVIEW_AIRPLANE = {"jsfs-airplane-crj-900-cityjet": ""}
OVERVIEW_BODY = {"valid_White_F_1_point": ""}


class NoMeshes(Exception):
    """A folder that is not there, or has not what is to be drawn."""


def chosen(folder: Path, wanted: Mapping[str, str]) -> dict[str, Path]:
    """Files to draw, by name.

    Args:
        folder: see `find_shapes`.
        wanted: names, each with a file of the folder to take instead of the manifest's, if any.

    Returns:
        The wanted ones where the folder has any; else as many of its own, held-out ones first.

    Raises:
        NoMeshes: without the folder, without a mesh in it, or when some of the wanted are missing.
    """
    if not folder.is_dir():
        raise NoMeshes(f"there is no folder {folder}")
    shapes = find_shapes(folder)
    if not shapes:
        raise NoMeshes(f"there is no mesh in {folder}")
    there = {shape.name: shape.path for shape in shapes}
    missing = [name for name in wanted if name not in there]
    if len(missing) == len(wanted):
        own = sorted(shapes, key=lambda shape: not shape.held_out)[: len(wanted)]
        return {shape.name: shape.path for shape in own}
    if missing:
        raise NoMeshes(f"{folder} lacks {', '.join(missing)}")
    paths = {name: folder / file if file else there[name] for name, file in wanted.items()}
    if lost := [str(path) for path in paths.values() if not path.is_file()]:
        raise NoMeshes(f"there is no file {', '.join(lost)}")
    return paths
