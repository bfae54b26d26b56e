"""Every problem code of the service is provoked through the client, and explained to its users.

The codes are read from the source, so that a new one without a test fails, and so does a test or a
row of `docs/problems.md` of one that is no more.
"""

from __future__ import annotations

import re
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
from provoke import BOX, PROVOKED, client_of, refused
from provoke_codes import Codes
from provoke_source import Source

from service.client import ShapeClient
from service.client.errors import ProblemError
from service.main import create_app
from service.settings import Settings

HERE = Path(__file__).parent
PAGE = HERE.parent.parent / "docs" / "problems.md"
ROW = re.compile(r"^\| `(\w+)` \| (?:([\d, ]+) \| )?.+ \|$", re.MULTILINE)
HEADING = "## In Python alone"

OPTIONS = {
    "count_out_of_range": "count",
    "seed_out_of_range": "seed",
    "strength_out_of_range": "strength",
    "unknown_format": "format",
    "unknown_front": "front",
    "unknown_mode": "mode",
    "unknown_position": "position",
    "unknown_rig": "joint_names",
    "unknown_size": "size",
    "unknown_units": "units",
    "unknown_up": "up",
}
"""Told by the pipeline of an option whose values the form knows and has checked before."""

PATHS = {
    "joint_names": "/sliders",
    **dict.fromkeys(("size", "position"), "/transfer"),
    **dict.fromkeys(("count", "seed", "strength"), "/augment"),
}
"""Where an option is one of another call than `/edit`."""

UNREACHED = {
    **{code: f"a form says field_invalid of {field}" for code, field in OPTIONS.items()},
    "no_models": "without any model all answers are model_fault",
    "no_skeleton": "no call asks for a skeleton by itself",
}
"""Codes that no answer has, for callers of `service.pipeline`; and why."""


@pytest.fixture(scope="module")
def codes() -> frozenset[str]:
    """All that there are."""
    return frozenset(Codes(Source()).found())


@pytest.fixture(scope="module")
def provoked() -> dict[str, set[int]]:
    """Statuses by code of all that the modules beside this one provoke."""
    for path in HERE.glob("test_problems_of_*.py"):
        import_module(path.stem)
    return PROVOKED


def test_every_code_is_provoked_and_no_other(
    codes: frozenset[str], provoked: dict[str, set[int]]
) -> None:
    assert not codes - provoked.keys() - UNREACHED.keys(), "no test provokes them"
    assert not provoked.keys() - codes, "the service has no such code"
    assert not UNREACHED.keys() - codes, "the service has no such code"
    assert not UNREACHED.keys() & provoked.keys(), "they can be reached"


def test_every_code_is_explained(codes: frozenset[str], provoked: dict[str, set[int]]) -> None:
    answered, _, others = PAGE.read_text("utf-8").partition(HEADING)
    rows = ROW.findall(answered)
    told = {
        code: {int(status) for status in statuses.split(", ") if status} for code, statuses in rows
    }
    assert len(told) == len(rows), "a code has two rows"
    assert not (codes - UNREACHED.keys()) ^ told.keys()
    assert told == {code: provoked[code] - {200} for code in told}
    assert sorted(code for code, _ in ROW.findall(others)) == sorted(UNREACHED)


def test_the_client_knows_of_no_other_code(codes: frozenset[str]) -> None:
    assert not ProblemError.by_code.keys() - codes


@pytest.fixture(scope="module")
def boxes(serving: Any) -> Any:
    with serving(create_app(Settings(categories=("debug",), workers=1))) as http:
        yield client_of(http)


@pytest.mark.parametrize("field", sorted(OPTIONS.values()))
def test_options_are_checked_by_the_form(boxes: ShapeClient, field: str) -> None:
    path = PATHS.get(field, "/edit")
    files = dict.fromkeys(("source", "target") if path == "/transfer" else ("mesh",), BOX)
    fields = {field: "-1"} | ({"edits": "{}"} if path == "/edit" else {})
    refusal = refused(lambda: boxes.post(path, files=files, fields=fields))
    assert refusal.code == "field_invalid"
    assert field in refusal.detail
