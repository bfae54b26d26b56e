from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from service.encode.installed import Installed


def model(version: str, name: str = "chair") -> Any:
    return SimpleNamespace(name=name, version=version)


OLD, NEW, SHIPPED, STOOL = model("1.9"), model("1.10"), model("2.0"), model("1", "stool")


def chair_of(installed: Installed) -> str:
    return installed.models["chair"].version


@pytest.mark.parametrize(
    ("own", "defaults", "expected"),
    [
        ([], {}, "2.0"),
        ([OLD], {}, "1.9"),
        ([OLD, NEW], {}, "1.10"),
        ([OLD, NEW], {"chair": "1.9"}, "1.9"),
        ([OLD, NEW], {"chair": "2.0"}, "2.0"),
        ([OLD], {"chair": "7"}, "1.9"),
    ],
)
def test_own_versions_go_before_shipped_ones_and_settings_before_all(
    own: Any, defaults: Any, expected: str
) -> None:
    assert chair_of(Installed.of([SHIPPED, STOOL], own, defaults)) == expected


def test_an_own_model_stands_in_for_the_shipped_one_of_its_version() -> None:
    own = model("2.0")
    installed = Installed.of([SHIPPED], [own], {})
    assert installed.models["chair"] is own
    assert installed.versions == {"chair": (own,)}


def test_all_versions_can_be_named() -> None:
    installed = Installed.of([SHIPPED, STOOL], [OLD, NEW], {})
    assert installed.versions["chair"] == (SHIPPED, NEW, OLD)
    assert installed.named == {
        "chair": NEW,
        "stool": STOOL,
        "chair@2.0": SHIPPED,
        "chair@1.10": NEW,
        "chair@1.9": OLD,
        "stool@1": STOOL,
    }
    assert installed.names == ["chair", "chair@1.10", "chair@1.9", "chair@2.0", "stool"]


def test_a_default_that_is_not_there_is_a_fault() -> None:
    fault = Installed.of([SHIPPED], [OLD], {"chair": "7"}).faults[0]
    assert fault.code == "default_missing"
    assert fault.detail == (
        "DEFAULT_MODELS names chair=7, which is not served; chair@1.9 is the default instead"
    )
    assert "2.0, 1.9" in fault.suggestion
    earlier: Any = "an earlier one"
    installed = Installed.of([SHIPPED], [], {"table": "1"}, [earlier])
    assert installed.faults[0] is earlier
    assert "no model of table is served" in installed.faults[1].detail
