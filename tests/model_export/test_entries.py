from __future__ import annotations

from typing import Any

import pytest
import yaml

from model_export.entries import find_entry_mistakes
from model_export.mistakes import Mistake
from model_export.new import starter


@pytest.fixture
def spec() -> Any:
    """The starter's entries, to spoil."""
    return yaml.safe_load(starter("table", "table.yaml"))


def told(mistakes: list[Mistake], entry: str) -> Mistake:
    (mistake,) = [m for m in mistakes if m.entry == entry]
    return mistake


def test_a_sound_file_has_none(spec: Any) -> None:
    assert find_entry_mistakes(spec) == []


@pytest.mark.parametrize(
    ("entry", "change", "text"),
    [
        ("parts top", {"size": ["top_width * top_depth", 1, 1]}, "product of parameters"),
        ("parts top", {"size": ["1 / top_width", 1, 1]}, "dividing by a parameter"),
        ("parts top", {"size": ["top_widht", 1, 1]}, "list it under `parameters`"),
        ("parts top", {"size": ["top_width +", 1, 1]}, "use numbers, parameter names"),
        ("parts top", {"shape": "cone"}, "no shape is named 'cone'"),
        ("parts top", {"hidden": ["roof"]}, "no side is named 'roof'"),
        ("parameters leg_height", {"range": [0.9, 0.2]}, "the smaller first"),
        ("parameters leg_height", {"range": [-1, 0.2]}, "not positive"),
        ("derived total_width", {"by": ["width"]}, "`by` lists names of parameters"),
    ],
)
def test_an_entry_that_can_not_be_compiled_is_named(
    spec: Any, entry: str, change: dict[str, Any], text: str
) -> None:
    section, name = entry.split()
    spec[section][name].update(change)
    mistakes = find_entry_mistakes(spec)
    assert text in told(mistakes, entry).text
    assert len(mistakes) == 1


def test_all_bad_entries_are_told_at_once(spec: Any) -> None:
    spec["parameters"]["top_width"]["range"] = [2, 1]
    spec["parts"]["top"]["size"][0] = "width"
    spec["keep"]["floor"][1] = "leg_height ** 2"
    spec["relations"].append("top_width > leg")
    entries = [mistake.entry for mistake in find_entry_mistakes(spec)]
    assert entries == [
        "parameters top_width",
        "parts top",
        "relations 3 (top_width > leg)",
        "keep floor",
    ]


@pytest.mark.parametrize("name", ["name", "label", "points", "parameters", "parts", "keep"])
def test_what_is_missing_is_named(spec: Any, name: str) -> None:
    del spec[name]
    assert told(find_entry_mistakes(spec), name).error
    spec[name] = {}
    assert told(find_entry_mistakes(spec), name).error


@pytest.mark.parametrize("spec", [None, [], "text", 3])
def test_a_file_of_another_form(spec: Any) -> None:
    assert told(find_entry_mistakes(spec), "the file").error


@pytest.mark.parametrize("name", ["Table", "a b", "auto"])
def test_a_name_that_can_not_be_used(spec: Any, name: str) -> None:
    assert told(find_entry_mistakes({**spec, "name": name}), "name").error
