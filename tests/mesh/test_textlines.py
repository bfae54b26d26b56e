from __future__ import annotations

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from service.errors import InvalidMesh, TooLarge
from service.mesh import limits
from service.mesh.textlines import (
    BLOCK,
    COLUMNS,
    TextLines,
    holds,
    joined,
    numbers,
    occurrences,
    token_edges,
    without_comments,
)

quick = settings(deadline=None, database=None)


def tokens_of(data: bytes, *keywords: bytes, continued: bool = False) -> list[list[bytes]]:
    """The tokens behind `keywords`, line by line, cut out of the file by their spans."""
    lines = TextLines("obj", data, continued)
    tokens = lines.tokens(*lines.beginning(*keywords))
    starts, ends = tokens.spans(np.arange(tokens.counts.sum()))
    words = [data[start:end] for start, end in zip(starts.tolist(), ends.tolist(), strict=True)]
    rows = []
    for count in tokens.counts.tolist():
        rows.append(words[:count])
        words = words[count:]
    return rows


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        (b"v 1 2\nf 3\nv 4", [[b"1", b"2"], [b"4"]]),
        (b"v 1\r\nv\t2\r\n", [[b"1"], [b"2"]]),
        (b"v 1\rv 2\r", [[b"1"], [b"2"]]),
        (b"  v 1\n\t\tv 2\n", [[b"1"], [b"2"]]),
        (b"vn 1\nvt 2\nv\nva 3\nV 4", [[], [b"4"]]),
        (b"v 1 # v 2\n#v 3\nv 4#5", [[b"1"], [b"4"]]),
        (b"v 1 \\\n 2\nv 3 \\\r\n4\n", [[b"1", b"2"], [b"3", b"4"]]),
        (b"# C:\\tmp\\\nv 1\nv 2 # x\\\r\nv 3\\\n", [[b"1"], [b"2"], [b"3"]]),
        (b"v", [[]]),
        (b"", []),
        (b"\n\n\n", []),
        (b" " * 200 + b"v 1\n" + b" " * 300 + b"\nv 2", [[b"1"], [b"2"]]),
    ],
)
def test_lines_of_a_keyword(data: bytes, expected: list[list[bytes]]) -> None:
    assert tokens_of(data, b"v", continued=True) == expected


def test_two_keywords() -> None:
    data = b"facet normal 1 2 3\n  FACET   Normal 4 5 6\nfacet 7\nnormal 8\nfacet normals 9\n"
    assert tokens_of(data, b"facet", b"normal") == [[b"1", b"2", b"3"], [b"4", b"5", b"6"]]


words = st.text("0123456789.-", min_size=1, max_size=4)
rows = st.tuples(st.sampled_from(["v", "vn", "f", "#", "", "o"]), st.lists(words, max_size=5))


@quick
@given(
    st.lists(rows, max_size=30),
    st.sampled_from(["\n", "\r\n"]),
    st.sampled_from(["", " ", "\t  ", " " * (COLUMNS + 5)]),
    st.booleans(),
)
def test_tokens_are_those_of_split(
    lines: list[tuple[str, list[str]]], end: str, indent: str, ended: bool
) -> None:
    text = end.join(indent + " ".join([keyword, *tokens]) for keyword, tokens in lines)
    data = (text + end * ended).encode()
    for keyword in (b"v", b"vn", b"f"):
        expected = [line.split()[1:] for line in data.splitlines() if line.split()[:1] == [keyword]]
        assert tokens_of(data, keyword) == expected


def test_numbers_are_parsed_or_told() -> None:
    lines = TextLines("ply", b"v 1 2.5\nv -3e2\n")
    tokens = lines.tokens(*lines.beginning(b"v"))
    assert tokens.numbers().tolist() == [1, 2.5, -300]
    assert tokens.first.tolist() == [0, 2]


@pytest.mark.parametrize("token", [b"1" * 3_000_000, b"0." + b"3" * 3_000_000, b"x" * 3_000_000])
def test_a_number_without_end_is_told_briefly(token: bytes) -> None:
    text = np.frombuffer(b"2 " + token + b"y 3\n", np.uint8)
    with pytest.raises(InvalidMesh) as caught:
        numbers("off", text, 3, np.float64)
    assert len(caught.value.detail) < 120


@pytest.mark.parametrize("token", [b"x", b"1-2", b"1.2.3", b"0x10", b"1,2", b"\xff", b"--1", b"\0"])
def test_tokens_that_are_no_numbers_are_malformed(token: bytes) -> None:
    text = np.frombuffer(b"1 " + token + b" 3\n", np.uint8)
    with pytest.raises(InvalidMesh, match="malformed_off"):
        numbers("off", text, 3, np.float64)


def test_filled_lines_hold_more_than_comments() -> None:
    lines = TextLines("off", b"OFF\n\n  # x\n \t\n 1 2 # y\n3")
    assert lines.filled().tolist() == [0, 4, 5]


@quick
@given(st.text("#ab \n", max_size=40))
def test_comments_are_blanked_to_the_end_of_their_line(text: str) -> None:
    expected = "\n".join(
        line.partition("#")[0] + " " * (len(line) - len(line.partition("#")[0]))
        for line in text.split("\n")
    )
    found = without_comments(np.frombuffer(text.encode(), np.uint8))
    assert found.tobytes().decode() == expected


@settings(deadline=None, database=None)
@given(st.text(alphabet="\\\n\r# a", max_size=20))
def test_lines_are_joined_outside_of_comments(text: str) -> None:
    def blanked(match: re.Match[bytes]) -> bytes:
        return match[0] if match[0].startswith(b"#") else b" " * len(match[0])

    expected = re.sub(rb"#[^\n]*|\\\r?\n", blanked, text.encode())
    assert joined(text.encode()) == expected


def test_lines_and_tokens_without_end_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(limits, "LINES", 4)
    TextLines("obj", b"a\n" * 4)
    with pytest.raises(TooLarge, match="too_many_lines"):
        TextLines("obj", b"a\n" * 5)
    monkeypatch.setattr(limits, "TOKENS", 3)
    assert len(token_edges(np.frombuffer(b" 1 2 3", np.uint8))) == 6
    with pytest.raises(TooLarge, match="too_many_tokens"):
        token_edges(np.frombuffer(b"1 2 3 4", np.uint8))


@pytest.mark.parametrize("at", [0, 5, BLOCK - 2, BLOCK - 1, BLOCK, 2 * BLOCK - 1, 2 * BLOCK + 7])
def test_what_is_searched_by_blocks_is_found_wherever_it_is(at: int) -> None:
    data = bytearray(b" " * (2 * BLOCK + 10))
    assert not holds(bytes(data), b"ab\n")
    data[at : at + 3] = b"ab\n"
    assert holds(bytes(data), b"ab\n")
    assert occurrences(bytes(data), b"b") == 1
