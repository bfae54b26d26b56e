"""Files that the service takes no mesh from, by the problem that tells why."""

from __future__ import annotations

import io
import json
import struct
import sys
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

sys.path.append(str(Path(__file__).parents[1] / "mesh"))

from gltf_assets import Asset
from mesh_samples import asset, obj
from zip_samples import zipped

MOST_VERTICES = 1000
"""Of a service that is to refuse what is larger."""


@dataclass(frozen=True)
class Unusable:
    """A file, and the status that it is refused with."""

    status: int
    name: str
    data: bytes


def with_root(**members: Any) -> bytes:
    """A GLB with members of its JSON changed."""
    changed = asset()
    changed.root |= members
    return changed.glb()


def with_primitive(**members: Any) -> bytes:
    """A GLB with members of its only primitive changed."""
    changed = asset()
    changed.root["meshes"][0]["primitives"][0] |= members
    return changed.glb()


def instanced() -> bytes:
    """A GLB that shows its mesh many times by one node."""
    changed = asset()
    changed.root["nodes"][0]["extensions"] = {"EXT_mesh_gpu_instancing": {}}
    return changed.glb()


def many_nodes() -> bytes:
    """A GLB of more nodes than any scene needs."""
    changed = asset()
    for _ in range(20_001):
        changed.node()
    return changed.glb()


def collapsed_skin() -> bytes:
    """A GLB whose only joint shrinks the mesh to a point."""
    changed = asset()
    count = changed.root["accessors"][0]["count"]
    attributes = changed.root["meshes"][0]["primitives"][0]["attributes"]
    attributes["JOINTS_0"] = changed.accessor(np.zeros((count, 4), "u1"))
    attributes["WEIGHTS_0"] = changed.accessor(np.tile(np.float32([1, 0, 0, 0]), (count, 1)))
    joint = changed.node(scale=[0, 0, 0])
    changed.root["skins"] = [{"joints": [joint]}]
    changed.root["nodes"][0]["skin"] = 0
    return changed.glb()


def animated() -> Asset:
    """The ball, whose morph targets an animation moves."""
    changed = asset()
    times = changed.accessor(np.float32([0, 1]))
    channel = {"sampler": 0, "target": {"node": 0, "path": "weights"}}
    sampler = {"input": times, "output": times}
    changed.root["animations"] = [{"samplers": [sampler], "channels": [channel]}]
    return changed


def outside(uri: str) -> bytes:
    """A glTF whose buffer is somewhere else."""
    built = asset()
    buffers = [{"uri": uri, "byteLength": len(built.chunk)}]
    return json.dumps({**built.root, "buffers": buffers}).encode()


def shared_buffers() -> bytes:
    """A zipped glTF with two buffers in one file."""
    built = asset()
    entry = {"uri": "a.bin", "byteLength": len(built.chunk)}
    root = {**built.root, "buffers": [entry, entry]}
    root["bufferViews"][1]["buffer"] = 1
    return zipped({"a.gltf": json.dumps(root).encode(), "a.bin": bytes(built.chunk)})


def altered_zip(at: int, form: str, value: int) -> bytes:
    """A zipped OBJ with a number of its only record in the directory changed."""
    data = bytearray(zipped({"a.obj": obj()}))
    struct.pack_into(form, data, data.index(b"PK\1\2") + at, value)
    return bytes(data)


def packed_otherwise() -> bytes:
    """A zip whose mesh is compressed in a way that is not read."""
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w", zipfile.ZIP_BZIP2) as archive:
        archive.writestr("a.obj", obj())
    return target.getvalue()


TRIANGLE = b"v 0 0 0\nv 1 0 0\nv 0 1 0\n"
LARGE_OFF = b"OFF\n3 1 0\n" + b"0 0 0\n" * 3 + b"3 0 1 2\n"

UNUSABLE: dict[str, Unusable] = {
    "archive_too_large": Unusable(413, "a.zip", altered_zip(24, "<L", 0x7FFFFFFF)),
    "archive_without_mesh": Unusable(415, "a.zip", zipped({"notes.txt": b"no mesh"})),
    "compressed_geometry": Unusable(
        415, "a.glb", with_root(extensionsRequired=["KHR_draco_mesh_compression"])
    ),
    "degenerate_mesh": Unusable(422, "a.obj", b"v 0 0 0\n" * 3 + b"f 1 2 3\n"),
    "empty_mesh": Unusable(422, "a.obj", TRIANGLE),
    "encrypted_member": Unusable(415, "a.zip", altered_zip(8, "<H", 1)),
    "external_buffers": Unusable(415, "a.gltf", outside("../scene.bin")),
    "face_out_of_range": Unusable(422, "a.obj", TRIANGLE + b"f 1 2 4\n"),
    "free_form": Unusable(415, "a.obj", TRIANGLE + b"surf 0 1 0 1 1 2 3\nf 1 2 3\n"),
    "gltf_version": Unusable(415, "a.gltf", b'{"asset": {"version": "1.0"}}'),
    "gpu_instancing": Unusable(415, "a.glb", instanced()),
    "malformed_glb": Unusable(422, "a.glb", asset().glb()[:-40]),
    "malformed_gltf": Unusable(422, "a.gltf", b'{"asset": '),
    "malformed_obj": Unusable(422, "a.obj", TRIANGLE + b"v 1\nf 1 2 3\n"),
    "malformed_off": Unusable(422, "a.off", b"OFF\n3 1 0\n0 0 0\n"),
    "malformed_ply": Unusable(422, "a.ply", b"ply\nformat ascii 1.0\n"),
    "malformed_stl": Unusable(422, "a.stl", b"solid a\nfacet\nvertex 0 0\n"),
    "malformed_zip": Unusable(422, "a.zip", zipped({"a.obj": obj()})[:-10]),
    "missing_buffer": Unusable(422, "a.zip", zipped({"a.gltf": outside("scene.bin")})),
    "nested_archive": Unusable(415, "a.zip", zipped({"inner.zip": b"PK"})),
    "non_finite_vertices": Unusable(422, "a.obj", TRIANGLE + b"v nan 0 0\nf 1 2 3\n"),
    "off_variant": Unusable(415, "a.off", b"4OFF\n3 1 0\n"),
    "required_extension": Unusable(415, "a.glb", with_root(extensionsRequired=["ACME_space"])),
    "several_meshes": Unusable(415, "a.zip", zipped({"a.obj": b"", "b.stl": b""})),
    "shared_buffer_file": Unusable(415, "a.zip", shared_buffers()),
    "skinned_mesh": Unusable(415, "a.glb", collapsed_skin()),
    "too_many_faces": Unusable(413, "a.obj", TRIANGLE + b"f 1 2 3\n" * (2 * MOST_VERTICES + 1)),
    "too_many_json_values": Unusable(413, "a.gltf", b"[" + b"1," * 1_000_001 + b"1]"),
    "too_many_lines": Unusable(413, "a.obj", b"\n" * 16_000_001),
    "too_many_parts": Unusable(413, "a.glb", many_nodes()),
    "too_many_vertices": Unusable(413, "a.obj", b"v 0 0 0\n" * (MOST_VERTICES + 1) + b"f 1 2 3\n"),
    "unsupported_format": Unusable(415, "a.fbx", b"Kaydara FBX Binary"),
    "zip64_archive": Unusable(415, "a.zip", altered_zip(24, "<L", 0xFFFFFFFF)),
    "zip_compression": Unusable(415, "a.zip", packed_otherwise()),
}
"""By the code of the problem."""


def integers() -> bytes:
    """A box as a PLY whose coordinates are integers."""
    box = trimesh.creation.box((50, 100, 20))
    head = (
        "ply\nformat ascii 1.0\nelement vertex 8\nproperty int x\nproperty int y\nproperty int z\n"
        "element face 12\nproperty list uchar int vertex_indices\nend_header\n"
    )
    rows = [*box.vertices.astype(int), *([3, *face] for face in box.faces)]
    return (head + "".join(" ".join(map(str, row)) + "\n" for row in rows)).encode()
