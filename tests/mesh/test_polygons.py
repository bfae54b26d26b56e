from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from service.mesh.polygons import as_indices, fan, strip


@settings(deadline=None, database=None)
@given(st.lists(st.lists(st.integers(0, 99), max_size=7), max_size=20))
def test_fan_is_the_loop(polygons: list[list[int]]) -> None:
    expected = [
        [polygon[0], polygon[k], polygon[k + 1]]
        for polygon in polygons
        for k in range(1, len(polygon) - 1)
    ]
    corners = np.array([i for polygon in polygons for i in polygon], np.int64)
    counts = np.array([len(polygon) for polygon in polygons], np.int64)
    assert fan(corners, counts).tolist() == expected


@settings(deadline=None, database=None)
@given(st.lists(st.integers(-1, 9), max_size=30))
def test_strip_is_the_loop(corners: list[int]) -> None:
    expected = []
    start = 0
    for at, corner in enumerate(corners):
        if corner < 0:
            start = at + 1
        elif at - start >= 2:
            a, b, c = corners[at - 2 : at + 1]
            if len({a, b, c}) == 3:
                expected.append([a, b, c] if (at - start) % 2 == 0 else [a, c, b])
    assert strip(np.array(corners, np.int64)).tolist() == expected


@pytest.mark.parametrize("shape", [fan, strip])
def test_results_are_faces(shape: object) -> None:
    corners = np.arange(6)
    faces = fan(corners, np.array([6])) if shape is fan else strip(corners)
    assert (faces.shape, faces.dtype) == ((4, 3), np.int64)


def test_no_polygons_are_no_faces() -> None:
    empty = np.empty(0, np.int64)
    assert fan(empty, empty).shape == (0, 3)
    assert strip(np.arange(2)).shape == (0, 3)


def test_numbers_that_are_no_indices_become_invalid() -> None:
    found = as_indices(np.array([2.0, np.nan, 1e300]))
    assert found[0] == 2
    assert not ((found[1:] >= 0) & (found[1:] < 1 << 62)).any()
