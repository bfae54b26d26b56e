"""Sound files to start from: small generated meshes, or those of a folder."""

from __future__ import annotations

import sys
import zipfile
from pathlib import Path

import numpy as np

# Where pytest finds what the tests of the readers share.
sys.path.append(str(Path(__file__).parents[1] / "mesh"))

from gltf_assets import Asset
from mesh_samples import SAMPLES, ball, ply
from zip_samples import gltf_members, obj_members, zipped

from service.mesh.convert import convert
from service.mesh.formats import READERS, ZIP
from service.template.loader import load_template

VERTICES, FACES, NORMALS = ball()
LARGEST = 400_000
"""Files of a folder that are larger, in bytes, are left out: small ones are as easily broken."""


def seeds(format: str) -> list[bytes]:
    """Small files of a format that use as many of its features as there are."""
    if format == ZIP:
        stored = zipped(gltf_members(), zipfile.ZIP_STORED)
        return [
            zipped(obj_members(), comment=b"by hand"),
            stored,
            zipped(gltf_members(), streamed=True),
        ]
    found = [data for name, data in SAMPLES.items() if name.partition("-")[0] == format]
    found.append(convert(VERTICES, FACES, format))
    if format in ("glb", "gltf"):
        assets = [posed(), interleaved(), quantised(), sparse(), skinned()]
        found += [getattr(asset, format)() for asset in assets]
    if format == "ply":
        found += [STRIPS, ply(">")]
    if format == "obj":
        found.append(RELATIVE)
    return found


def chair(format: str) -> bytes:
    """The chair template in the middle of its ranges: a file that the service answers."""
    if format == ZIP:
        return zipped({"chair.obj": chair("obj")})
    template = load_template("paper_chair")
    vertices = template.decode((template.low + template.high) / 2)
    return convert(vertices - [0.0, vertices[:, 1].min(), 0.0], template.faces, format)


def gathered(format: str, folder: Path | None) -> list[bytes]:
    """The files of a format in a folder and below; without one, the generated ones.

    Raises:
        FileNotFoundError: there are none.
    """
    if folder is None:
        return [chair(format), *seeds(format)]
    paths = sorted(path for path in folder.rglob("*") if path.suffix.lower() == "." + format)
    found = [path.read_bytes() for path in paths if path.stat().st_size <= LARGEST]
    if not found:
        raise FileNotFoundError(f"{folder} holds no {format} file of at most {LARGEST} bytes")
    return found


def formats() -> list[str]:
    """All formats that are read, and archives of them."""
    return [*READERS, ZIP]


def _primitive(asset: Asset, **more: int) -> dict[str, object]:
    attributes = {
        "POSITION": asset.accessor(VERTICES.astype("<f4")),
        "NORMAL": asset.accessor(NORMALS.astype("<f4")),
        **more,
    }
    return {
        "attributes": attributes,
        "indices": asset.accessor(FACES.reshape(-1).astype("<u2")),
        "material": 0,
        "targets": [{"POSITION": attributes["POSITION"]}],
    }


def posed() -> Asset:
    """Two nodes that show one mesh, under a turned and scaled parent; a material; extras."""
    asset = Asset()
    asset.root["materials"] = [{"name": "wood", "extras": {"a": [1, {"b": None}]}}]
    mesh = asset.mesh(_primitive(asset))
    child = asset.node(root=False, mesh=mesh, scale=[2, 1, -1], translation=[1, 0, 0])
    asset.node(rotation=[0, 0.6, 0, 0.8], children=[child])
    asset.node(mesh=mesh, matrix=np.diag([1.0, 2, 1, 1]).reshape(-1).tolist())
    return asset


def interleaved() -> Asset:
    """Positions, normals and texture coordinates in one view, as a strip of 8-bit indices."""
    asset = Asset()
    texture = VERTICES[:, :2].astype("<f4")
    arrays = (VERTICES.astype("<f4"), NORMALS.astype("<f4"), texture)
    names = ("POSITION", "NORMAL", "TEXCOORD_0")
    attributes = dict(zip(names, asset.interleaved(*arrays), strict=True))
    indices = asset.accessor(FACES.reshape(-1).astype("u1"))
    asset.node(mesh=asset.mesh({"attributes": attributes, "indices": indices, "mode": 5}))
    return asset


def quantised() -> Asset:
    """Normalised 16-bit positions under a scale that undoes it."""
    asset = Asset()
    size = float(np.abs(VERTICES).max())
    steps = np.zeros((len(VERTICES), 4), "<i2")
    steps[:, :3] = np.rint(VERTICES / size * 32767)
    view = asset.view(steps.tobytes(), byteStride=8)
    position = asset.accessor(np.ascontiguousarray(steps[:, :3]), view, normalized=True)
    indices = asset.accessor(FACES.reshape(-1).astype("<u4"))
    mesh = asset.mesh({"attributes": {"POSITION": position}, "indices": indices})
    asset.node(mesh=mesh, scale=[size] * 3)
    asset.root["extensionsRequired"] = ["KHR_mesh_quantization"]
    return asset


def sparse() -> Asset:
    """A few positions stored apart from the others, and no indices."""
    asset = Asset()
    corners = VERTICES[FACES].reshape(-1, 3).astype("<f4")
    rows = np.arange(0, len(corners), 7, dtype="<u2")
    position = asset.sparse(rows, corners[rows] * np.float32(1.5), corners)
    asset.node(mesh=asset.mesh({"attributes": {"POSITION": position}}))
    return asset


def skinned() -> Asset:
    """Two joints, with inverse bind matrices."""
    asset = Asset()
    count = len(VERTICES)
    joints = (np.arange(4 * count).reshape(count, 4) % 2).astype("u1")
    weights = np.full((count, 4), 0.25, "<f4")
    more = {"JOINTS_0": asset.accessor(joints), "WEIGHTS_0": asset.accessor(weights)}
    mesh = asset.mesh(_primitive(asset, **more))
    matrices = np.tile(np.eye(4, dtype="<f4").reshape(1, 16), (2, 1))
    asset.root["materials"] = [{}]
    joint = asset.node(root=False, translation=[0, 0.5, 0])
    parent = asset.node(children=[joint])
    binds = asset.accessor(matrices)
    asset.root["skins"] = [{"joints": [parent, joint], "inverseBindMatrices": binds}]
    asset.node(mesh=mesh, skin=0)
    return asset


STRIPS = b"""ply
format ascii 1.0
comment strips and a list that is none of ours
element vertex 5
property double x
property double y
property double z
property list uchar float spare
element tristrips 1
property list int int vertex_indices
end_header
0 0 0 1 0.5
1 0 0 0
0 1 0 2 1 2
1 1 0 0
0.5 2 1 0
6 0 1 2 3 -1 4
"""
RELATIVE = b"""# indices that count back, continued lines, mixed corners
v 0 0 0 1.0
v 1 0 0
v 1 1 0
v 0 1 \\
 0.5
vn 0 0 1
vt 0.5 0.5
f -4//1 -3//-1 -2//1
g back
f 1/1 3/1/1 4
f 1 2 3 4
"""
