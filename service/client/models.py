"""What the service answers, typed.

The fields are those of the service's own schema.  Answers may gain fields: they are kept, as
attributes and in `model_extra`.  Where the service has a closed set of texts, such as units, there
is any text here, so that a new one breaks no client.
"""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, ConfigDict, Field

Vector = tuple[float, float, float]

FINISHED = frozenset({"succeeded", "failed", "cancelled"})
"""What a job's status is once it stays."""


class Model(BaseModel):
    """Base of all answers."""

    model_config = ConfigDict(extra="allow", frozen=True, use_attribute_docstrings=True)


class Estimate(Model):
    """An inferred parameter."""

    value: float
    sigma: float
    """Standard deviation of the value, in the same unit."""
    unit: str


class Measure(Model):
    """A dimension that follows from the parameters or is measured on the mesh."""

    value: float
    unit: str


class Frame(Model):
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
    """Degrees by which the upload stands off its axes."""


class Candidate(Model):
    """A category and orientation that was tried."""

    category: str
    up: str
    front: str
    distance: float
    probability: float


class Fit(Model):
    """How well the fitted template explains the mesh."""

    distance: float
    """Symmetric mean surface distance, divided by the upload's bounding-box diagonal."""
    encoder_distance: float
    """The same before the values were refined."""
    variant: str | None
    encoder: str | None = None
    in_distribution: bool
    """False: the mesh is unlike what the model was trained on; take the values with care."""
    score: float
    candidates: list[Candidate]


class ModelIdentity(Model):
    """Which model answered."""

    name: str
    version: str
    digest: str


class InferReport(Model):
    """The parameters of a mesh, in its own unit."""

    mesh_id: str
    category: str
    parameters: dict[str, Estimate]
    derived: dict[str, Measure]
    joints: dict[str, Vector] | None = None
    """Of a body: where its joints are, by SMPL's names, in the upload's own frame."""
    frame: Frame
    fit: Fit
    model: ModelIdentity
    warnings: list[str]


class Change(Model):
    """A value before and after an edit."""

    before: float
    after: float
    unit: str


class Asked(Model):
    """Where a value was to lie."""

    set: float | None = None
    min: float | None = None
    max: float | None = None


class Dimension(Change):
    """A dimension before and after an edit, as the mesh itself measures it."""

    asked: Asked | None = None


class VertexCount(Model):
    """How much of the mesh moved."""

    total: int
    moved: int


class EditReport(Model):
    """What became of a mesh by an edit."""

    mesh_id: str
    """Of the edited mesh."""
    source_mesh_id: str
    """Of the mesh that was sent."""
    category: str
    model: ModelIdentity
    parameters: dict[str, Change]
    derived: dict[str, Change]
    dimensions: dict[str, Dimension]
    vertices: VertexCount
    flipped_faces: int
    warnings: list[str]


class Transfer(Model):
    """What an edit took from another mesh."""

    parameters: list[str]
    size: str
    position: str
    scale: float
    """What the target's lengths were multiplied by."""
    target: dict[str, Measure]
    """What the target has, in the source's units."""


class TransferReport(EditReport):
    """What became of a mesh that got another's parameters."""

    target_mesh_id: str
    transfer: Transfer


class Parameter(Model):
    """A parameter or derived dimension of a category."""

    name: str
    label: str
    group: str
    """The part of the shape, to sort sliders by."""
    unit: str
    kind: str
    range: tuple[float, float]
    """What the model was trained on; of angles, what joints can reach."""
    typical: tuple[float, float]
    """What most real shapes have: a slider's ends."""
    step: float
    derived: bool
    paper_name: str | None


class Version(Model):
    """One of the models that a category has."""

    name: str
    """What to give as `category` for this one."""
    version: str
    digest: str
    default: bool


class Category(Model):
    """A kind of shape that the service knows."""

    name: str
    label: str
    points: int
    model: ModelIdentity
    keep: list[str]
    """Points that an edit can hold in place; the first is the default."""
    parameters: list[Parameter]
    versions: list[Version]


class Categories(Model):
    """All of them."""

    categories: list[Category]


class Alive(Model):
    """The service runs."""

    status: str


class Fault(Model):
    """A model that can't be served, and why."""

    code: str
    detail: str
    suggestion: str


class Ready(Model):
    """The service answers requests."""

    status: str
    models: dict[str, ModelIdentity]
    """What `category` may name."""
    faults: list[Fault]


class Conflict(Model):
    """A constraint that can't be met with the others."""

    name: str
    asked: Asked
    nearest: float
    """The value that can be had when each of the conflicts takes its nearest."""
    by: float
    unit: str


class ProblemDocument(Model):
    """An error as the service tells it (RFC 9457)."""

    type: str = "about:blank"
    title: str = ""
    status: int
    detail: str = ""
    code: str
    suggestion: str = ""
    trace_id: str = ""
    conflicts: list[Conflict] | None = None


class Progress(Model):
    """How many of a job's variants are made."""

    done: int
    total: int


class Links(Model):
    """Paths of a job's resources."""

    self_: str = Field(alias="self")
    events: str
    result: str


class Job(Model):
    """Work that goes on after the answer: a submitted call."""

    id: str
    kind: str
    """`edit` or `augment`."""
    status: str
    """`queued`, `running`, `succeeded`, `failed` or `cancelled`."""
    progress: Progress
    created: str
    """Times are RFC 3339."""
    started: str | None
    finished: str | None
    expires: str
    durable: bool
    """Whether it outlives a restart of the service."""
    problem: dict[str, Any] | None
    """Of a failed job: why, as a problem document."""
    links: Links

    @property
    def is_finished(self) -> bool:
        """Whether its status stays as it is."""
        return self.status in FINISHED


class Jobs(Model):
    """The caller's own, newest first."""

    jobs: list[Job]


class Event(Model):
    """A job's change of status, as it is told while one waits."""

    id: str | None
    """Of the event, to go on from there; None where the service was asked instead."""
    job: Job
