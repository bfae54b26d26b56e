from __future__ import annotations

from pathlib import Path

import pytest
from own_templates import write_stool

from service.cli.local import Local
from service.cli.names import categories, vocabulary
from service.shipped import usual_categories


@pytest.mark.parametrize("name", ["chair", "airplane", "human", "debug"])
def test_the_names_are_those_of_the_models(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CATEGORIES", name)
    entry, found = Local().category(name), vocabulary(name)
    assert list(found.parameters) == [parameter["name"] for parameter in entry["parameters"]]
    assert list(found.keeps) == entry["keep"]


def test_all_of_them_where_no_category_is_said() -> None:
    every = vocabulary(None)
    assert {"seat_width", "wing_length", "left_elbow_y", "stature"} <= set(every.parameters)
    assert vocabulary("auto") == every
    assert vocabulary("chair@1.0.0") == vocabulary("chair")
    assert vocabulary("zebra").parameters == {}


def test_ones_own_categories_are_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_stool(tmp_path / "mine")
    monkeypatch.setenv("MODELS_DIR", str(tmp_path))
    assert categories() == sorted([*usual_categories(), "stool"])
    assert vocabulary("stool").parameters == {"leg_length": "Length of the legs"}
    (tmp_path / "mine" / "stool.yaml").write_text("[", "utf-8")
    assert vocabulary("stool").parameters == {}
    (tmp_path / "mine" / "stool.json").write_text("{", "utf-8")
    assert vocabulary("stool").parameters == {}
