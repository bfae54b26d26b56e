from __future__ import annotations

import numpy as np
import pytest
from mesh_samples import ball

from service.errors import InvalidRequest
from service.mesh.convert import convert
from service.mesh.formats import READERS, read_mesh

VERTICES, FACES, _ = ball()


@pytest.mark.parametrize("scale", [1e-6, 1.0, 4e5])
@pytest.mark.parametrize("format", READERS)
def test_vertices_and_faces_arrive_in_order(format: str, scale: float) -> None:
    # One vertex that no face uses must not be lost.
    vertices = np.concatenate([VERTICES, [[0.5, 0.5, 0.5]]]) * scale
    again = read_mesh(convert(vertices, FACES, format), "x." + format)
    assert np.allclose(again.vertices[again.faces], vertices[FACES], rtol=1e-6, atol=1e-6 * scale)
    if format != "stl":
        assert np.array_equal(again.faces, FACES)
        assert np.allclose(again.vertices, vertices, rtol=1e-6, atol=1e-6 * scale)


def test_other_formats_are_refused() -> None:
    with pytest.raises(InvalidRequest) as caught:
        convert(VERTICES, FACES, "fbx")
    assert caught.value.code == "unknown_format"
    assert "glb" in caught.value.suggestion
