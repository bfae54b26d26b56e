from __future__ import annotations

import numpy as np
import pytest

from service.mesh.accessors import read_accessor
from service.mesh.glb import GlbFile
from service.mesh.looks import Looks
from service.mesh.wrapping import SHORT, mended, wrap

FACES = np.array([[0, 1, 2]])
CORNERS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])


def test_normals_have_length_one() -> None:
    # Those whose length can't be known are the face's.
    given = np.array([[0.0, 3, 4], [1e-200, 0, 0], [1e300, 1e300, 0]])
    assert np.allclose(mended(given, CORNERS, FACES), [[0, 0.6, 0.8], [0, 0, 1], [0, 0, 1]])


def test_a_normal_of_nothing_points_up() -> None:
    found = mended(np.full((3, 3), np.nan), np.zeros((3, 3)), FACES)
    assert found.tolist() == [[0, 1, 0]] * 3


@pytest.mark.parametrize(("count", "kind"), [(SHORT, "<u2"), (SHORT + 1, "<u4")])
def test_no_index_is_the_largest_of_its_kind(count: int, kind: str) -> None:
    vertices = np.zeros((count, 3))
    vertices[: len(CORNERS)] = CORNERS
    faces = np.array([[0, 1, count - 1]])
    looks = Looks.whole(count, faces, colours=np.ones((count, 3)))
    assert looks is not None
    file = GlbFile(wrap(vertices, looks, None))
    (primitive,) = file.document.root["meshes"][0]["primitives"]
    accessor = read_accessor(file.document, file.buffers, primitive["indices"])
    assert accessor.dtype == np.dtype(kind)
    assert np.array_equal(file.faces, faces)
