from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from service.errors import InvalidMesh, TooLarge
from service.mesh import limits
from service.mesh.corners import NORMAL, POSITION, TEXTURE, Corners
from service.mesh.textlines import TextLines


def read(data: bytes) -> tuple[list[int], list[int], list[int]]:
    """Counts, positions and normals of all corners."""
    lines = TextLines("obj", data)
    corners = Corners(lines)
    found = (
        corners.indices(field, lines.beginning(keyword)[0])
        for field, keyword in ((POSITION, b"v"), (NORMAL, b"vn"))
    )
    return corners.counts.tolist(), *(indices.tolist() for indices in found)


@pytest.mark.parametrize(
    ("data", "counts", "positions", "normals"),
    [
        (b"f 1 2 3\nf 4 5 6 7", [3, 4], [0, 1, 2, 3, 4, 5, 6], [-1] * 7),
        (b"f 1/9 2/9 3/9", [3], [0, 1, 2], [-1] * 3),
        (b"f 1/9/4 2/9/5 3/9/6", [3], [0, 1, 2], [3, 4, 5]),
        (b"f 1//4 2//5 3//6", [3], [0, 1, 2], [3, 4, 5]),
        (b"f 1//4 2/9/5 3", [3], [0, 1, 2], [3, 4, -1]),
        (b"f 1/ 2// 3/9/", [3], [0, 1, 2], [-1] * 3),
        (b"f 1/9/ 2/9/ 3/9/", [3], [0, 1, 2], [-1] * 3),
        (b"f 1/2/3/4 5/6 7", [3], [0, 4, 6], [2, -1, -1]),
        (b"f /1/4 2 3", [3], [-1, 1, 2], [3, -1, -1]),
        (b"v 0 0 0\nv 0 0 0\nf -1 -2 1\nv 0 0 0\nf -1 -3 1", [3, 3], [1, 0, 0, 2, 0, 0], [-1] * 6),
        (b"vn 0 0 0\nvn 0 0 0\nf 1//-1 2//-2 3//1", [3], [0, 1, 2], [1, 0, 0]),
        (b"f", [0], [], []),
        (b"", [], [], []),
    ],
)
def test_corners(data: bytes, counts: list[int], positions: list[int], normals: list[int]) -> None:
    assert read(data) == (counts, positions, normals)


@pytest.mark.parametrize(
    "data", [b"f 0 1 2", b"v 0 0 0\nf 1 1 -2", b"f 1//0 2//1 3//1", b"f 1//-1 2 3"]
)
def test_indices_that_point_at_nothing_are_malformed(data: bytes) -> None:
    with pytest.raises(InvalidMesh, match=r"line \d has an index that points at nothing"):
        read(data)


@pytest.mark.parametrize("data", [b"f a b c", b"f 1.0 2 3", b"f 1/a/1 2/1/1 3/1/1x", b"f 1//2x 3"])
def test_corners_that_are_no_numbers_are_malformed(data: bytes) -> None:
    with pytest.raises(InvalidMesh, match="malformed_obj"):
        read(data)


index = st.integers(1, 999)
corner = st.one_of(
    index.map(str),
    st.tuples(index, index).map("{0[0]}/{0[1]}".format),
    st.tuples(index, index).map("{0[0]}//{0[1]}".format),
    st.tuples(index, index, index).map("{0[0]}/{0[1]}/{0[2]}".format),
)


@settings(deadline=None, database=None)
@given(st.lists(st.lists(corner, min_size=1, max_size=6), max_size=8))
def test_any_mixture_is_split_at_its_slashes(faces: list[list[str]]) -> None:
    parts = [(*text.split("/"), "", "")[:3] for face in faces for text in face]
    _, positions, normals = read("\n".join(f"f {' '.join(face)}" for face in faces).encode())
    assert positions == [int(part[0]) - 1 for part in parts]
    assert normals == [int(part[2] or 0) - 1 for part in parts]


def test_many_faces_alike_are_one_table() -> None:
    table = np.random.default_rng(2).integers(1, 99, (500, 9))
    data = "".join("f {}/{}/{} {}/{}/{} {}/{}/{}\n".format(*row) for row in table).encode()
    _, positions, normals = read(data)
    assert positions == (table[:, 0::3] - 1).reshape(-1).tolist()
    assert normals == (table[:, 2::3] - 1).reshape(-1).tolist()


def test_polygons_without_end_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    lines = TextLines("obj", b"f 1 2 3\nf 1\nf 1 2 3 4\n")
    monkeypatch.setattr(limits, "FACES", 3)
    assert Corners(lines).counts.tolist() == [3, 1, 4]
    monkeypatch.setattr(limits, "FACES", 2)
    with pytest.raises(TooLarge, match="too_many_faces"):
        Corners(lines)


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        (b"f 1/2/3 4/5/6 7/-1/9", [1, 4, 1]),
        (b"f 1/2 4//6 7", [1, -1, -1]),
        (b"f 1//3 4//6 7//9", [-1] * 3),
        (b"f 1 2 3", [-1] * 3),
    ],
)
def test_texture_coordinates(data: bytes, expected: list[int]) -> None:
    lines = TextLines("obj", b"vt 0 0\nvt 0 0\n" + data)
    corners = Corners(lines)
    assert corners.indices(TEXTURE, lines.beginning(b"vt")[0]).tolist() == expected


def test_other_text_is_no_texture_coordinate() -> None:
    corners = Corners(TextLines("obj", b"f 1/x/3 4//6 7"))
    assert corners.counts.tolist() == [3]
    with pytest.raises(InvalidMesh):
        corners.indices(TEXTURE, np.empty(0, np.int64))
