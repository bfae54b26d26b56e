"""Every call of the service, described; the clients carry them out."""

from __future__ import annotations

import uuid
from collections.abc import Mapping, Sequence
from typing import Any, TypeVar
from urllib.parse import quote

from service.client import options as opt
from service.client.call import JSON, Answer, Call, Part, Sending, as_file, as_is, as_model
from service.client.files import Archive, Edited, File
from service.client.mesh import Mesh, MeshLike, as_mesh
from service.client.models import (
    Alive,
    Categories,
    Category,
    EditReport,
    InferReport,
    Job,
    Jobs,
    Ready,
    TransferReport,
)
from service.client.multipart import Field
from service.client.values import Values, as_json

T = TypeVar("T")
Given = Mapping[str, Any]

ZIP = "application/zip"
AS_JSON = {"Accept": JSON}
AS_FILE = {"Accept": f"*/*, {JSON};q=0"}
AS_ZIP = {"Accept": ZIP}


def infer(mesh: MeshLike, given: Given) -> Call[InferReport]:
    """POST /infer; the mesh learns its id."""

    def read(answer: Answer) -> InferReport:
        report = as_model(InferReport)(answer)
        answer.sent[0].remember(report.mesh_id)
        return report

    fields, how = opt.split(given, opt.Reading)
    return Call("POST", "/infer", read, fields, _one(mesh), AS_JSON, how)


def edit(mesh: MeshLike, edits: Values | str | None, given: Given) -> Call[Edited]:
    """POST /edit, for the file."""
    fields, how = opt.split(given, opt.Editing)
    fields = _edits(edits) + fields
    return Call("POST", "/edit", as_file(Edited), fields, _one(mesh), AS_FILE, how)


def edit_report(mesh: MeshLike, edits: Values | str | None, given: Given) -> Call[EditReport]:
    """POST /edit, for the report; the mesh learns its id."""

    def read(answer: Answer) -> EditReport:
        report = as_model(EditReport)(answer)
        answer.sent[0].remember(report.source_mesh_id)
        return report

    fields, how = opt.split(given, opt.EditingReport)
    fields = _edits(edits) + fields
    return Call("POST", "/edit", read, fields, _one(mesh), AS_JSON, how)


def transfer(source: MeshLike, target: MeshLike, given: Given) -> Call[Edited]:
    """POST /transfer, for the file."""
    fields, how = opt.split(given, opt.Transferring)
    parts = _two(source, target)
    return Call("POST", "/transfer", as_file(Edited), fields, parts, AS_FILE, how)


def transfer_report(source: MeshLike, target: MeshLike, given: Given) -> Call[TransferReport]:
    """POST /transfer, for the report; both meshes learn their ids."""

    def read(answer: Answer) -> TransferReport:
        report = as_model(TransferReport)(answer)
        answer.sent[0].remember(report.source_mesh_id)
        answer.sent[1].remember(report.target_mesh_id)
        return report

    fields, how = opt.split(given, opt.TransferringReport)
    return Call("POST", "/transfer", read, fields, _two(source, target), AS_JSON, how)


def made(path: str, mesh: MeshLike, given: Given) -> Call[File]:
    """POST /sliders or /template."""
    fields, how = opt.split(given, opt.Offering)
    return Call("POST", path, as_file(File), fields, _one(mesh), AS_FILE, how)


def edit_variants(mesh: MeshLike, variants: Sequence[Values] | str, given: Given) -> Call[Archive]:
    """POST /edit with variants."""
    fields, how = opt.split(given, opt.VaryingEdits)
    fields = ("variants", as_json(variants)), *fields
    return Call("POST", "/edit", as_file(Archive), fields, _one(mesh), AS_ZIP, how)


def augment(mesh: MeshLike, given: Given) -> Call[Archive]:
    """POST /augment."""
    fields, how = opt.split(given, opt.Augmenting)
    return Call("POST", "/augment", as_file(Archive), fields, _one(mesh), AS_ZIP, how)


def submit_edit(mesh: MeshLike, variants: Sequence[Values] | str, given: Given) -> Call[Job]:
    """POST /edit with variants, as a job."""
    key, options = _key(given)
    return _submitted(edit_variants(mesh, variants, options), key)


def submit_augment(mesh: MeshLike, given: Given) -> Call[Job]:
    """POST /augment, as a job."""
    key, options = _key(given)
    return _submitted(augment(mesh, options), key)


def categories(given: Given) -> Call[Categories]:
    """GET /categories."""
    return _get("/categories", as_model(Categories), given)


def category(name: str, given: Given) -> Call[Category]:
    """GET /categories/{name}."""
    return _get(f"/categories/{quote(name, safe='@')}", as_model(Category), given)


def mesh(mesh_id: str | Mesh, given: Given) -> Call[File]:
    """GET /meshes/{mesh_id}.

    Raises:
        ValueError: when the mesh has no id yet.
    """
    known = mesh_id.mesh_id if isinstance(mesh_id, Mesh) else mesh_id
    if known is None:
        raise ValueError(f"{mesh_id!r} is not known to be kept: infer it first")
    return _get(f"/meshes/{quote(known, safe='')}", as_file(File), given, "*/*")


def ready(given: Given) -> Call[Ready]:
    """GET /readyz."""
    return _get("/readyz", as_model(Ready), given)


def alive(given: Given) -> Call[Alive]:
    """GET /livez."""
    return _get("/livez", as_model(Alive), given)


def jobs(given: Given) -> Call[Jobs]:
    """GET /jobs."""
    return _get("/jobs", as_model(Jobs), given)


def job(of: Job | str, given: Given) -> Call[Job]:
    """GET /jobs/{id}."""
    return _get(job_path(of), as_model(Job), given)


def result(of: Job | str, given: Given) -> Call[Archive]:
    """GET /jobs/{id}/result."""
    return _get(f"{job_path(of)}/result", as_file(Archive), given, ZIP)


def cancel(of: Job | str, given: Given) -> Call[Job | None]:
    """DELETE /jobs/{id}."""

    def read(answer: Answer) -> Job | None:
        return None if answer.status == 204 else as_model(Job)(answer)

    _, how = opt.split(given, opt.How)
    return Call("DELETE", job_path(of), read, headers=AS_JSON, how=how)


def job_path(of: Job | str) -> str:
    """Where a job is."""
    return f"/jobs/{quote(of if isinstance(of, str) else of.id, safe='')}"


def plain(
    method: str,
    path: str,
    fields: Mapping[str, str] | Sequence[tuple[str, str]],
    files: Mapping[str, MeshLike] | Sequence[tuple[str, MeshLike]],
    headers: Mapping[str, str] | None,
    how: Sending,
) -> Call[Answer]:
    """Any call, whose answer is not read; files go whole."""
    texts = fields.items() if isinstance(fields, Mapping) else fields
    whole = files.items() if isinstance(files, Mapping) else files
    parts = tuple(Part(name, as_mesh(given)) for name, given in whole)
    return Call(method, path, as_is, tuple(texts), parts, headers or {}, how)


def _get(path: str, read: Any, given: Given, accept: str = JSON) -> Call[Any]:
    _, how = opt.split(given, opt.Saving if accept != JSON else opt.How)
    return Call("GET", path, read, headers={"Accept": accept}, how=how)


def _one(given: MeshLike) -> tuple[Part, ...]:
    return (Part("mesh", as_mesh(given), "mesh_id"),)


def _two(source: MeshLike, target: MeshLike) -> tuple[Part, ...]:
    names = ("source", source), ("target", target)
    return tuple(Part(name, as_mesh(given), f"{name}_mesh_id") for name, given in names)


def _key(given: Given) -> tuple[str, dict[str, Any]]:
    """The idempotency key, which makes it one job however often it is sent; and the rest."""
    rest = {name: value for name, value in given.items() if name != "idempotency_key"}
    return given.get("idempotency_key") or uuid.uuid4().hex, rest


def _submitted(call: Call[Archive], key: str) -> Call[Job]:
    if call.how.to is not None:
        raise TypeError("a job has no file to write yet: give `to` to `result`")
    headers = {"Accept": f"{JSON}, {ZIP}", "Prefer": "respond-async", "Idempotency-Key": key}
    return Call(call.method, call.path, as_model(Job), call.fields, call.parts, headers, call.how)


def _edits(edits: Values | str | None) -> tuple[Field, ...]:
    return () if edits is None else (("edits", as_json(edits)),)
