"""The answers' JSON, for OpenAPI and for the tests that hold the service to it.

The routes send the pipeline's reports as they are; nothing is filtered through these models.
"""

from __future__ import annotations

from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from service.api.mesh_response import MEDIA_TYPES

Vector = tuple[float, float, float]
Unit = Literal["m", "cm", "mm", "in", "ft", "rad", "1"]

BINARY = {"schema": {"type": "string", "format": "binary"}}
MESH_CONTENT: dict[str, Any] = dict.fromkeys(MEDIA_TYPES.values(), BINARY)
TAG_HEADERS: dict[str, Any] = {
    "ETag": {
        "description": "For `If-None-Match`: strong for what is kept, the `mesh_id`; weak for what "
        "is computed, the same for the same request to the same models and build.",
        "schema": {"type": "string"},
    },
}

MESH_HEADERS: dict[str, Any] = {
    **TAG_HEADERS,
    "Content-Disposition": {
        "description": "`attachment`, with a file name after the upload's.",
        "schema": {"type": "string"},
    },
}

EDITED_HEADERS: dict[str, Any] = {
    **MESH_HEADERS,
    "Shape-Parameters": {
        "description": "JSON: the parameters' values after the edit.",
        "schema": {"type": "string", "contentMediaType": "application/json"},
    },
}


class Schema(BaseModel):
    """Base of all answers.  They may gain fields; clients should pass over what they don't know."""

    model_config = ConfigDict(use_attribute_docstrings=True)


class Estimate(Schema):
    """An inferred parameter."""

    value: float
    sigma: float
    """Standard deviation of the value, in the same unit."""
    unit: Unit
    """Of length, or `rad` for angles and `1` for coefficients."""


class Measure(Schema):
    """A dimension that follows from the parameters or is measured on the mesh."""

    value: float
    unit: Unit


class Frame(Schema):
    """Where the canonical frame (+y up, +z front) lies in the upload's."""

    up: str
    front: str
    scale: float
    """Length in the normalised frame of a unit of the upload's own coordinates."""
    center: Vector
    """Origin of the normalised frame, in the upload's own coordinates."""
    rotation: tuple[Vector, Vector, Vector]
    """Rows: a point's normalised coordinates are ``rotation (own - center) scale``."""
    lean: float
    """Degrees by which the upload stands off its axes; 0 for nearly every one."""


class Candidate(Schema):
    """A category and orientation that was tried."""

    category: str
    up: str
    front: str
    distance: float
    """Of a rough fit, for readings other than the answer; see `fit.distance`."""
    probability: float
    """Of this reading among all that were asked for."""


class Fit(Schema):
    """How well the fitted template explains the mesh."""

    distance: float
    """Symmetric mean surface distance, divided by the upload's bounding-box diagonal."""
    encoder_distance: float
    """The same before the values were refined."""
    variant: str | None = Field(examples=["armchair"])
    """Which kind of the category it is, where there are several."""
    encoder: Literal["point", "mesh"] | None = None
    """What read a body: samples of its surface, or the mesh itself, where it has the template's own
    vertices and faces."""
    in_distribution: bool
    """False: the mesh is unlike what the model was trained on; take the values with care."""
    score: float
    candidates: list[Candidate]


class ModelIdentity(Schema):
    """Which model answered."""

    name: str
    version: str
    digest: str


class InferReport(Schema):
    """What `POST /infer` answers."""

    mesh_id: str = Field(examples=["sha256-0f4b..."])
    category: str = Field(examples=["chair"])
    parameters: dict[str, Estimate] = Field(
        examples=[{"seat_width": {"value": 0.48, "sigma": 0.006, "unit": "m"}}]
    )
    derived: dict[str, Measure] = Field(
        examples=[{"seat_top_height": {"value": 0.45, "unit": "m"}}]
    )
    joints: dict[str, Vector] | None = Field(
        default=None, examples=[{"pelvis": [0.0, 0.93, 0.01], "left_hip": [0.07, 0.86, 0.01]}]
    )
    """Of a body: where its joints are, by SMPL's names, in the upload's own frame and the unit that
    lengths are reported in."""
    frame: Frame
    fit: Fit
    model: ModelIdentity
    warnings: list[str]


class Change(Schema):
    """A value before and after an edit."""

    before: float
    after: float
    unit: Unit


class Asked(Schema):
    """Where a value was to lie."""

    set: float | None = None
    min: float | None = None
    max: float | None = None


class Dimension(Change):
    """A dimension before and after an edit, as the mesh itself measures it; a body's stature is
    that of the fitted body, standing straight."""

    asked: Asked | None = None
    """What edits or constraints wanted of it, where they name it."""


class VertexCount(Schema):
    """How much of the mesh moved."""

    total: int
    moved: int


class EditReport(Schema):
    """What `POST /edit` answers to `Accept: application/json`."""

    mesh_id: str = Field(examples=["sha256-93ac..."])
    """Of the edited mesh."""
    source_mesh_id: str = Field(examples=["sha256-0f4b..."])
    """Of the mesh that was sent."""
    category: str
    model: ModelIdentity
    parameters: dict[str, Change] = Field(
        examples=[{"seat_width": {"before": 0.48, "after": 0.576, "unit": "m"}}]
    )
    derived: dict[str, Change]
    dimensions: dict[str, Dimension] = Field(
        examples=[
            {"total_width": {"before": 0.7, "after": 0.6, "unit": "m", "asked": {"max": 0.6}}}
        ]
    )
    vertices: VertexCount
    flipped_faces: int
    """Faces that the edit turned over."""
    warnings: list[str]


class Transfer(Schema):
    """What an edit took from another mesh."""

    parameters: list[str] = Field(examples=[["seat_width", "leg_height"]])
    """What was set in the source."""
    size: Literal["target", "source"]
    position: Literal["source", "target"]
    scale: float
    """What the target's lengths were multiplied by: 1 but with `size=source`."""
    target: dict[str, Measure] = Field(examples=[{"seat_width": {"value": 0.5, "unit": "m"}}])
    """What the target has, in the source's units."""


class TransferReport(EditReport):
    """What `POST /transfer` answers to `Accept: application/json`."""

    target_mesh_id: str = Field(examples=["sha256-51de..."])
    """Of the mesh that the parameters were taken from."""
    transfer: Transfer


class Progress(Schema):
    """How many of a job's variants are made."""

    done: int
    total: int


class Links(Schema):
    """Paths of what belongs to a job."""

    self: str = Field(examples=["/jobs/job-x8Zb..."])
    events: str
    """Server-sent events, one for each change."""
    result: str
    """The zip, once it has succeeded."""


class Job(Schema):
    """Work that goes on after its request was answered."""

    id: str = Field(examples=["job-x8Zb..."])
    kind: Literal["edit", "augment"]
    status: Literal["queued", "running", "succeeded", "failed", "cancelled"]
    progress: Progress
    created: str = Field(json_schema_extra={"format": "date-time"})
    started: str | None = Field(json_schema_extra={"format": "date-time"})
    finished: str | None = Field(json_schema_extra={"format": "date-time"})
    expires: str = Field(json_schema_extra={"format": "date-time"})
    """When it is deleted with all that belongs to it, unless it goes on before."""
    durable: bool
    """Whether it outlives a restart of the service."""
    problem: ProblemDocument | None
    """Of a job that failed: what the same request would have been answered with at once."""
    links: Links


class Jobs(Schema):
    """What `GET /jobs` answers."""

    jobs: list[Job]
    """The caller's own, newest first."""


class Parameter(Schema):
    """A parameter or derived dimension of a category."""

    name: str
    label: str
    group: str
    """The part of the shape, to sort sliders by."""
    unit: Unit
    kind: Literal["length", "angle", "coefficient"]
    range: tuple[float, float]
    """What the model was trained on; of angles, what joints can reach."""
    typical: tuple[float, float]
    """What most real shapes have: a slider's ends."""
    step: float
    derived: bool
    paper_name: str | None
    """What the paper calls it."""


class Version(Schema):
    """One of the models that a category has."""

    name: str = Field(examples=["chair@1.1.0"])
    """What to send as `category` for this one."""
    version: str
    digest: str
    default: bool
    """Whether it is what the bare category means."""


class Category(Schema):
    """What `GET /categories/{name}` answers."""

    name: str
    label: str
    points: int
    """Size of the point clouds that the encoder takes."""
    model: ModelIdentity
    keep: list[str]
    """Points that an edit can hold in place; the first is the default."""
    parameters: list[Parameter]
    versions: list[Version]
    """All of its models, the highest version first."""


class Categories(Schema):
    """What `GET /categories` answers."""

    categories: list[Category]


class Alive(Schema):
    """What `GET /livez` answers."""

    status: Literal["alive"]


class Fault(Schema):
    """A model that can't be served, and why."""

    code: str = Field(examples=["model_digest"])
    detail: str
    suggestion: str


class Ready(Schema):
    """What `GET /readyz` answers when it is."""

    status: Literal["ready"]
    models: dict[str, ModelIdentity]
    """What `category` may name: each category, and where it has several models each of them."""
    faults: list[Fault]
    """Models of the operator's own that are not served, or not as they now lie in the folder."""


class Conflict(Schema):
    """A constraint that can't be met with the others."""

    name: str
    asked: Asked
    nearest: float
    """The value that can be had when each of the conflicts takes its nearest."""
    by: float
    """How far that is from what was asked for."""
    unit: Unit


class ProblemDocument(Schema):
    """Every error (RFC 9457)."""

    type: str
    title: str
    status: int
    detail: str
    """What was found."""
    code: str = Field(examples=["mesh_missing"])
    """Stable, for programs."""
    suggestion: str
    """What to do about it."""
    trace_id: str
    """Also in the header `Trace-Id`; taken from the request's `traceparent` when it has one."""
    conflicts: list[Conflict] | None = None
    """Of `constraints_conflict`: which constraints contradict each other, and how far each would
    have to give way, in shares of its value as little as can be."""
