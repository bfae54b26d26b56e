"""What an operator can set, by environment variables of the same names in capitals."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import (
    BeforeValidator,
    Field,
    NonNegativeFloat,
    NonNegativeInt,
    PositiveFloat,
    PositiveInt,
    SecretStr,
)
from pydantic_settings import BaseSettings, NoDecode, SettingsConfigDict

from service.budget import MEBIBYTE
from service.defaults import named_versions
from service.logs import LogFormat
from service.origins import origins
from service.shipped import asked_categories, usual_categories

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
    """Folder of models of your own, as `model_export.export` writes them, and of folders of such,
    for several versions: served beside the shipped ones, and by default in place of one of the same
    name. SIGHUP reads it anew."""

    body_model: Path | None = None
    """File of a body of your own in SMPL's format, .npz or .pkl, for human bodies to be fitted by
    in place of the shipped one; it is read when the service starts."""

    categories: Annotated[tuple[str, ...], NoDecode, BeforeValidator(asked_categories)] = Field(
        default_factory=usual_categories
    )
    """Categories that come with the service to be served, with commas between: fewer take less
    memory. By default all but `debug`, which is for tests of clients; `none` serves only those of
    MODELS_DIR."""

    default_models: Annotated[dict[str, str], NoDecode, BeforeValidator(named_versions)] = Field(
        default_factory=dict
    )
    """Versions of models to be used where a client names none, such as `chair=1.0.0,human=1.1.0`;
    by default one of MODELS_DIR before a shipped one, and the highest of several."""

    max_upload_bytes: PositiveInt = 128 * MEBIBYTE
    """Largest request body, in bytes; more is answered with 413."""

    max_vertices: PositiveInt | None = None
    """Vertices of the largest mesh that is taken, which may have twice as many faces; more is
    answered with 413. By default what fits into the memory beside the caches, with every worker at
    such a mesh; never more than two million."""

    mesh_cache_bytes: NonNegativeInt | None = None
    """Memory for meshes that requests name by `mesh_id`, in bytes; the least recently used go. By
    default 256 MiB, or an eighth of the memory that the container may use if that is less."""

    inference_cache_bytes: NonNegativeInt | None = None
    """Memory for what was found of meshes - what they are, their parameters, what moves with
    what - in bytes, so that further edits of one take a tenth of the time; the least recently used
    goes. By default as for MESH_CACHE_BYTES."""

    store_dir: Path | None = None
    """Folder for the same meshes, which are then found again after a restart; it is made if there
    is none. Without it and JOBS_DIR, nothing is ever written to a disk."""

    store_bytes: PositiveInt = 1024 * MEBIBYTE
    """Disk for them there, in bytes; the least recently used go."""

    store_url: SecretStr | None = None
    """Where replicas share the same meshes, in fsspec's terms: `s3://bucket/prefix`,
    `file:///folder`; it needs the extra `shared`."""

    jobs_dir: Path | None = None
    """Folder for jobs - what clients ask for with `Prefer: respond-async` - which then outlive a
    restart; several services of one machine may share it. By default STORE_DIR's `jobs`; without
    either they are kept in memory."""

    jobs: PositiveInt = 100
    """Jobs that may be waiting or in work, half of them of one API key's owner; what comes beyond
    is answered with 429."""

    jobs_bytes: PositiveInt | None = None
    """What jobs and their results may take, in bytes, half of it of one API key's owner; what does
    not fit is answered with 429, or 413 if it never will. By default 1 GiB in a folder; in
    memory 256 MiB, or a 64th of what the container may use if that is less."""

    job_seconds: PositiveFloat = 86400.0
    """How long a job and its result are kept after its end, in seconds."""

    api_keys: SecretStr = SecretStr("")
    """Whom to serve: `NAME:SHA256` of each API key, with commas or newlines between, as
    `python -m service.newkey NAME` prints it; without any, everyone is served."""

    api_keys_file: Path | None = None
    """File of more such entries, one a line; `#` begins a comment. SIGHUP reads it anew."""

    cors_origins: Annotated[tuple[str, ...], NoDecode, BeforeValidator(origins)] = ()
    """Origins whose pages may call from a browser, with commas between, such as
    `https://shapes.example`; `*` lets in all, and by default there are none."""

    workers: PositiveInt | None = None
    """Threads that infer and edit; by default one for every CPU that the process may use."""

    queue: NonNegativeInt | None = None
    """Requests that may wait for a worker; by default one for every two. What comes beyond is
    answered with 429, and when to come again."""

    max_pending_bytes: PositiveInt | None = None
    """Request bodies held at once, in bytes, but for a single one that is larger; what comes beyond
    is answered with 429. By default as for MESH_CACHE_BYTES."""

    deadline_seconds: PositiveFloat = 30.0
    """Longest work on one request, in seconds, not counting its wait for a worker; a mesh that
    takes more is answered with 422, and with 503 when it was the machine that was busy."""

    max_connections: PositiveInt = 512
    """Connections open at once; further ones are answered with 429, but for probes."""

    keep_alive_seconds: PositiveFloat = 75.0
    """How long an idle connection is kept, in seconds; longer than load balancers do (65), so that
    none sends a request as it closes."""

    header_seconds: PositiveFloat = 10.0
    """Time for the head of a request to come whole, in seconds."""

    body_seconds: PositiveFloat = 20.0
    """How long a body may come at less than 1 KiB a second, in seconds, before it is answered with
    408; and a client take its answer as slowly, before the connection is cut."""

    drain_seconds: NonNegativeFloat = 5.0
    """How long SIGTERM lets the service go on while `/readyz` says `draining`, in seconds, for load
    balancers to notice; SIGINT (Ctrl-C) skips it."""

    grace_seconds: PositiveFloat = 20.0
    """Time after that for what is in work to end, in seconds."""

    log_level: Annotated[LogLevel, BeforeValidator(_lower)] = "info"
    """Least severity that is logged."""

    log_format: Annotated[LogFormat, BeforeValidator(_lower)] = "auto"
    """How lines are written: `json`, an object a line; `text`, for people; `auto` is `text` on a
    terminal and `json` elsewhere."""
