from __future__ import annotations

import numpy as np
import pytest

from service.errors import InvalidMesh
from service.mesh.replacement import rewrite
from service.mesh.textlines import TextLines
from service.mesh.triples import Triples

DATA = b"v 1 2 3 9 9\n# c\n\tv 4  5 6\nvn 7 8 9\nv -1 -2 -3"


def test_the_first_three_numbers_of_each_line() -> None:
    triples = Triples(TextLines("obj", DATA), b"v")
    assert triples.lines.tolist() == [0, 2, 4]
    assert triples.values.tolist() == [[1, 2, 3], [4, 5, 6], [-1, -2, -3]]
    assert Triples(TextLines("obj", DATA), b"f").values.shape == (0, 3)


def test_changed_rows_alone_are_rewritten() -> None:
    triples = Triples(TextLines("obj", DATA), b"v")
    values = triples.values + 0.5
    change = triples.changed(np.array([False, True, True]), values)
    assert rewrite(DATA, [change]) == DATA.replace(b"4  5 6", b"4.5  5.5 6.5").replace(
        b"-1 -2 -3", b"-0.5 -1.5 -2.5"
    )


def test_short_lines_are_named() -> None:
    with pytest.raises(InvalidMesh, match="line 2 has fewer than 3 numbers"):
        Triples(TextLines("obj", b"v 1 2 3\nv 1 2\n"), b"v")
