"""A glTF document: JSON from an unknown source, read with every type and index checked."""

from __future__ import annotations

import json
import sys
from typing import Any

from service.mesh import limits
from service.mesh.faults import malformed, quoted, unsupported

Object = dict[str, Any]

# Objects and arrays within each other; glTF by itself needs eight.
DEEPEST = 100

# Extensions whose absence would change how the mesh looks, not where it is.
HARMLESS = ("KHR_materials_", "KHR_texture_", "EXT_texture_", "MSFT_texture_", "KHR_lights_",
            "EXT_lights_", "KHR_xmp", "KHR_animation_", "KHR_mesh_quantization",
            "KHR_node_visibility")  # fmt: skip
COMPRESSED = {
    "KHR_draco_mesh_compression": "Draco compression",
    "EXT_meshopt_compression": "meshopt compression",
    "KHR_meshopt_compression": "meshopt compression",
}


class Document:
    """The parsed JSON of a glTF asset, and its text.

    Attributes:
        format: ``"glb"`` or ``"gltf"``, for messages.
        text: the JSON text as it came.
        root: what it parses to.
    """

    def __init__(self, format: str, encoded: bytes) -> None:
        """Parse UTF-8 `encoded`; InvalidMesh or UnsupportedFormat when that can't be."""
        self.format = format
        limits.check_json(encoded)
        try:
            self.text = encoded.decode()
            self.root: Object = json.loads(
                self.text.removeprefix("\ufeff"), object_pairs_hook=_unique
            )
        except (ValueError, RecursionError) as error:
            raise malformed(format, f"its JSON does not parse: {quoted(str(error), 80)}") from None
        if not isinstance(self.root, dict):
            raise malformed(format, "its JSON is no object")
        self._check_depth()
        version = str(self.object(self.root, "asset").get("version", "2.0"))
        if not version.startswith("2."):
            raise unsupported(
                "gltf_version", f"The file is glTF {quoted(version)}", "Export as glTF 2.0"
            )
        self._check_extensions()

    def _check_depth(self) -> None:
        """InvalidMesh for nesting that no exporter makes, and what walks the JSON can't follow."""
        level: list[Any] = [self.root]
        for _ in range(DEEPEST):
            inner = (item.values() if isinstance(item, dict) else item for item in level)
            level = [v for values in inner for v in values if isinstance(v, dict | list)]
            if not level:
                return
        raise self.wrong(f"its JSON is nested more than {DEEPEST} deep")

    def _check_extensions(self) -> None:
        for name in self.array(self.root, "extensionsRequired"):
            if str(name) in COMPRESSED:
                raise compressed(name)
            if not str(name).startswith(HARMLESS):
                raise unsupported(
                    "required_extension",
                    f"The file requires the glTF extension {quoted(name)}, which may place or "
                    "store its geometry in a way unknown here",
                    "Export it without this extension",
                )

    def wrong(self, detail: str) -> Exception:
        """The error for a document that breaks its own rules."""
        return malformed(self.format, detail)

    def object(self, parent: Object, key: str) -> Object:
        """Member `key` of `parent`, an object; empty when it isn't there."""
        value = parent.get(key, {})
        if not isinstance(value, dict):
            raise self.wrong(f"its member {key!r} is {quoted(value)}, not an object")
        return value

    def array(self, parent: Object, key: str) -> list[Any]:
        """Member `key` of `parent`, an array; empty when it isn't there."""
        value = parent.get(key, [])
        if not isinstance(value, list):
            raise self.wrong(f"its member {key!r} is {quoted(value)}, not an array")
        return value

    def natural(self, parent: Object, key: str, default: int | None = None) -> int:
        """Member `key` of `parent`, a whole number of at least 0; `default` when it isn't there."""
        value = parent.get(key, default)
        if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value < 1 << 53:
            raise self.wrong(f"its member {key!r} is {quoted(value)}, not a natural number")
        return value

    def numbers(self, parent: Object, key: str, default: list[float]) -> list[float]:
        """Member `key` of `parent`, an array of as many numbers as `default` has."""
        value = parent.get(key, default)
        if (
            not isinstance(value, list)
            or len(value) != len(default)
            or not all(
                isinstance(item, int | float) and not abs(item) > sys.float_info.max
                for item in value
            )
        ):
            raise self.wrong(f"its member {key!r} is {quoted(value)}, not {len(default)} numbers")
        return [float(item) for item in value]

    def entry(self, kind: str, index: Any) -> Object:
        """Object number `index` of the top-level array `kind`, e.g. ``"accessors"``."""
        entries = self.array(self.root, kind)
        if not isinstance(index, int) or isinstance(index, bool) or not 0 <= index < len(entries):
            raise self.wrong(f"it refers to {kind}[{quoted(index)}], of {len(entries)}")
        if not isinstance(entries[index], dict):
            raise self.wrong(f"{kind}[{index}] is {quoted(entries[index])}, not an object")
        found: Object = entries[index]
        return found


def _unique(members: list[tuple[str, Any]]) -> Object:
    """A JSON object; of two members of one name it would be open which one counts."""
    found = dict(members)
    if len(found) != len(members):
        raise ValueError("a name stands twice in one object")
    return found


def compressed(name: str) -> Exception:
    """The error for geometry behind a compression extension."""
    return unsupported(
        "compressed_geometry",
        f"The geometry is stored with {COMPRESSED[name]} ({name})",
        "Decode it with `gltf-transform copy in.glb out.glb`, or export it without mesh "
        "compression (in Blender's glTF export: Compression off)",
    )
