"""What PLY and OFF files say of their vertices beside where they are."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from service.mesh.colours import BYTE, Colours, as_light
from service.mesh.folder import Folder
from service.mesh.looks import Looks, Material, flipped
from service.mesh.mtl import text_of
from service.mesh.off import OffFile
from service.mesh.ply import NORMAL, PlyFile

# As MeshLab, Blender, Open3D and PCL, and others, name the properties.
COLOURS = (("red", "green", "blue", "alpha"), ("diffuse_red", "diffuse_green", "diffuse_blue",
           "diffuse_alpha"), ("r", "g", "b", "a"))  # fmt: skip
COORDINATES = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"), ("texture_s", "texture_t"))
PICTURE = re.compile(rb"[\r\n]comment[ \t]+TextureFile[ \t]+([^\r\n]+)", re.IGNORECASE)


def ply_looks(file: PlyFile, folder: Folder | None) -> Looks | None:
    """The looks of a PLY; None where it has none."""
    known = file.rows.scalars
    normals = file.columns(NORMAL) if all(name in known for name in NORMAL) else None
    coordinates = None
    for names in COORDINATES:
        if all(name in known for name in names):
            coordinates = flipped(file.columns(names))
            break
    colours = None
    for *shades, alpha in COLOURS:
        if all(name in known for name in shades):
            colours = _ply_colours(file, [*shades, alpha] if alpha in known else shades)
            break
    material = None if coordinates is None or folder is None else _picture(file, folder)
    return Looks.whole(
        len(file.vertices), file.faces, material,
        normals=normals, coordinates=coordinates, colours=colours,
    )  # fmt: skip


def _ply_colours(file: PlyFile, names: Sequence[str]) -> Colours:
    """Colours whose whole is told by their type: the same for all, or what the red ones have."""
    vertex = [element for element in file.header.elements if element.name == "vertex"][-1]
    kind = next(item.value for item in vertex.properties if item.name == names[0])
    wholes = {"u1": BYTE, "u2": float(np.iinfo(np.uint16).max)}
    return as_light(file.columns(names), wholes.get(kind.str[-2:]))


def _picture(file: PlyFile, folder: Folder) -> Material | None:
    """A material of the picture that a comment names, as MeshLab does."""
    found = PICTURE.search(file.data[: file.header.body])
    if found is None:
        return None
    name = text_of(found[1]).strip()
    return None if folder.find(name) is None else (name, {"map_kd": name})


def off_looks(file: OffFile) -> Looks | None:
    """The looks of an OFF; None where it has none."""
    at = 6 if "N" in file.letters else 3
    normals = file.columns(3, 3) if at == 6 else None
    colours = coordinates = None
    if "C" in file.letters and file.width >= at + 3:
        # Some writers leave the alpha out.
        has = 4 if file.width >= at + 4 else 3
        colours = as_light(file.columns(at, has))
        at += has
    if "ST" in file.letters and file.width >= at + 2:
        coordinates = flipped(file.columns(at, 2))
    return Looks.whole(
        len(file.vertices), file.faces, normals=normals, coordinates=coordinates, colours=colours
    )
