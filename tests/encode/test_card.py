from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from service.encode.card import read_card
from service.encode.model import SHIPPED
from service.errors import ModelFault

CARD: dict[str, Any] = {
    "name": "stool",
    "version": "1.0.0",
    "digest": "sha256-00",
    "discriminator": {"digest": "sha256-01"},
    "calibration": {"limit_distance": 0.02, "limit_odds": 1.0, "sigma_scale": {"height": 0.5}},
    "metrics": {"anything": "else"},
}


def write(folder: Path, card: Any) -> Path:
    path = folder / "stool.json"
    path.write_text(card if isinstance(card, str) else json.dumps(card), "utf-8")
    return path


def test_a_card_is_read_whole(tmp_path: Path) -> None:
    assert read_card(write(tmp_path, CARD)) == CARD


def test_the_shipped_cards_are_sound() -> None:
    for path in SHIPPED.glob("*.json"):
        assert read_card(path)["name"] == path.stem


@pytest.mark.parametrize(
    ("change", "entry"),
    [
        ({"name": None}, "name"),
        ({"name": "a@b"}, "name"),
        ({"name": "../chair"}, "name"),
        ({"name": ""}, "name"),
        ({"version": 1.0}, "version"),
        ({"version": "1 0"}, "version"),
        ({"version": "1@2"}, "version"),
        ({"version": "1" * 61}, "version"),
        ({"digest": 7}, "digest"),
        ({"golden": ["x"]}, "golden.0"),
        ({"discriminator": {}}, "discriminator.digest"),
        ({"mesh_encoder": {}}, "mesh_encoder.digest"),
        ({"calibration": {}}, "calibration.limit_distance"),
        ({"calibration": {"limit_distance": 0, "limit_odds": 1}}, "calibration.limit_distance"),
        ({"calibration": {"limit_distance": 1, "limit_odds": "nan"}}, "calibration.limit_odds"),
        (
            {"calibration": {"limit_distance": 1, "limit_odds": 1, "sigma_scale": {"a": -1}}},
            "calibration.sigma_scale.a",
        ),
    ],
)
def test_an_entry_that_makes_no_sense_is_named(tmp_path: Path, change: Any, entry: str) -> None:
    with pytest.raises(ModelFault) as caught:
        read_card(write(tmp_path, CARD | change))
    assert caught.value.code == "model_unreadable"
    assert caught.value.detail.startswith(f"stool.json can't be loaded: {entry}: ")


@pytest.mark.parametrize("text", ["", "{", "[]", "7", "\ufeff{}", "[" * 100_000])
def test_what_is_no_object_is_refused(tmp_path: Path, text: str) -> None:
    with pytest.raises(ModelFault) as caught:
        read_card(write(tmp_path, text))
    assert caught.value.detail.startswith("stool.json can't be loaded: ")


def test_a_missing_card_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ModelFault):
        read_card(tmp_path / "stool.json")
