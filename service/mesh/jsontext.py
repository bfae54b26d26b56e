"""Replace single values inside JSON text; every other character stays."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from typing import Any

Path = tuple[str | int, ...]

# White space, and the byte order mark that may begin the text.
BLANK = re.compile("[ \t\r\n\ufeff]*")
# Half a pair, which JSON may hold as an escape and UTF-8 can't hold at all.
SURROGATE = re.compile("[\ud800-\udfff]")
# Stands for the place behind an array's last item.
END = -1


def splice(text: str, edits: Mapping[Path, object]) -> str:
    """`text` with the values at some paths set.

    Args:
        text: a JSON document, known to parse.
        edits: a new value for each path of member names and array positions.  A member that is
            not there yet is added to its object; `END` in place of an array position takes a
            list of items to add.  No path may lead through another.

    Returns:
        The new text.  New values are written compactly, at the place of the old.
    """
    tree: dict[str | int, Any] = {}
    for path, value in edits.items():
        branch = tree
        for step in path[:-1]:
            branch = branch.setdefault(step, {})
        branch[path[-1]] = Leaf(value)
    pieces: list[tuple[int, int, str]] = []
    _value(text, _skip(text, 0), tree, pieces)
    result: list[str] = []
    done = 0
    for start, end, new in pieces:
        result += (text[done:start], new)
        done = end
    return "".join([*result, text[done:]])


class Leaf:
    """The value to set at the end of a path."""

    def __init__(self, value: object) -> None:
        self.value = value

    def __str__(self) -> str:
        return dump(self.value)


def dump(value: object) -> str:
    """Compact JSON."""
    text = json.dumps(value, ensure_ascii=False, separators=(",", ":"))
    if text.isascii() or not SURROGATE.search(text):
        return text
    return json.dumps(value, separators=(",", ":"))


def _skip(text: str, at: int) -> int:
    match = BLANK.match(text, at)
    return match.end() if match else at


_decode = json.JSONDecoder().raw_decode


def _value(text: str, at: int, tree: Any, pieces: list[tuple[int, int, str]]) -> int:
    """Walk the value at `at`; return where it ends."""
    if isinstance(tree, dict) and text[at] in "{[":
        return _container(text, at, tree, pieces)
    end: int = _decode(text, at)[1]
    if isinstance(tree, Leaf):
        pieces.append((at, end, str(tree)))
    return end


def _container(
    text: str, at: int, tree: dict[str | int, Any], pieces: list[tuple[int, int, str]]
) -> int:
    named = text[at] == "{"
    close = "}" if named else "]"
    left = dict(tree)
    position = 0
    at = end = at + 1
    while text[at := _skip(text, at)] != close:
        if text[at] == ",":
            at = _skip(text, at + 1)
        step: str | int = position
        if named:
            step, at = _decode(text, at)
            at = _skip(text, _skip(text, at) + 1)
        left.pop(step, None)
        at = end = _value(text, at, tree.get(step), pieces)
        position += 1
    added = _added(left, named)
    if added:
        pieces.append((end, end, "," + added if position else added))
    return at + 1


def _added(left: dict[str | int, Any], named: bool) -> str:
    """The members or items to add behind the last one."""
    if named:
        return ",".join(f"{dump(name)}:{leaf}" for name, leaf in left.items())
    items = left[END].value if END in left else []
    return ",".join(dump(item) for item in items)
