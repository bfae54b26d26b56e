from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from service.mesh import split
from service.mesh.split import joined, representatives

RANDOM = np.random.default_rng(0)


@pytest.mark.parametrize("largest", [1 << 62, 100])
@pytest.mark.parametrize("kinds", [1, 2, 30])
def test_the_first_corner_like_each(
    monkeypatch: pytest.MonkeyPatch, largest: int, kinds: int
) -> None:
    monkeypatch.setattr(split, "LARGEST_NUMBER", largest)
    vertex, *keys = RANDOM.integers(-1, kinds, (3, 200))
    vertex = vertex + 1
    first, claims = representatives(vertex, tuple(keys), kinds + 2)
    rows: list[tuple[int, ...]] = list(
        zip(vertex.tolist(), *(k.tolist() for k in keys), strict=True)
    )
    assert first.tolist() == [rows.index(row) for row in rows]
    known = vertex.tolist()
    assert claims.tolist() == [known.index(v) if v in known else -1 for v in range(kinds + 2)]


def test_numbers_that_would_not_fit() -> None:
    def column(*values: int) -> NDArray[np.int64]:
        return np.array(values, np.int64)

    huge = 1 << 40
    keys = [column(huge, huge, 3, huge), column(0, huge, huge, 0)]
    found = joined(huge, column(huge - 1, huge - 1, 0, huge - 1), keys)
    assert found[0] == found[3]
    assert len(set(found.tolist())) == 3
