from __future__ import annotations

import pytest

from service.client.sse import Message, Parser

LINES = [": a comment", "id: 1", "event: status", "data: {é}", "data:  more", "", "data:x", "", ""]
TOLD = [Message("1", "status", "{é}\n more"), Message("1", "message", "x")]


def read(*chunks: bytes) -> list[Message]:
    parser = Parser()
    return [message for chunk in chunks for message in parser.feed(chunk)]


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("size", [1, 2, 3, 1000])
def test_lines_end_in_three_ways_and_chunks_anywhere(end: str, size: int) -> None:
    text = "".join(line + end for line in LINES).encode()
    # After a lone CR the next byte tells whether it was half of a CRLF.
    chunks = [text[at : at + size] for at in range(0, len(text), size)]
    assert read(*chunks, b":\n") == TOLD


def test_a_byte_order_mark_is_none_of_it() -> None:
    assert read(b"\xef\xbb", b"\xbfdata: x\n\n") == [Message(None, "message", "x")]


def test_broken_utf8_breaks_nothing() -> None:
    assert read(b"data: \xff\n\n") == [Message(None, "message", "�")]


def test_what_is_not_whole_is_not_told() -> None:
    assert read(b"data: x\n") == []


def test_events_without_data_are_none() -> None:
    assert read(b"event: status\n\n: only a comment\n\ndata\n\n") == [Message(None, "message", "")]


def test_ids_stay_until_another() -> None:
    messages = read(b"id: 1\ndata: a\n\ndata: b\n\nid: x\0y\ndata: c\n\nid\ndata: d\n\n")
    assert [message.id for message in messages] == ["1", "1", "1", ""]


def test_the_service_says_when_to_come_again() -> None:
    parser = Parser()
    assert parser.retry_ms is None
    for line, expected in ((b"retry: 2000\n", 2000), (b"retry: soon\n", 2000), (b"retry:5\n", 5)):
        assert list(parser.feed(line)) == []
        assert parser.retry_ms == expected
