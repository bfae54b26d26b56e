"""OBJ files with looks, and what belongs to them."""

from __future__ import annotations

import io

import numpy as np
from PIL import Image
from zip_samples import zipped

from service.mesh.embedding import as_glb
from service.mesh.formats import read_mesh
from service.mesh.glb import GlbFile
from service.mesh.polygons import Indices


def picture(kind: str = "PNG", shade: int = 255) -> bytes:
    """A checker of 8 by 8."""
    target = io.BytesIO()
    board = (np.indices((8, 8)).sum(axis=0) % 2 * shade).astype(np.uint8)
    Image.fromarray(board).save(target, kind)
    return target.getvalue()


# A square of two materials, whose faces share corners, and a triangle of none before them.
OBJ = b"""mtllib looks.mtl
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
v 0 0 1
v 9 9 9
vt 0 0
vt 1 0.25
vt 1 1
vn 0 0 1
vn 0 0.6 0.8
f 1 2 5
usemtl wood
f 1/1/1 2/2/1 3/3/1 4/1/1
usemtl red
f 1/1/2 3/3/2 5/2/2
usemtl wood
f 1/2/1 4/3/1 5/1/2
"""
MTL = b"""# by hand
newmtl wood
Kd 0 0 0
map_Kd checker.png
newmtl red
Kd 1 0.5 0.25
d 0.5
Ks 0.5 0.5 0.5
Ns 100
Ke 0.1 0 0
"""
MEMBERS = {"looks.obj": OBJ, "looks.mtl": MTL, "checker.png": picture()}


def shown(members: dict[str, bytes]) -> tuple[GlbFile, Indices]:
    """The GLB of an archive, and which vertex each of its is."""
    return as_glb(read_mesh(zipped(members), "looks.zip"), 1.0)
