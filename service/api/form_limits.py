"""How much a form may hold beside its mesh, and what is told of one that holds more."""

from __future__ import annotations

FIELDS = 40
"""Text fields of a form; the largest has half as many."""

FILES = 2
"""File parts: a transfer's; where one is wanted, two are told apart from a form that is out of
bounds."""

FIELD_BYTES = 256 * 1024
"""Length of a text field, its name included where the form is URL-encoded."""

# What the framework's parsers say, by how it begins: status, code, suggestion.
_OVERRUNS: dict[str, tuple[int, str, str]] = {
    "Too many fields": (400, "fields_too_many", "Send only the fields that /docs lists."),
    "Too many files": (
        400,
        "files_too_many",
        "Send one file, as the part `mesh`, or the `source` and the `target` of a transfer; what "
        "belongs to a mesh goes with it in a zip.",
    ),
    "Part exceeded": (413, "field_too_large", "Send the mesh as a file: -F mesh=@chair.glb."),
    "Field exceeded": (
        413,
        "field_too_large",
        "Send the mesh as a file of multipart/form-data: -F mesh=@chair.glb.",
    ),
}


def overrun(detail: str) -> tuple[int, str, str] | None:
    """Status, code and suggestion for a parser's complaint of a limit; None for other faults."""
    return next((told for start, told in _OVERRUNS.items() if detail.startswith(start)), None)
