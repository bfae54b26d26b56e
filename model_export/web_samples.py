"""The viewer's sample meshes: a chair, an airplane and a person, from the project's own generators.

python -m model_export.web_samples        # writes service/web/samples
"""

from __future__ import annotations

import json
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

import service
from model_export.detailed import detailed_chair
from model_export.primitives import Array, Faces, Mesh, slab, tube
from service.template.anatomy import JOINTS
from service.template.bodyfile import load_body
from service.template.skinned import SkinnedTemplate, body_of

FOLDER = Path(service.__file__).parent / "web" / "samples"

CHAIR_SEED = 63
"""Tapered legs, slats, arms, an apron and a cushion."""
CHAIR = (0.44, 0.032, 0.05, 0.46, 0.48, 0.40, 0.036, 0.036)
CREASE = np.radians(38)


@dataclass(frozen=True)
class Piece:
    """What is of one material.

    Attributes:
        vertices, faces: ``[V, 3]`` metres and ``[F, 3]``.
        name: of the material.
        colour: linear, red, green and blue.
        roughness, metallic: of the surface.
        colours: ``[V, 3]`` that multiply `colour`, where it has several.
        smooth: whether all of its vertices are smooth, and stay as they are.
    """

    vertices: Array
    faces: Faces
    name: str
    colour: tuple[float, float, float]
    roughness: float = 0.6
    metallic: float = 0.0
    colours: Array | None = None
    smooth: bool = False

    def shaded(self) -> tuple[Array, Array, Faces]:
        """Vertices, normals and faces; vertices on a crease are doubled."""
        mesh = trimesh.Trimesh(self.vertices, self.faces, process=False)
        if not self.smooth:
            mesh = trimesh.graph.smooth_shade(mesh, angle=CREASE)
        return (
            np.array(mesh.vertices),
            np.array(mesh.vertex_normals),
            np.array(mesh.faces, np.int64),
        )


# --- the chair -------------------------------------------------------------------------------


def chair() -> list[Piece]:
    """A wooden armchair with a cushion; its origin is on the floor."""
    made = detailed_chair(CHAIR_SEED)
    vertices = made.mesh(CHAIR)
    vertices -= [0.0, vertices[:, 1].min(), 0.0]
    soft = _cushions(vertices, made.faces)
    return [
        _part(vertices, made.faces[~soft], "Oak", (0.30, 0.165, 0.085), 0.55),
        _part(vertices, made.faces[soft], "Wool", (0.045, 0.13, 0.15), 0.95),
    ]


def _cushions(vertices: Array, faces: Faces) -> NDArray[np.bool_]:
    """``[F]`` the faces of the piece that lies on the seat."""
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]]])
    graph = trimesh.graph.edges_to_coo(edges, count=len(vertices))
    count, piece = connected_components(graph, directed=False)
    low = np.array([vertices[piece == index].min(axis=0) for index in range(count)])
    high = np.array([vertices[piece == index].max(axis=0) for index in range(count)])
    wide = (high - low)[:, [0, 2]].min(axis=1) > 0.3
    # The seat itself is the lower of the two.
    found = wide & (low[:, 1] > low[wide, 1].min())
    soft: NDArray[np.bool_] = found[piece[faces[:, 0]]]
    return soft


# --- the airplane ----------------------------------------------------------------------------

LENGTH, RADIUS = 34.0, 1.95
SIDES = 40
TAIL_RINGS = 12
NOSE_RING = 45
"""Where the windscreen's lower edge is."""


def airplane() -> list[Piece]:
    """A twin-jet airliner; its origin is the middle of the fuselage, in metres."""
    white, grey, blue = (0.80, 0.82, 0.84), (0.45, 0.48, 0.52), (0.02, 0.10, 0.32)
    body, faces, quad = _fuselage()
    tail, glass = quad[:, 0] < TAIL_RINGS, _windscreen(*quad.T)
    wings = [_panel(side * (1.0 + 0.6j), side * (15.4 + 1.55j), (1.2, -5.4), (6.4, 1.5), 0.11)
             for side in (-1, 1)]  # fmt: skip
    tails = [_panel(side * (0.4 + 0.75j), side * (5.7 + 1.15j), (-13.4, -15.7), (3.4, 1.3), 0.10)
             for side in (-1, 1)]  # fmt: skip
    engines = [_engine(side * 5.0) for side in (-1, 1)]
    pylons = [slab((side * 5.0, -0.82, 0.95), (0.24, 1.0, 2.6), 0.08, 1) for side in (-1, 1)]
    return [
        _part(body, faces[~tail & ~glass], "White paint", white, 0.35),
        _part(body, faces[glass], "Glass", (0.01, 0.012, 0.016), 0.1),
        _joined([(body, faces[tail]), _fin(), *engines], "Blue paint", blue, 0.35),
        _joined([*wings, *tails, *pylons], "Grey paint", grey, 0.4),
        _joined(list(_windows()), "Windows", (0.02, 0.025, 0.035), 0.15),
        _joined([_disc(side * 5.0) for side in (-1, 1)], "Fans", (0.05, 0.05, 0.06), 0.3, 0.8),
    ]


def _fuselage() -> tuple[Array, Faces, Faces]:
    """A tube that rounds off at the nose and rises to a point at the tail, and ``[F, 2]`` the ring
    and the side of each of its faces."""
    at = np.concatenate([
        np.linspace(-0.5, -0.2, 22)[:-1], np.linspace(-0.2, 0.36, 16)[:-1],
        0.5 - 0.14 * np.cos(np.linspace(0, np.pi / 2, 20)),
    ])  # fmt: skip
    nose = np.clip((at - 0.36) / 0.14, 0.0, 1.0)
    tail = np.clip((-0.2 - at) / 0.3, 0.0, 1.0)
    radius = RADIUS * np.sqrt(np.maximum(1 - nose**2.2, 0.0)) * (1 - 0.9 * tail**1.7)
    rise = 0.62 * RADIUS * tail**1.6 - 0.22 * RADIUS * nose**2
    path = np.stack([0 * at, rise, at * LENGTH], axis=1)
    vertices, faces = tube(path, np.stack([radius, radius], 1).clip(0.02), SIDES, False)
    # A quad is two triangles; its first vertex is that of its ring and side.
    index = faces.min(axis=1)
    sides = np.where((faces % SIDES == 0).any(axis=1) & (faces % SIDES == SIDES - 1).any(axis=1),
                     SIDES - 1, (faces % SIDES).min(axis=1))  # fmt: skip
    return vertices, faces, np.stack([index // SIDES, sides], axis=1)


def _windscreen(ring: Faces, side: Faces) -> NDArray[np.bool_]:
    """Two panes ahead and one at each side, by rings of the nose and sides about it."""
    across = np.minimum(side, (SIDES // 2 - 1 - side) % SIDES)
    front = (ring >= NOSE_RING) & (ring < NOSE_RING + 3) & (across >= 6) & (across <= 8)
    flank = (ring >= NOSE_RING - 3) & (ring < NOSE_RING - 0) & (across >= 3) & (across <= 5)
    return front | flank


def _panel(
    root: complex, tip: complex, ahead: tuple[float, float], chord: tuple[float, float],
    thick: float,
) -> Mesh:  # fmt: skip
    """A wing along x from `root` to `tip` (x + iy); its sides are mirrored by their sign."""
    s = np.linspace(0.0, 1.0, 28)
    ends = np.array([[root.real, abs(root.imag)], [tip.real, abs(tip.imag)]])
    ends[:, 1] += -1.55 if chord[0] > 5 else 0.0
    z, c = np.interp(s, [0, 1], ahead), np.interp(s, [0, 0.36, 1], [chord[0], *_kink(chord)])
    path = np.stack([np.interp(s, [0, 1], ends[:, 0]), np.interp(s, [0, 1], ends[:, 1]), z], 1)
    half = np.stack([c * thick * (1 - 0.25 * s), c], axis=1) / 2
    half[-2:] *= [[0.8], [0.45]]
    return tube(path, half, 20, False)


def _kink(chord: tuple[float, float]) -> tuple[float, float]:
    """Chords at the kink and the tip: an airliner's wing is widest inboard."""
    return (0.56 if chord[0] > 5 else 0.70) * chord[0], chord[1]


def _fin() -> Mesh:
    s = np.linspace(0.0, 1.0, 24)
    z, c = np.interp(s, [0, 1], [-13.0, -16.4]), np.interp(s, [0, 1], [5.2, 1.9])
    path = np.stack([0 * s, np.interp(s, [0, 1], [1.2, 7.3]), z], axis=1)
    half = np.stack([0.09 * c, c], axis=1) / 2
    half[-2:] *= [[0.9], [0.7]]
    return tube(path, half, 20, False)


def _engine(x: float) -> Mesh:
    s = np.linspace(0.0, 1.0, 18)
    radius = 1.05 * np.interp(s, [0, 0.45, 0.9, 1], [0.55, 0.92, 1.0, 0.9])
    path = np.stack([0 * s + x, 0 * s - 1.75, -0.6 + 4.3 * s], axis=1)
    return tube(path, np.stack([radius, radius], 1), 28, False)


def _disc(x: float) -> Mesh:
    """The dark mouth of an engine."""
    path = np.array([[x, -1.75, 3.68], [x, -1.75, 3.72]])
    return tube(path, np.full((2, 2), 0.82), 28, False)


def _windows() -> list[Mesh]:
    rows = []
    for side in (-1, 1):
        for z in np.arange(-8.6, 11.9, 0.62):
            y, x = 0.42, side * (RADIUS * np.sqrt(1 - (0.42 / RADIUS) ** 2) - 0.02)
            path = np.array([[x - 0.05, y, z], [x + 0.05, y, z]])
            rows.append(tube(path, np.array([[0.17, 0.12]] * 2), 6, False))
    return rows


# --- the person ------------------------------------------------------------------------------

POSE = {
    "left_shoulder": (0.10, -0.20, -1.05), "right_shoulder": (0.10, 0.20, 1.05),
    "left_elbow": (0.0, -0.32, 0.0), "right_elbow": (0.0, 0.32, 0.0),
    "left_hip": (-0.03, 0.10, 0.07), "right_hip": (-0.03, -0.10, -0.07),
    "head": (0.0, 0.12, 0.0),
}  # fmt: skip
SHAPE = (0.3, -0.2, -0.6)
_TOP, _BOTTOM, _SHOES, _SKIN = (
    np.array(colour)
    for colour in (
        (0.62, 0.60, 0.56), (0.035, 0.055, 0.10), (0.02, 0.02, 0.024), (0.52, 0.30, 0.20),
    )
)  # fmt: skip


def person() -> list[Piece]:
    """The shipped body at ease, in a shirt and trousers that are but colours; feet at y = 0."""
    body = load_body()
    vectors = np.zeros((len(JOINTS), 3))
    for joint, vector in POSE.items():
        vectors[JOINTS.index(joint)] = vector
    vertices = body.decode(body_of(vectors, np.array(SHAPE), 1.0, np.zeros(3)))
    vertices -= [0.0, vertices[:, 1].min(), 0.0]
    white, dressed = (1.0, 1.0, 1.0), _dressed(body)
    return [Piece(vertices, body.faces, "Clothes", white, 0.8, 0.0, dressed, True)]


def _dressed(body: SkinnedTemplate) -> Array:
    """``[V, 3]`` colours by where a vertex lies in the T-pose."""
    x, y, _ = body.rest.T
    joints = dict(zip(JOINTS, body.joints, strict=True))
    waist, ankle = joints["spine1"][1] - 0.03, joints["left_ankle"][1]
    elbow = abs(joints["left_elbow"][0])
    colours = np.tile(_SKIN, (len(x), 1))
    shirt = (y > waist) & (y < joints["neck"][1] + 0.005) & (abs(x) < 0.9 * elbow)
    colours[shirt] = _TOP
    colours[(y <= waist) & (abs(x) < 0.9 * elbow) & (y > ankle + 0.03)] = _BOTTOM
    colours[y <= ankle + 0.03] = _SHOES
    return colours


# --- files -----------------------------------------------------------------------------------


def _part(
    vertices: Array, faces: Faces, name: str, colour: tuple[float, float, float],
    roughness: float = 0.6, metallic: float = 0.0,
) -> Piece:  # fmt: skip
    """The vertices that some faces use."""
    used, index = np.unique(faces, return_inverse=True)
    return Piece(vertices[used], index.reshape(-1, 3), name, colour, roughness, metallic)


def _joined(
    meshes: Sequence[Mesh], name: str, colour: tuple[float, float, float],
    roughness: float = 0.6, metallic: float = 0.0,
) -> Piece:  # fmt: skip
    offsets = np.cumsum([0, *(len(vertices) for vertices, _ in meshes)])
    faces = np.concatenate([f + o for (_, f), o in zip(meshes, offsets[:-1], strict=True)])
    vertices = np.concatenate([vertices for vertices, _ in meshes])
    return _part(vertices, faces, name, colour, roughness, metallic)


def glb(name: str, pieces: Sequence[Piece]) -> bytes:
    """One node, one mesh, a primitive for each piece."""
    chunks: list[bytes] = []
    views, accessors, primitives, materials = [], [], [], []

    def put(
        array: NDArray[np.generic], kind: str, component: int, target: int, **more: object
    ) -> int:
        data = array.tobytes()
        offset = sum(len(chunk) for chunk in chunks)
        views.append({"buffer": 0, "byteOffset": offset, "byteLength": len(data), "target": target})
        chunks.append(data + b"\0" * (-len(data) % 4))
        count = len(array) if kind != "SCALAR" else array.size
        accessors.append(
            {"bufferView": len(views) - 1, "componentType": component, "count": count,
             "type": kind, **more}
        )  # fmt: skip
        return len(accessors) - 1

    for index, piece in enumerate(pieces):
        vertices, normals, faces = piece.shaded()
        points = vertices.astype("<f4")
        ends = {"min": points.min(0).tolist(), "max": points.max(0).tolist()}
        attributes = {
            "POSITION": put(points, "VEC3", 5126, 34962, **ends),
            "NORMAL": put(normals.astype("<f4"), "VEC3", 5126, 34962),
        }
        if piece.colours is not None:
            rgba = np.column_stack([piece.colours, np.ones(len(piece.colours))])
            levels = np.round(rgba * 65535).astype("<u2")
            attributes["COLOR_0"] = put(levels, "VEC4", 5123, 34962, normalized=True)
        wide = len(points) > 65535
        corners = faces.astype("<u4" if wide else "<u2")
        indices = put(corners.reshape(-1, 1), "SCALAR", 5125 if wide else 5123, 34963)
        primitives.append({"attributes": attributes, "indices": indices, "material": index})
        paint = {
            "baseColorFactor": [*piece.colour, 1.0],
            "metallicFactor": piece.metallic,
            "roughnessFactor": piece.roughness,
        }
        materials.append({"name": piece.name, "pbrMetallicRoughness": paint})
    binary = b"".join(chunks)
    document = {
        "asset": {"version": "2.0", "generator": "shape-parameters"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"name": name, "mesh": 0}],
        "meshes": [{"name": name, "primitives": primitives}],
        "materials": materials,
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(binary)}],
    }
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    head = struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(binary))
    text_head = struct.pack("<I4s", len(text), b"JSON")
    return head + text_head + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary


SAMPLES = {"chair": chair, "airplane": airplane, "human": person}


def main() -> None:
    """Write each sample beside the page."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    for name, make in SAMPLES.items():
        data = glb(name, make())
        (FOLDER / f"{name}.glb").write_bytes(data)
        print(f"{name}.glb: {len(data) / 1000:.0f} kB")


if __name__ == "__main__":
    main()
