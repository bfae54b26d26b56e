"""A GLB with other weights of its morph targets, and what its JSON says."""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping
from typing import Any

from scipy.spatial.transform import Rotation


def json_of(data: bytes) -> dict[str, Any]:
    """The JSON of a GLB."""
    (length,) = struct.unpack_from("<I", data, 12)
    found: dict[str, Any] = json.loads(data[20 : 20 + length])
    return found


def with_json(data: bytes, root: dict[str, Any]) -> bytes:
    """The GLB with another JSON."""
    (length,) = struct.unpack_from("<I", data, 12)
    text = json.dumps(root).encode()
    text += b" " * (-len(text) % 4)
    body = struct.pack("<II", len(text), 0x4E4F534A) + text + data[20 + length :]
    return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


def weighted(data: bytes, values: Mapping[str, float]) -> bytes:
    """The GLB with its targets at the weights that give parameters some `values`.

    Of paired targets, the one that goes that way.
    """
    root = json_of(data)
    for mesh in root["meshes"]:
        targets = mesh.get("extras", {}).get("targets", [])
        for index, target in enumerate(targets):
            if target and target["parameter"] in values:
                weight = (values[target["parameter"]] - target["value"]) / target["change"]
                paired = target["name"] != target["parameter"]
                mesh["weights"][index] = max(weight, 0.0) if paired else weight
    return with_json(data, root)


def turned(data: bytes, values: Mapping[str, float]) -> bytes:
    """The GLB of a body with the joints' rotations that give angles some `values`."""
    root = json_of(data)
    for node in root["nodes"]:
        names = node.get("extras", {}).get("parameters", [])
        if any(name in values for name in names):
            vector = Rotation.from_quat(node["rotation"]).as_rotvec()
            vector = [values.get(name, old) for name, old in zip(names, vector, strict=True)]
            node["rotation"] = Rotation.from_rotvec(vector).as_quat().tolist()
    return with_json(data, root)
