from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from service.encode.versions import choose, explain_unknown, full_name, newest_first
from service.errors import InvalidRequest, NotFound


def model(name: str = "chair", version: str = "1.0.0", recognised: bool = True) -> Any:
    return SimpleNamespace(name=name, version=version, recognised=recognised)


def test_a_full_name_has_the_version() -> None:
    assert full_name(model()) == "chair@1.0.0"


def test_versions_are_compared_as_numbers_and_others_come_last() -> None:
    versions = ["1.9.0", "rc-final", "1.10.0", "2.0.0rc1", "2.0.0", "1.10.0+b"]
    ordered = newest_first(model(version=version) for version in versions)
    assert [own.version for own in ordered] == [
        "2.0.0",
        "2.0.0rc1",
        "1.10.0+b",
        "1.10.0",
        "1.9.0",
        "rc-final",
    ]


@pytest.fixture
def models() -> dict[str, Any]:
    """Two versions of a chair, the older one the default, and a debug model."""
    old, new, debug = model(), model(version="2"), model("debug", "1", recognised=False)
    return {
        "chair": old,
        "debug": debug,
        "chair@2": new,
        "chair@1.0.0": old,
        "debug@1": debug,
    }


def test_a_category_is_its_default_and_a_full_name_one_version(models: Any) -> None:
    assert choose(models, "chair") == [models["chair@1.0.0"]]
    assert choose(models, "chair@2") == [models["chair@2"]]
    assert choose(models, "debug") == [models["debug"]]


def test_auto_is_each_default_once_and_never_debug_beside_others(models: Any) -> None:
    assert choose(models, "auto") == [models["chair"]]
    alone = {name: own for name, own in models.items() if own.name == "debug"}
    assert choose(alone, "auto") == [models["debug"]]


@pytest.mark.parametrize(
    ("name", "detail", "names"),
    [
        ("sofa", "There is no category 'sofa'.", "chair, debug"),
        ("sofa@1", "There is no category 'sofa@1'.", "chair, debug"),
        ("chair@3", "There is no version '3' of chair.", "chair@2, chair@1.0.0"),
        ("chair@", "There is no version '' of chair.", "chair@2, chair@1.0.0"),
        ("@1", "There is no category '@1'.", "chair, debug"),
    ],
)
def test_another_name_is_refused_with_those_that_come_nearest(
    models: Any, name: str, detail: str, names: str
) -> None:
    assert explain_unknown(models, name) == (detail, names)
    with pytest.raises(InvalidRequest) as caught:
        choose(models, name)
    assert caught.value.code == "unknown_category"
    assert caught.value.detail == detail
    assert caught.value.suggestion == f"Use one of {names}, or auto."


def test_without_models_there_is_nothing_to_choose() -> None:
    with pytest.raises(NotFound) as caught:
        choose({}, "auto")
    assert caught.value.code == "no_models"
