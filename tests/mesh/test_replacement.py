from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from service.mesh import replacement
from service.mesh.replacement import Replacement, printed, rewrite

quick = settings(deadline=None, database=None)


@quick
@given(st.floats(allow_nan=False, allow_infinity=False, width=32))
def test_printed_numbers_hold_every_float32(value: float) -> None:
    assert np.float32(printed(value)) == np.float32(value)


@pytest.mark.parametrize(
    ("value", "text"), [(0.1, b"0.1"), (-0.0, b"0"), (1e-7, b"1e-07"), (2 / 3, b"0.666666667")]
)
def test_printed_numbers_are_short(value: float, text: bytes) -> None:
    assert printed(value) == text


@quick
@given(st.data())
def test_rewrite_replaces_numbers_that_print_otherwise(data: st.DataObject) -> None:
    values = data.draw(st.lists(st.floats(-99, 99), min_size=1, max_size=9))
    texts = [b"%.17g" % value for value in values]
    content = b" ; ".join(texts)
    starts = np.cumsum([0] + [len(text) + 3 for text in texts])[:-1]
    ends = starts + [len(text) for text in texts]
    new = [
        data.draw(st.sampled_from([value, value * (1 + 1e-12), value + 1, -value, 0.0]))
        for value in values
    ]
    half = len(values) // 2
    parts = [
        Replacement(starts[half:], ends[half:], np.array(values[half:]), np.array(new[half:])),
        Replacement(starts[:half], ends[:half], np.array(values[:half]), np.array(new[:half])),
    ]
    expected = [
        text if printed(old) == printed(value) else printed(value)
        for text, old, value in zip(texts, values, new, strict=True)
    ]
    assert rewrite(content, parts) == b" ; ".join(expected)


def test_rewriting_nothing_is_the_same_object() -> None:
    data = b"1 2"
    nothing = np.empty(0, np.int64)
    assert rewrite(data, [Replacement(nothing, nothing, np.empty(0), np.empty(0))]) is data


def test_long_files_are_rewritten_in_blocks_without_a_seam(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(replacement, "BLOCK", 3)
    data = b"".join(b"<%d>" % number for number in range(10, 20))
    starts = np.arange(10) * 4 + 1
    old = np.arange(10.0, 20.0)
    change = Replacement(starts, starts + 2, old, old * 10)
    assert rewrite(data, [change]) == b"".join(b"<%d0>" % number for number in range(10, 20))
