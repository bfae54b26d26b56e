from __future__ import annotations

from pathlib import Path

import pytest
from pydantic import SecretStr, ValidationError

from service.settings import Settings

GIVEN = {
    "HOST": "0.0.0.0",
    "PORT": "80",
    "MODELS_DIR": "/m",
    "BODY_MODEL": "/b.npz",
    "CATEGORIES": "human, chair",
    "DEFAULT_MODELS": "chair=1.0.0, human=2",
    "MAX_UPLOAD_BYTES": "5",
    "MAX_VERTICES": "6",
    "MESH_CACHE_BYTES": "0",
    "INFERENCE_CACHE_BYTES": "9",
    "STORE_DIR": "/s",
    "STORE_BYTES": "7",
    "STORE_URL": "s3://bucket",
    "JOBS_DIR": "/j",
    "JOBS": "11",
    "JOBS_BYTES": "12",
    "JOB_SECONDS": "13",
    "API_KEYS": "a:0",
    "API_KEYS_FILE": "/k",
    "CORS_ORIGINS": "https://a.example, http://b.example:8080/",
    "WORKERS": "3",
    "QUEUE": "0",
    "MAX_PENDING_BYTES": "8",
    "DEADLINE_SECONDS": "2.5",
    "MAX_CONNECTIONS": "4",
    "KEEP_ALIVE_SECONDS": "70",
    "HEADER_SECONDS": "1.5",
    "BODY_SECONDS": "3.5",
    "DRAIN_SECONDS": "0",
    "GRACE_SECONDS": "10",
    "LOG_LEVEL": "DEBUG",
    "LOG_FORMAT": "Text",
}
"""Every setting in its place, and a value of it."""


@pytest.fixture(autouse=True)
def _bare_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in GIVEN:
        monkeypatch.delenv(name, raising=False)


def test_the_defaults_serve_this_machine_only() -> None:
    settings = Settings()
    assert (settings.host, settings.port) == ("127.0.0.1", 8000)
    assert settings.max_upload_bytes == 134217728
    assert settings.max_vertices is None
    assert settings.mesh_cache_bytes is None
    assert settings.inference_cache_bytes is None
    assert settings.store_dir is None
    assert settings.store_bytes == 1073741824
    assert settings.store_url is None
    assert settings.jobs_dir is None
    assert settings.jobs == 100
    assert settings.jobs_bytes is None
    assert settings.job_seconds == 86400
    assert settings.models_dir is None
    assert settings.body_model is None
    assert settings.categories == ("airplane", "chair", "human")
    assert settings.default_models == {}
    assert settings.api_keys.get_secret_value() == ""
    assert settings.api_keys_file is None
    assert settings.cors_origins == ()
    assert settings.workers is None
    assert settings.deadline_seconds == 30


def test_the_environment_sets_them(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in GIVEN.items():
        monkeypatch.setenv(name, value)
    assert Settings() == Settings(
        host="0.0.0.0",
        port=80,
        models_dir=Path("/m"),
        body_model=Path("/b.npz"),
        categories=("human", "chair"),
        default_models={"chair": "1.0.0", "human": "2"},
        max_upload_bytes=5,
        max_vertices=6,
        mesh_cache_bytes=0,
        inference_cache_bytes=9,
        store_dir=Path("/s"),
        store_bytes=7,
        store_url=SecretStr("s3://bucket"),
        jobs_dir=Path("/j"),
        jobs=11,
        jobs_bytes=12,
        job_seconds=13,
        api_keys=SecretStr("a:0"),
        api_keys_file=Path("/k"),
        cors_origins=("https://a.example", "http://b.example:8080"),
        workers=3,
        queue=0,
        max_pending_bytes=8,
        deadline_seconds=2.5,
        max_connections=4,
        keep_alive_seconds=70,
        header_seconds=1.5,
        body_seconds=3.5,
        drain_seconds=0,
        grace_seconds=10,
        log_level="debug",
        log_format="text",
    )
    assert Settings().models_dir == Path("/m")


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("PORT", "65536"),
        ("CATEGORIES", "chair,sofa"),
        ("DEFAULT_MODELS", "chair"),
        ("MAX_UPLOAD_BYTES", "0"),
        ("CORS_ORIGINS", "shapes.example"),
        ("MESH_CACHE_BYTES", "-1"),
        ("STORE_BYTES", "0"),
        ("WORKERS", "0"),
        ("DEADLINE_SECONDS", "0"),
        ("LOG_LEVEL", "loud"),
        ("LOG_FORMAT", "xml"),
    ],
)
def test_a_value_that_makes_no_sense_is_refused(
    monkeypatch: pytest.MonkeyPatch, name: str, value: str
) -> None:
    monkeypatch.setenv(name, value)
    with pytest.raises(ValidationError, match=name.lower()):
        Settings()


def test_each_setting_is_explained() -> None:
    assert [name.upper() for name in Settings.model_fields] == list(GIVEN)
    assert all(field.description for field in Settings.model_fields.values())
