"""What an operator can set, by environment variables of the same names in capitals."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, PositiveFloat, PositiveInt
from pydantic_settings import BaseSettings, SettingsConfigDict

MEBIBYTE = 1024 * 1024

LogLevel = Literal["critical", "error", "warning", "info", "debug"]


def _lower(value: object) -> object:
    return value.lower() if isinstance(value, str) else value


class Settings(BaseSettings):
    """The service's settings; pydantic's ValidationError for a value that makes no sense."""

    model_config = SettingsConfigDict(env_prefix="", use_attribute_docstrings=True, frozen=True)

    host: str = "127.0.0.1"
    """Address to listen on; 0.0.0.0 is every interface."""

    port: int = Field(default=8000, ge=0, le=65535)
    """Port to listen on; 0 takes a free one."""

    models_dir: Path | None = None
    """Folder of models of your own, as `model_export.export` writes them: served beside the shipped
    ones, in place of one of the same name. SIGHUP reads it anew."""

    body_model: Path | None = None
    """File of a body of your own in SMPL's format, .npz or .pkl, for human bodies to be fitted by
    in place of the shipped one; it is read when the service starts."""

    max_upload_bytes: PositiveInt = 128 * MEBIBYTE
    """Largest request body, in bytes; more is answered with 413."""

    mesh_cache_bytes: int = Field(default=256 * MEBIBYTE, ge=0)
    """Memory for meshes that requests name by `mesh_id`, in bytes; the least recently used go."""

    workers: PositiveInt | None = None
    """Threads that infer and edit; by default one for every CPU that the process may use."""

    deadline_seconds: PositiveFloat = 30.0
    """Longest work on one request, in seconds, not counting its wait for a worker; a mesh that
    takes more is answered with 422, and with 503 when it was the machine that was busy."""

    log_level: Annotated[LogLevel, BeforeValidator(_lower)] = "info"
    """Least severity that is logged."""
