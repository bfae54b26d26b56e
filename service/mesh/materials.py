"""Materials of an .mtl as glTF has them, with their pictures."""

from __future__ import annotations

from typing import Any

from service.mesh.additions import Additions
from service.mesh.document import Object
from service.mesh.folder import Folder
from service.mesh.looks import Material, Statements
from service.mesh.mtl import Picture, colour, number, picture

TRANSFORM = "KHR_texture_transform"
# What glTF embeds, by how files of the kind begin.
KINDS = {b"\x89PNG\r\n\x1a\n": "image/png", b"\xff\xd8\xff": "image/jpeg"}
LARGEST = 64 << 20
"""Pictures of more bytes are left out."""
LONGEST = 200
"""Characters of a name that are kept."""
OPAQUE = 1.0 - 1e-6


class Materials:
    """Adds materials to an asset, and each picture once.

    Attributes:
        extensions: those that were used.
    """

    def __init__(self, additions: Additions, folder: Folder | None) -> None:
        """`folder` is where the pictures are, if there are any."""
        self.extensions: set[str] = set()
        self._additions = additions
        self._folder = folder
        self._pictures: dict[str, int | None] = {}

    def add(self, material: Material, textured: bool, blended: bool) -> int:
        """Add a material; returns its number.

        Args:
            material: its name, and what the .mtl says.
            textured: what it is on has texture coordinates.
            blended: what it is on has colours with an alpha.
        """
        name, said = material
        maps = {}
        if textured:
            named = {
                "baseColorTexture": picture(said, "map_kd"),
                "emissiveTexture": picture(said, "map_ke"),
                # A bump map has heights, whatever some exporters put there; this one has normals.
                "normalTexture": picture(said, "norm"),
            }
            maps = {key: self._texture(found) for key, found in named.items() if found}
        maps = {key: found for key, found in maps.items() if found is not None}
        alpha = _alpha(said)
        # What is behind a picture is often black: it stands for the colour, as Blender reads it.
        tint = [1.0] * 3 if "baseColorTexture" in maps else colour(said, "kd") or [1.0] * 3
        surface: Object = {
            "baseColorFactor": [*tint, alpha],
            "metallicFactor": _share(number(said, "pm") or 0.0),
            "roughnessFactor": roughness(said),
        }
        entry: Object = {"name": name[:LONGEST], "pbrMetallicRoughness": surface}
        if "baseColorTexture" in maps:
            surface["baseColorTexture"] = maps.pop("baseColorTexture")
            cut, whole = picture(said, "map_d"), picture(said, "map_kd")
            blended |= cut is not None and whole is not None and cut.path == whole.path
        glow = colour(said, "ke") or [0.0] * 3
        if "emissiveTexture" in maps and not any(glow):
            glow = [1.0] * 3
        if any(glow):
            entry["emissiveFactor"] = glow
        if alpha < OPAQUE or blended:
            entry["alphaMode"] = "BLEND"
        return self._additions.once("materials", {**entry, **maps, "doubleSided": True})

    def _texture(self, named: Picture) -> Object | None:
        """A texture's JSON; None where the picture isn't there, or of a kind that glTF lacks."""
        image = self._image(named.path)
        if image is None:
            return None
        found: Object = {"index": self._additions.once("textures", {"source": image})}
        if named.offset != (0.0, 0.0) or named.scale != (1.0, 1.0):
            self.extensions.add(TRANSFORM)
            (left, bottom), (wide, high) = named.offset, named.scale
            # The .mtl counts v from below.
            moved = {"offset": [left, 1.0 - high - bottom], "scale": [wide, high]}
            found["extensions"] = {TRANSFORM: moved}
        return found

    def _image(self, path: str) -> int | None:
        name = self._folder.find(path) if self._folder else None
        if name is None or self._folder is None:
            return None
        if name not in self._pictures:
            content = self._folder.content(name, LARGEST)
            self._pictures[name] = None if content is None else self._embedded(name, content)
        return self._pictures[name]

    def _embedded(self, name: str, content: bytes) -> int | None:
        kind = next((k for mark, k in KINDS.items() if content.startswith(mark)), None)
        if kind is None:
            return None
        title = name.rpartition("/")[2][:LONGEST]
        view = self._additions.view(content)
        return self._additions.add("images", {"name": title, "mimeType": kind, "bufferView": view})


def roughness(said: Statements) -> float:
    """glTF's roughness: as it is told, or that of Blinn's and Phong's exponent, if it shines."""
    told, exponent = number(said, "pr"), number(said, "ns")
    if told is not None:
        return _share(told)
    shine: list[Any] | None = colour(said, "ks")
    if exponent is None or not any(shine or [1.0]):
        return 1.0
    return float((2.0 / (max(exponent, 0.0) + 2.0)) ** 0.25)


def _alpha(said: Statements) -> float:
    """Opacity; some exporters mean by none of it all of it, and nobody a thing that isn't seen."""
    told, missing = number(said, "d"), number(said, "tr")
    if told is None and "d" in said and said["d"].startswith("-halo"):
        told = number({"d": said["d"].removeprefix("-halo")}, "d")
    if told is None:
        told = 1.0 if missing is None else 1.0 - missing
    return _share(told) or 1.0


def _share(value: float) -> float:
    return min(max(value, 0.0), 1.0)
