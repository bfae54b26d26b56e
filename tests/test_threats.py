"""The threat model names the tests that show its claims: they must be there."""

from __future__ import annotations

import ast
import re
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
TEXT = (ROOT / "docs/threats.md").read_text("utf-8")
NAMED = sorted(set(re.findall(r"`(tests/[\w/]+\.py)::(\w+)`", TEXT)))


@cache
def functions_of(path: str) -> frozenset[str]:
    tree = ast.parse((ROOT / path).read_text("utf-8"))
    return frozenset(node.name for node in tree.body if isinstance(node, ast.FunctionDef))


@pytest.mark.parametrize(("path", "name"), NAMED)
def test_it_is_there(path: str, name: str) -> None:
    assert name.startswith("test_")
    assert name in functions_of(path)


def test_every_defence_names_one() -> None:
    rows = re.findall(r"^\| (?!\*\*|against|-)(.+) \|$", TEXT, re.MULTILINE)
    assert len(rows) > 30
    for row in rows:
        _, how, shown = (cell.strip() for cell in row.split(" | "))
        assert how
        assert re.fullmatch(r"(`tests/[\w/]+\.py::\w+`(, )?)+", shown), row


def test_every_mention_of_a_test_is_whole() -> None:
    assert len(re.findall(r"::", TEXT)) == len(re.findall(r"`tests/[\w/]+\.py::\w+`", TEXT))
