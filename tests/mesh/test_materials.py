from __future__ import annotations

from typing import Any

import pytest
from gltf_assets import unpack
from looks_samples import MEMBERS, picture, shown
from zip_samples import zipped

from service.mesh import materials
from service.mesh.archive import Archive
from service.mesh.folder import Folder
from service.mesh.materials import roughness


def told(mtl: bytes, **members: bytes) -> tuple[dict[str, Any], list[bytes]]:
    """The material "wood" of an .mtl, and the pictures that are embedded."""
    files = {name.replace("_", "."): data for name, data in members.items()}
    result, _ = shown({**MEMBERS, **files, "looks.mtl": b"newmtl wood\n" + mtl})
    root, _, chunk = unpack(result.data)
    views = [root["bufferViews"][image["bufferView"]] for image in root.get("images", [])]
    pictures = [chunk[view["byteOffset"] :][: view["byteLength"]] for view in views]
    (material,) = root["materials"]
    return material, pictures


def surface(mtl: bytes) -> dict[str, Any]:
    found: dict[str, Any] = told(mtl)[0]["pbrMetallicRoughness"]
    return found


def test_a_material_of_nothing() -> None:
    assert told(b"")[0] == {
        "name": "wood",
        "pbrMetallicRoughness": {
            "baseColorFactor": [1.0, 1.0, 1.0, 1.0], "metallicFactor": 0.0, "roughnessFactor": 1.0,
        },
        "doubleSided": True,
    }  # fmt: skip


@pytest.mark.parametrize(
    ("mtl", "alpha"),
    [
        (b"d 0.25", 0.25), (b"Tr 0.75", 0.25), (b"d 1\nTr 1", 1.0), (b"d -halo 0.25", 0.25),
        (b"d 0", 1.0), (b"Tr 1", 1.0), (b"d 7", 1.0), (b"d", 1.0),
    ],
)  # fmt: skip
def test_opacity(mtl: bytes, alpha: float) -> None:
    material, _ = told(mtl)
    assert material["pbrMetallicRoughness"]["baseColorFactor"] == [1, 1, 1, alpha]
    assert material.get("alphaMode") == ("BLEND" if alpha < 1 else None)


def test_metal_and_roughness() -> None:
    assert surface(b"Pm 0.75\nPr 0.25\nNs 3")["metallicFactor"] == 0.75
    assert surface(b"Pm 7\nPr 0.25\nNs 3")["roughnessFactor"] == 0.25
    assert roughness({"ns": "0", "ks": "1 1 1"}) == 1.0
    assert roughness({"ns": "30"}) == pytest.approx(0.5)
    assert roughness({"ns": "30", "ks": "0 0 0"}) == 1.0
    assert roughness({"ns": "-30"}) == 1.0


def test_glow() -> None:
    assert told(b"Ke 0 0.5 2")[0]["emissiveFactor"] == [0, 0.5, 1]
    assert "emissiveFactor" not in told(b"Ke 0 0 0")[0]
    material, pictures = told(b"map_Ke glow.png", glow_png=picture())
    assert material["emissiveFactor"] == [1, 1, 1]
    assert material["emissiveTexture"] == {"index": 0}
    assert pictures == [picture()]


@pytest.mark.parametrize("kind", ["PNG", "JPEG"])
def test_pictures_are_embedded_as_they_are(kind: str) -> None:
    material, pictures = told(b"Kd 0 0 0\nd 0.5\nmap_Kd a.bin", a_bin=picture(kind))
    assert material["pbrMetallicRoughness"]["baseColorTexture"] == {"index": 0}
    assert material["pbrMetallicRoughness"]["baseColorFactor"] == [1, 1, 1, 0.5]
    assert pictures == [picture(kind)]


def test_a_picture_is_embedded_once() -> None:
    text = b"map_Kd -s 2 4 1 -o 0.5 0.25 0 checker.png\nmap_d checker.png\nnorm checker.png"
    material, pictures = told(text)
    assert len(pictures) == 1
    moved = {"offset": [0.5, -3.25], "scale": [2.0, 4.0]}
    found = material["pbrMetallicRoughness"]["baseColorTexture"]
    assert found == {"index": 0, "extensions": {"KHR_texture_transform": moved}}
    assert material["normalTexture"] == {"index": 0}
    assert material["alphaMode"] == "BLEND"


def test_bumps_are_no_normals() -> None:
    assert "normalTexture" not in told(b"map_Bump checker.png\nbump checker.png")[0]


@pytest.mark.parametrize("name", [b"gone.png", b"a.gif", b"/etc/passwd", b"..", b".", b"%2e%2e/x"])
def test_pictures_that_can_not_be_had(name: bytes) -> None:
    material, pictures = told(b"Kd 1 0 0\nmap_Kd " + name, a_gif=picture("GIF"))
    assert pictures == []
    assert material["pbrMetallicRoughness"]["baseColorFactor"] == [1, 0, 0, 1]


def test_pictures_that_are_too_large(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(materials, "LARGEST", len(picture()) - 1)
    assert told(b"map_Kd checker.png")[1] == []


def test_damaged_pictures() -> None:
    data = bytearray(zipped({"a.png": picture()}, method=0))
    data[60] ^= 1
    assert Folder(Archive(bytes(data)), "a.obj").content("a.png", 1 << 20) is None
