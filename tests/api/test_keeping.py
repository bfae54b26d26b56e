from __future__ import annotations

from typing import Any

import pytest
from starlette.requests import Request

from service.api.keeping import EDITED, UPLOADED, keep, owner_of
from service.requests import Upload
from service.store.meshstore import Kept, MeshStore

UPLOAD = Upload(b"abc", "a.obj")


def request(**state: Any) -> Request:
    return Request({"type": "http", "headers": [], "state": state})


def test_the_owner_is_the_holder_of_the_key() -> None:
    assert owner_of(request(owner="acme")) == "acme"
    assert owner_of(request()) == ""


def test_a_mesh_is_kept_for_its_owner() -> None:
    store = MeshStore(1 << 20)
    assert keep(request(owner="acme"), store, UPLOAD) == []
    assert store.get(UPLOAD.mesh_id, "acme") is UPLOAD


@pytest.mark.parametrize(
    ("kept", "words"),
    [
        (Kept.HERE, "one server alone"),
        (Kept.BRIEFLY, "not be kept durably"),
        (Kept.NOT, "too large to be kept"),
    ],
)
@pytest.mark.parametrize("what", [UPLOADED, EDITED])
def test_what_is_kept_less_well_is_told(
    monkeypatch: pytest.MonkeyPatch, kept: Kept, words: str, what: str
) -> None:
    store = MeshStore(1 << 20)
    monkeypatch.setattr(store, "put", lambda *_: kept)
    (warning,) = keep(request(), store, UPLOAD, what)
    assert warning.startswith(what)
    assert words in warning


def test_where_nothing_is_kept_only_the_edit_says_so() -> None:
    store = MeshStore(0)
    assert keep(request(), store, UPLOAD) == []
    (warning,) = keep(request(), store, UPLOAD, EDITED)
    assert "not kept here" in warning
