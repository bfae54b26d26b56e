"""The service's client: it needs httpx and pydantic, and nothing of the service itself.

from service.client import ShapeClient, scale

with ShapeClient("http://127.0.0.1:8000") as client:
    client.edit("chair.glb", {"seat_width": scale(1.2)}).save("wide.glb")
"""

from service.client.asynchronous import AsyncShapeClient
from service.client.call import Answer, Call
from service.client.errors import (
    AnswerMalformed,
    BadRequest,
    CategoriesDiffer,
    CategoryUnknown,
    Conflict,
    ConnectionFailed,
    ConstraintsConflict,
    Forbidden,
    IdempotencyConflict,
    JobCancelled,
    JobFailed,
    JobNotFinished,
    JobUnknown,
    MeshUnknown,
    MethodNotAllowed,
    NotAcceptable,
    NotFound,
    NotRecognised,
    ParameterUnknown,
    ProblemError,
    RequestTimeout,
    ServerFault,
    ServiceError,
    TimedOut,
    TooLarge,
    TooManyRequests,
    Unauthorized,
    Unavailable,
    Unprocessable,
    UnsupportedMedia,
)
from service.client.files import Archive, Edited, File
from service.client.mesh import Mesh, MeshLike
from service.client.models import (
    Category,
    EditReport,
    Event,
    InferReport,
    Job,
    Parameter,
    Ready,
    TransferReport,
)
from service.client.multipart import Progress
from service.client.retry import Retry
from service.client.sync import ShapeClient
from service.client.values import add, at_least, at_most, between, scale, set_to

__all__ = [
    "Answer",
    "AnswerMalformed",
    "Archive",
    "AsyncShapeClient",
    "BadRequest",
    "Call",
    "CategoriesDiffer",
    "Category",
    "CategoryUnknown",
    "Conflict",
    "ConnectionFailed",
    "ConstraintsConflict",
    "EditReport",
    "Edited",
    "Event",
    "File",
    "Forbidden",
    "IdempotencyConflict",
    "InferReport",
    "Job",
    "JobCancelled",
    "JobFailed",
    "JobNotFinished",
    "JobUnknown",
    "Mesh",
    "MeshLike",
    "MeshUnknown",
    "MethodNotAllowed",
    "NotAcceptable",
    "NotFound",
    "NotRecognised",
    "Parameter",
    "ParameterUnknown",
    "ProblemError",
    "Progress",
    "Ready",
    "RequestTimeout",
    "Retry",
    "ServerFault",
    "ServiceError",
    "ShapeClient",
    "TimedOut",
    "TooLarge",
    "TooManyRequests",
    "TransferReport",
    "Unauthorized",
    "Unavailable",
    "Unprocessable",
    "UnsupportedMedia",
    "add",
    "at_least",
    "at_most",
    "between",
    "scale",
    "set_to",
]
