"""The search for codes finds them however they are said, and owns up to what it can't follow."""

from __future__ import annotations

from pathlib import Path

import pytest
from provoke_codes import Codes
from provoke_source import Source

ERRORS = """
class ShapeError(Exception):
    def __init__(self, code, detail): ...
class NotFound(ShapeError): ...
class Gone(NotFound): ...
class Problem:
    def __init__(self, status, code, detail): ...
"""


IMPORTS = """
from service import errors
from service.errors import Gone, NotFound, Problem
"""


def codes(folder: Path, text: str) -> set[str]:
    """Those of a service of two modules."""
    service = folder / "service"
    service.mkdir()
    (service / "errors.py").write_text(ERRORS, "utf-8")
    (service / "nouns.py").write_text(IMPORTS + text, "utf-8")
    (service / "else.py").write_text('raise NotFound("elsewhere", "b")', "utf-8")
    return set(Codes(Source(folder, ["service/nouns.py"])).found())


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ('raise NotFound("a", "b")', {"a"}),
        ('raise errors.Gone(code="a", detail="b")', {"a"}),
        ('Problem(404, "a", "b")', {"a"}),
        ('raise NotFound("a" if x else "b", "c")', {"a", "b"}),
        (
            'def f(part):\n    raise NotFound(f"{part}_gone", "b")\nf("a")\nf(part="b")',
            {"a_gone", "b_gone"},
        ),
        (
            'def f():\n    for name, _ in (("a", 1), ("b", 2)):\n        raise Gone(name, "c")',
            {"a", "b"},
        ),
        (
            'TOLD = {1: ("a", "x"), 2: ("b", "y")}\n'
            "def f(status):\n    code, detail = TOLD[status]\n    Problem(status, code, detail)",
            {"a", "b"},
        ),
        (
            'def g(n):\n    return ("a", "x") if n else ("b", "y")\n'
            "def f():\n    code, detail = g(1)\n    raise Gone(code, detail)",
            {"a", "b"},
        ),
        (
            "class Failure:\n    name: str\n    code: str\n"
            'def f(error):\n    own = error.code, error.detail\n    Failure("x", *own)\n'
            'Failure("x", "a")',
            {"a"},
        ),
        ("def f(error):\n    raise NotFound(error.code, error.detail)", set()),
    ],
)
def test_codes_are_found(tmp_path: Path, text: str, found: set[str]) -> None:
    assert codes(tmp_path, text) == found


@pytest.mark.parametrize(
    "code",
    ['"a".lower()', "unheard_of()", 'CODES["a"]', "", "12", 'f"{len(x)}"', "state.code_name"],
)
def test_what_can_not_be_followed_is_said(tmp_path: Path, code: str) -> None:
    with pytest.raises((LookupError, AssertionError)):
        codes(tmp_path, f"def f(x):\n    raise NotFound({code})")


def test_a_class_with_a_code_of_its_own_is_said(tmp_path: Path) -> None:
    text = 'class Lost(NotFound):\n    def __init__(self):\n        super().__init__("a", "b")'
    with pytest.raises(AssertionError, match="Lost"):
        codes(tmp_path, text)
