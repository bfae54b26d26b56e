"""Small meshes in every format, and a deformation with a known derivative."""

from __future__ import annotations

import os
import struct

import numpy as np
import trimesh
from gltf_assets import Asset
from hypothesis import settings
from numpy.typing import NDArray

Array = NDArray[np.float64]


def examples(count: int) -> settings:
    """Of a property: so many, and a hundred times as many with HYPOTHESIS_PROFILE=long."""
    factor = 100 if os.environ.get("HYPOTHESIS_PROFILE") == "long" else 1
    return settings(max_examples=factor * count, deadline=None, database=None)


def ball() -> tuple[Array, NDArray[np.int64], Array]:
    """Vertices ``[42, 3]`` (float32 numbers), faces ``[80, 3]`` and normals ``[42, 3]``."""
    sphere = trimesh.creation.icosphere(subdivisions=1)
    normals = np.asarray(sphere.vertices, np.float32)
    vertices = normals * np.float32([0.5, 1.25, 0.75]) + np.float32([0.25, 1.0, -0.5])
    return vertices.astype(np.float64), np.asarray(sphere.faces), normals.astype(np.float64)


def still(count: int) -> Array:
    """``[count, 3, 3]`` identities."""
    return np.tile(np.eye(3), (count, 1, 1))


def bend(points: Array) -> tuple[Array, Array]:
    """A smooth map of ``[N, 3]`` points, and its derivative ``[N, 3, 3]`` at each."""
    x, y, z = points.T
    mapped = np.stack([x + 0.2 * y * y, 1.3 * y + 0.1 * x * z, z + 0.3 * x], axis=1)
    derivative = still(len(points))
    derivative[:, 0, 1] = 0.4 * y
    derivative[:, 1, 0], derivative[:, 1, 1], derivative[:, 1, 2] = 0.1 * z, 1.3, 0.1 * x
    derivative[:, 2, 0] = 0.3
    return mapped, derivative


def bend_some(points: Array) -> tuple[Array, Array, NDArray[np.bool_]]:
    """`bend` for the vertices right of the middle; and which these are."""
    chosen = points[:, 0] > np.median(points[:, 0])
    mapped, derivative = bend(points)
    mapped[~chosen] = points[~chosen]
    derivative[~chosen] = np.eye(3)
    return mapped, derivative, chosen


def glb() -> bytes:
    """The ball, with normals, as one mesh in a GLB."""
    return asset().glb()


def gltf() -> bytes:
    """The ball, with normals, as one mesh in a glTF with an embedded buffer."""
    return asset().gltf()


def asset() -> Asset:
    """The ball, with normals, as one mesh."""
    vertices, faces, normals = ball()
    asset = Asset()
    attributes = {
        "POSITION": asset.accessor(vertices.astype("<f4")),
        "NORMAL": asset.accessor(normals.astype("<f4")),
    }
    indices = asset.accessor(faces.reshape(-1).astype("<u2"))
    asset.node(mesh=asset.mesh({"attributes": attributes, "indices": indices}))
    return asset


def obj() -> bytes:
    """The ball with normals, comments, groups, colours and a quad."""
    vertices, faces, normals = ball()
    lines = ["# a ball", "mtllib ball.mtl", "o ball"]
    lines += ["v {:.9g} {:.9g} {:.9g} 0.5 0.25 1".format(*row) for row in vertices]
    lines += ["vt 0.5 0.5"]
    lines += ["vn {:.9g} {:.9g} {:.9g}".format(*row) for row in normals]
    lines += ["usemtl wood", "s 1", "f 1/1/1 2/1/2 3/1/3 4/1/4"]
    lines += ["f " + " ".join(f"{i}/1/{i}" for i in row) for row in faces + 1]
    return "\n".join([*lines, "# end", ""]).encode()


def ply(order: str = "<", coordinate: str = "float") -> bytes:
    """The ball with normals and colours; `order` as numpy writes it, empty for ASCII."""
    vertices, faces, normals = ball()
    names = {"": "ascii", "<": "binary_little_endian", ">": "binary_big_endian"}
    header = f"ply\nformat {names[order]} 1.0\ncomment a ball\nelement vertex {len(vertices)}\n"
    for name in ("x", "y", "z", "nx", "ny", "nz"):
        header += f"property {coordinate} {name}\n"
    header += "property uchar red\nproperty int label\n"
    header += f"element face {len(faces)}\nproperty list uchar int vertex_indices\n"
    header += "element note 2\nproperty short a\nend_header\n"
    rows = np.concatenate([vertices, normals], axis=1)
    if not order:
        body = "".join(
            " ".join(f"{value:.9g}" for value in row) + f" {i % 256} -7\n"
            for i, row in enumerate(rows)
        )
        body += "".join("3 {} {} {}\n".format(*row) for row in faces) + "11\n22\n"
        return (header + body).encode()
    kind = "f" if coordinate == "float" else "d"
    packed = b"".join(
        struct.pack(order + 6 * kind + "Bi", *row, i % 256, -7) for i, row in enumerate(rows)
    )
    packed += b"".join(struct.pack(order + "B3i", 3, *row) for row in faces)
    return header.encode() + packed + struct.pack(order + "2h", 11, 22)


def stl(text: bool = False) -> bytes:
    """The ball as facets with an attribute, or as text."""
    vertices, faces, _ = ball()
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    if text:
        facets = "".join(
            "  facet normal {:.6e} {:.6e} {:.6e}\n    outer loop\n".format(*normal)
            + "".join("      vertex {:.9g} {:.9g} {:.9g}\n".format(*corner) for corner in corners)
            + "    endloop\n  endfacet\n"
            for normal, corners in zip(mesh.face_normals, vertices[faces], strict=True)
        )
        return f"solid ball\n{facets}endsolid ball\n".encode()
    packed = b"".join(
        struct.pack("<12fH", *normal, *corners.reshape(-1), i)
        for i, (normal, corners) in enumerate(zip(mesh.face_normals, vertices[faces], strict=True))
    )
    return b"solid as many writers say".ljust(80) + struct.pack("<I", len(faces)) + packed


def off(keyword: str = "OFF") -> bytes:
    """The ball, with normals if `keyword` is NOFF and colours if COFF."""
    vertices, faces, normals = ball()
    rows = np.concatenate([vertices, normals], axis=1) if keyword == "NOFF" else vertices
    colour = " 255 128 0 255" if keyword == "COFF" else ""
    body = "".join(" ".join(f"{v:.9g}" for v in row) + colour + "\n" for row in rows)
    body += "".join("3 {} {} {}  0.5 0.5 0.5\n".format(*row) for row in faces)
    return f"{keyword}\n# a ball\n\n{len(vertices)} {len(faces)} 0\n{body}".encode()


SAMPLES = {
    "glb": glb(),
    "gltf": gltf(),
    "obj": obj(),
    "ply": ply(),
    "ply-big": ply(">", "double"),
    "ply-ascii": ply(""),
    "stl": stl(),
    "stl-ascii": stl(text=True),
    "off": off(),
    "off-normals": off("NOFF"),
    "off-colours": off("COFF"),
}
