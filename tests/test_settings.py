from __future__ import annotations

from pathlib import Path

import pytest
from pydantic import ValidationError

from service.settings import Settings

NAMES = [
    "HOST",
    "PORT",
    "MODELS_DIR",
    "BODY_MODEL",
    "MAX_UPLOAD_BYTES",
    "MESH_CACHE_BYTES",
    "WORKERS",
    "DEADLINE_SECONDS",
    "LOG_LEVEL",
]


@pytest.fixture(autouse=True)
def _bare_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in NAMES:
        monkeypatch.delenv(name, raising=False)


def test_the_defaults_serve_this_machine_only() -> None:
    settings = Settings()
    assert (settings.host, settings.port) == ("127.0.0.1", 8000)
    assert settings.max_upload_bytes == 134217728
    assert settings.mesh_cache_bytes == 268435456
    assert settings.models_dir is None
    assert settings.body_model is None
    assert settings.workers is None
    assert settings.deadline_seconds == 30


def test_the_environment_sets_them(monkeypatch: pytest.MonkeyPatch) -> None:
    values = ["0.0.0.0", "80", "/m", "/b.npz", "5", "0", "3", "2.5", "DEBUG"]
    for name, value in zip(NAMES, values, strict=True):
        monkeypatch.setenv(name, value)
    assert Settings() == Settings(
        host="0.0.0.0",
        port=80,
        models_dir=Path("/m"),
        body_model=Path("/b.npz"),
        max_upload_bytes=5,
        mesh_cache_bytes=0,
        workers=3,
        deadline_seconds=2.5,
        log_level="debug",
    )
    assert Settings().models_dir == Path("/m")


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("PORT", "65536"),
        ("MAX_UPLOAD_BYTES", "0"),
        ("WORKERS", "0"),
        ("DEADLINE_SECONDS", "0"),
        ("LOG_LEVEL", "loud"),
    ],
)
def test_a_value_that_makes_no_sense_is_refused(
    monkeypatch: pytest.MonkeyPatch, name: str, value: str
) -> None:
    monkeypatch.setenv(name, value)
    with pytest.raises(ValidationError, match=name.lower()):
        Settings()


def test_each_setting_is_explained() -> None:
    assert [name.upper() for name in Settings.model_fields] == NAMES
    assert all(field.description for field in Settings.model_fields.values())
