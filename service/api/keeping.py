"""Meshes kept for the client who makes the request, and what it is told of that."""

from __future__ import annotations

from starlette.requests import Request

from service.requests import Upload
from service.store.meshstore import Kept, MeshStore

UPLOADED, EDITED = "The uploaded mesh", "The edited mesh"
PARTS = {"mesh": UPLOADED, "source": "The source mesh", "target": "The target mesh"}
"""What a form's files are called."""

_WARNINGS = {
    Kept.HERE: "is kept by one server alone for now: others may not know its mesh_id.",
    Kept.BRIEFLY: "could not be kept durably: its mesh_id may soon be unknown.",
    Kept.NOT: "could not be kept: its mesh_id can't be used.",
}
_NOTHING = "Meshes are not kept here: the edited mesh's mesh_id can't be used."
_TOO_LARGE = "is too large to be kept: its mesh_id can't be used."


def owner_of(request: Request) -> str:
    """Whose meshes the request may name: the holder of its API key; "" where there are no keys."""
    owner: str = getattr(request.state, "owner", "")
    return owner


def keep(request: Request, store: MeshStore, upload: Upload, what: str = UPLOADED) -> list[str]:
    """Keep a mesh; not for the event loop.

    Returns:
        Warnings, when it is kept less well than the settings promise.  Without any, it is there
        after the process is killed, if the store has a disk or is shared.
    """
    if store.keeps_nothing:
        return [_NOTHING] if what == EDITED else []
    kept = store.put(upload, owner_of(request))
    if kept is Kept.FULLY:
        return []
    if kept is Kept.NOT and store.tiers == [store.memory]:
        return [f"{what} {_TOO_LARGE}"]
    return [f"{what} {_WARNINGS[kept]}"]
