"""Chairs as files really hold them: open, doubled, inside out, far off.  All are served."""

from __future__ import annotations

from collections.abc import Callable

import httpx
import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from service.mesh.convert import convert
from service.mesh.formats import read_mesh

Vertices = NDArray[np.float64]
Faces = NDArray[np.int64]
Change = Callable[[Vertices, Faces], tuple[Vertices, Faces]]
rng = np.random.default_rng(3)


def with_holes(x: Vertices, f: Faces) -> tuple[Vertices, Faces]:
    return x, f[rng.random(len(f)) > 0.15]


def with_fins(x: Vertices, f: Faces) -> tuple[Vertices, Faces]:
    """Third and fourth faces on edges that have two."""
    tips = x[f[::5]].mean(axis=1) + 0.01
    fins = np.column_stack([f[::5, :2], len(x) + np.arange(len(tips))])
    return np.concatenate([x, tips]), np.concatenate([f, fins, fins[:, [1, 0, 2]]])


def with_doubled_faces(x: Vertices, f: Faces) -> tuple[Vertices, Faces]:
    return x, np.concatenate([f, f, f[:, [1, 2, 0]], f[:, ::-1]])


def with_doubled_vertices(x: Vertices, f: Faces) -> tuple[Vertices, Faces]:
    """Every face has corners of its own, some of them a hair apart."""
    corners = x[f].reshape(-1, 3)
    return corners + rng.choice([0.0, 1e-9], (len(corners), 1)), np.arange(len(corners)).reshape(
        -1, 3
    )


def with_collapsed_faces(x: Vertices, f: Faces) -> tuple[Vertices, Faces]:
    points = np.repeat(f[:, :1], 3, axis=1)
    lines = f[:, [0, 1, 1]]
    middle = np.concatenate([x, (x[f[:, 0]] + x[f[:, 1]]) / 2])
    slivers = np.column_stack([f[:, :2], len(x) + np.arange(len(f))])
    return middle, np.concatenate([points, f, lines, slivers])


def with_stray_vertices(x: Vertices, f: Faces) -> tuple[Vertices, Faces]:
    stray = x.mean(axis=0) + rng.normal(size=(200, 3))
    return np.concatenate([stray, x]), f + 200


def with_stray_faces(x: Vertices, f: Faces) -> tuple[Vertices, Faces]:
    corners = rng.uniform(x.min(axis=0), x.max(axis=0), (40, 1, 3))
    corners = corners + rng.normal(scale=0.004, size=(40, 3, 3))
    return np.concatenate([x, corners.reshape(-1, 3)]), np.concatenate(
        [f, len(x) + np.arange(120).reshape(-1, 3)]
    )


def inside_out(x: Vertices, f: Faces) -> tuple[Vertices, Faces]:
    return x, f[:, ::-1]


def turned_both_ways(x: Vertices, f: Faces) -> tuple[Vertices, Faces]:
    return x, np.where(rng.random((len(f), 1)) < 0.5, f, f[:, ::-1])


def through_itself(x: Vertices, f: Faces) -> tuple[Vertices, Faces]:
    """A second chair, pushed through the first."""
    return np.concatenate([x, x * [0.9, 1, 1.1] + [0.02, 0, 0]]), np.concatenate([f, f + len(x)])


def in_one_piece(x: Vertices, f: Faces) -> tuple[Vertices, Faces]:
    """Faces that bridge the parts."""
    bridges = rng.integers(0, len(x), (20, 3))
    return x, np.concatenate([f, bridges])


def noisy(x: Vertices, f: Faces) -> tuple[Vertices, Faces]:
    return x + rng.normal(scale=0.004, size=x.shape), f


def scaled(factor: float) -> Change:
    return lambda x, f: (x * factor, f)


def offset(*by: float) -> Change:
    return lambda x, f: (x + by, f)


CASES: dict[str, Change] = {
    change.__name__.replace("_", " "): change
    for change in (
        with_holes, with_fins, with_doubled_faces, with_doubled_vertices, with_collapsed_faces,
        with_stray_vertices, with_stray_faces, inside_out, turned_both_ways, through_itself,
        in_one_piece, noisy,
    )
}  # fmt: skip
CASES |= {
    "tiny": scaled(1e-6),
    "huge": scaled(1e6),
    "far away": offset(1e5, 0.0, -1e5),
    "far up": offset(0.0, 1e5, 0.0),
}


@pytest.fixture(scope="module")
def chair(box_chair: trimesh.Trimesh) -> tuple[Vertices, Faces]:
    """The box chair in small triangles."""
    mesh = trimesh.Trimesh(box_chair.vertices, box_chair.faces, process=False)
    mesh = mesh.subdivide_to_size(0.2)
    return np.asarray(mesh.vertices), np.asarray(mesh.faces)


@pytest.mark.parametrize("case", CASES)
def test_broken_chairs_are_served(
    service_client: httpx.Client, chair: tuple[Vertices, Faces], case: str
) -> None:
    x, faces = CASES[case](*chair)
    size = float(np.ptp(x[faces], axis=(0, 1)).max())
    content = convert(x, faces, "ply")
    files = {"mesh": ("chair.ply", content)}
    upright = {"up": "+y", "front": "+z"}
    response = service_client.post("/infer", files=files, data=upright)
    assert response.status_code == 200, response.text
    found = response.json()
    numbers = [
        number
        for entry in [*found["parameters"].values(), *found["derived"].values()]
        for key, number in entry.items()
        if key != "unit"
    ]
    assert np.isfinite(numbers).all()
    assert all(0 < entry["value"] < 2 * size for entry in found["parameters"].values())

    edits = {"edits": '{"leg_height": {"scale": 1.2}}'}
    response = service_client.post("/edit", files=files, data=upright | edits)
    assert response.status_code == 200, response.text
    before, after = read_mesh(content, "a.ply"), read_mesh(response.content, "a.ply")
    assert np.array_equal(after.faces, before.faces)
    grown = 0.2 * found["parameters"]["leg_height"]["value"]
    moved = after.vertices - before.vertices
    # Nothing moves much farther than the legs grow, and nothing but upwards; float32 rounds.
    rounding = 2e-7 * np.abs(before.vertices).max()
    assert moved[:, 1].max() <= 1.05 * grown + rounding
    assert moved[:, 1].min() >= -0.02 * size - rounding
    assert np.abs(moved[:, [0, 2]]).max() <= 0.02 * size + rounding
    # The edit does what it says, as far as float32 can tell there.
    assert moved[:, 1].max() >= 0.9 * grown - rounding


@pytest.mark.parametrize("case", ["with doubled vertices", "with collapsed faces", "far away"])
def test_an_empty_edit_of_a_broken_chair_is_its_bytes(
    service_client: httpx.Client, chair: tuple[Vertices, Faces], case: str
) -> None:
    content = convert(*CASES[case](*chair), "stl")
    response = service_client.post(
        "/edit",
        files={"mesh": ("a.stl", content)},
        data={"edits": "{}", "refine": "false", "up": "+y", "front": "+z"},
    )
    assert response.content == content
