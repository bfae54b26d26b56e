from __future__ import annotations

import numpy as np
import pytest

from service.errors import InvalidMesh, TooLarge
from service.mesh import limits
from service.mesh.checks import BLOCK, check
from service.mesh.meshfile import Faces, Linear, MeshFile, Vertices

SQUARE = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
FACES = np.array([[0, 1, 2], [0, 2, 3]])


class Plain(MeshFile):
    """Geometry without a file."""

    def __init__(self, vertices: Vertices, faces: Faces) -> None:
        self.vertices, self.faces = vertices, faces

    def write(self, vertices: Vertices, linear: Linear) -> bytes:
        return b""


def code(vertices: Vertices, faces: Faces = FACES) -> str:
    with pytest.raises(InvalidMesh) as caught:
        check(Plain(vertices, faces))
    assert caught.value.suggestion
    return caught.value.code


def test_a_surface_passes() -> None:
    check(Plain(SQUARE, FACES))
    check(Plain(SQUARE * 1e-12 + 5e-13, FACES))
    check(Plain(SQUARE * 1e30, FACES))


@pytest.mark.parametrize(("vertices", "faces"), [(np.empty((0, 3)), FACES), (SQUARE, FACES[:0])])
def test_nothing_is_empty(vertices: Vertices, faces: Faces) -> None:
    assert code(vertices, faces) == "empty_mesh"


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e300, -1e300])
def test_positions_must_be_finite(value: float) -> None:
    vertices = SQUARE.copy()
    vertices[2, 1] = value
    with pytest.raises(InvalidMesh) as caught:
        check(Plain(vertices, FACES))
    assert caught.value.code == "non_finite_vertices"
    assert "1 vertices" in caught.value.detail
    assert "vertex 2 " in caught.value.detail


@pytest.mark.parametrize("index", [-1, 4, 1 << 40, -(1 << 62)])
def test_faces_must_use_vertices_that_exist(index: int) -> None:
    faces = FACES.copy()
    faces[1, 1] = index
    assert code(SQUARE, faces) == "face_out_of_range"


@pytest.mark.parametrize(
    "vertices",
    [
        SQUARE * 0 + 3,
        SQUARE * [1, 0, 0],
        np.outer([0.1, 0.2, 0.3, 0.7], [1, 2, 3]),
        SQUARE[[0, 1, 1, 0]],
    ],
    ids=["point", "axis", "line", "edge"],
)
def test_a_mesh_needs_a_surface(vertices: Vertices) -> None:
    assert code(vertices) == "degenerate_mesh"


def test_one_late_face_is_surface_enough() -> None:
    faces = np.concatenate([np.zeros((BLOCK + 7, 3), np.int64), FACES[:1]])
    check(Plain(SQUARE, faces))
    assert code(SQUARE, faces[:-1]) == "degenerate_mesh"


@pytest.mark.parametrize("name", ["VERTICES", "FACES"])
def test_sizes_are_limited(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(limits, name, 1)
    with pytest.raises(TooLarge):
        check(Plain(SQUARE, FACES))
