"""Builds glTF assets for tests, part by part, down to single bytes."""

from __future__ import annotations

import base64
import json
import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

COMPONENTS = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
KINDS = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}
JSON, BIN = 0x4E4F534A, 0x004E4942


class Asset:
    """A glTF asset under construction: its JSON in `root`, its only buffer in `chunk`."""

    def __init__(self) -> None:
        self.root: dict[str, Any] = {
            "asset": {"version": "2.0", "generator": "tests"},
            "scene": 0,
            "scenes": [{"nodes": []}],
            "nodes": [],
            "meshes": [],
            "accessors": [],
            "bufferViews": [],
            "buffers": [{"byteLength": 0}],
        }
        self.chunk = bytearray()

    def view(self, content: bytes, **members: Any) -> int:
        """Add a buffer view of new `content`."""
        self.chunk.extend(bytes(-len(self.chunk) % 4))
        members = {"byteOffset": len(self.chunk), "byteLength": len(content), **members}
        self.chunk.extend(content)
        self.root["buffers"][0]["byteLength"] = len(self.chunk)
        return self._add("bufferViews", {"buffer": 0, **members})

    def accessor(self, array: NDArray[Any], view: int | None = None, **members: Any) -> int:
        """Add an accessor of ``[N]`` or ``[N, C]`` values, in a view of their own if none."""
        table = array.reshape(len(array), -1)
        entry = {
            "bufferView": self.view(array.tobytes()) if view is None else view,
            "componentType": COMPONENTS[array.dtype.str[1:]],
            "count": len(table),
            "type": KINDS[table.shape[1]],
            **members,
        }
        if table.shape[1] == 3 and "min" not in entry:
            entry["min"], entry["max"] = table.min(axis=0).tolist(), table.max(axis=0).tolist()
        return self._add("accessors", entry)

    def interleaved(self, *arrays: NDArray[Any]) -> list[int]:
        """Add accessors of ``[N, C]`` float32 arrays that share one view, row by row."""
        table = np.concatenate(arrays, axis=1)
        view = self.view(table.tobytes(), byteStride=4 * table.shape[1])
        result, column = [], 0
        for array in arrays:
            result.append(self.accessor(array, view, byteOffset=4 * column))
            column += array.shape[1]
        return result

    def sparse(
        self, rows: NDArray[Any], values: NDArray[Any], base: NDArray[Any] | int, **members: Any
    ) -> int:
        """Add an accessor with some `values` stored apart, over a `base` or that many zeros."""
        entry: dict[str, Any] = {
            "componentType": COMPONENTS[values.dtype.str[1:]],
            "count": base if isinstance(base, int) else len(base),
            "type": KINDS[values.shape[1]],
            "sparse": {
                "count": len(rows),
                "indices": {
                    "bufferView": self.view(rows.tobytes()),
                    "componentType": COMPONENTS[rows.dtype.str[1:]],
                },
                "values": {"bufferView": self.view(values.tobytes())},
            },
            **members,
        }
        if not isinstance(base, int):
            entry["bufferView"] = self.view(base.tobytes())
        return self._add("accessors", entry)

    def mesh(self, *primitives: Any, **members: Any) -> int:
        """Add a mesh."""
        return self._add("meshes", {"primitives": list(primitives), **members})

    def node(self, root: bool = True, **members: Any) -> int:
        """Add a node, to the scene too if it is a `root`."""
        index = self._add("nodes", members)
        if root:
            self.root["scenes"][0]["nodes"].append(index)
        return index

    def _add(self, kind: str, entry: dict[str, Any]) -> int:
        self.root[kind].append(entry)
        return len(self.root[kind]) - 1

    def glb(self, **dump: Any) -> bytes:
        """The asset as GLB; `dump` as for `json.dumps`."""
        return pack(json.dumps(self.root, **dump).encode(), bytes(self.chunk))

    def gltf(self, **dump: Any) -> bytes:
        """The asset as glTF with an embedded buffer."""
        uri = "data:application/octet-stream;base64," + base64.b64encode(self.chunk).decode()
        buffers = [{"uri": uri, **self.root["buffers"][0]}]
        return json.dumps({**self.root, "buffers": buffers}, **dump).encode()


def pack(document: bytes, chunk: bytes | None, *others: tuple[int, bytes]) -> bytes:
    """A GLB of a JSON text, a binary chunk and other chunks."""
    document += b" " * (-len(document) % 4)
    chunks = [(JSON, document)]
    if chunk is not None:
        chunks.append((BIN, chunk + bytes(-len(chunk) % 4)))
    body = b"".join(struct.pack("<II", len(c), kind) + c for kind, c in [*chunks, *others])
    return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


def unpack(data: bytes) -> tuple[dict[str, Any], bytes, bytes]:
    """JSON, its text, and the binary chunk of a GLB."""
    length = struct.unpack_from("<I", data, 12)[0]
    text = data[20 : 20 + length]
    return json.loads(text), text, data[28 + length :]


def values(data: bytes, index: int) -> NDArray[Any]:
    """``[N, C]`` stored values of a tightly packed accessor of a GLB, read independently."""
    root, _, chunk = unpack(data)
    entry = root["accessors"][index]
    view = root["bufferViews"][entry["bufferView"]]
    kinds = {number: kind for kind, number in COMPONENTS.items()}
    widths = {kind: width for width, kind in KINDS.items()}
    dtype, width = np.dtype("<" + kinds[entry["componentType"]]), widths[entry["type"]]
    offset = view.get("byteOffset", 0) + entry.get("byteOffset", 0)
    stride = view.get("byteStride", dtype.itemsize * width)
    shape, strides = (entry["count"], width), (stride, dtype.itemsize)
    return np.ndarray(shape, dtype, chunk, offset, strides)
