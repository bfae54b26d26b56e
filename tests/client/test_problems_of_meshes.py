"""Files that the service takes no mesh from: each is told by a problem of its own."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from provoke import client_of, provokes, refused
from provoke_meshes import MOST_VERTICES, UNUSABLE, animated, integers

from service.client import Mesh, ShapeClient
from service.main import create_app
from service.mesh import limits
from service.settings import Settings


@pytest.fixture(scope="module")
def client(serving: Any) -> Iterator[ShapeClient]:
    """A client of a service that takes small meshes."""
    settings = Settings(categories=("debug",), workers=1, max_vertices=MOST_VERTICES)
    with serving(create_app(settings)) as http:
        yield client_of(http)


@provokes(**{code: file.status for code, file in UNUSABLE.items()})
def test_a_file(client: ShapeClient, code: str) -> Any:
    file = UNUSABLE[code]
    return refused(lambda: client.infer(Mesh(file.data, file.name)))


@provokes(too_many_tokens=413)
def test_a_file_of_many_words(client: ShapeClient, monkeypatch: pytest.MonkeyPatch) -> Any:
    """Few of them here: so many as are too many would fill the memory of the tests."""
    monkeypatch.setattr(limits, "TOKENS", 20)
    file = UNUSABLE["too_many_vertices"]
    return refused(lambda: client.infer(Mesh(file.data, file.name)))


@provokes(animated_weights=415)
def test_a_file_that_has_no_room_for_sliders(client: ShapeClient) -> Any:
    return refused(lambda: client.sliders(animated().glb(), category="debug"))


@provokes(integer_coordinates=415)
def test_a_file_that_can_not_hold_the_edit(client: ShapeClient) -> Any:
    edits = {"width": {"scale": 1.01}}
    return refused(lambda: client.edit(integers(), edits))
