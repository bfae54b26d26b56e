from __future__ import annotations

import pytest
from starlette.requests import Request
from starlette.responses import Response

from service.api.mesh_response import MEDIA_TYPES, mesh_response
from service.mesh.formats import READERS
from service.mesh.zipped import ZippedFile
from service.requests import Upload


def respond(mesh: Upload, if_none_match: str | None = None) -> Response:
    headers = [] if if_none_match is None else [(b"if-none-match", if_none_match.encode())]
    request = Request({"type": "http", "headers": headers})
    return mesh_response(request, mesh, '"sha256-ab"', {"Cache-Control": "private"})


def test_a_mesh_is_an_attachment_with_its_etag() -> None:
    response = respond(Upload(b"abc", "chair.glb", "model/gltf-binary"))
    assert response.status_code == 200
    assert response.body == b"abc"
    assert response.headers["etag"] == '"sha256-ab"'
    assert response.headers["content-type"] == "model/gltf-binary"
    assert response.headers["content-disposition"] == 'attachment; filename="chair.glb"'
    assert response.headers["cache-control"] == "private"


@pytest.mark.parametrize("name", ["page.html", "page", "", None, "a.svg"])
def test_what_a_client_calls_its_upload_is_not_sent_back(name: str | None) -> None:
    response = respond(Upload(b"<script>", name, "text/html"))
    assert response.headers["content-type"] == "application/octet-stream"


@pytest.mark.parametrize("tags", ['"sha256-ab"', 'W/"sha256-ab"', '"sha256-00", "sha256-ab"', "*"])
def test_a_client_that_holds_the_content_gets_304(tags: str) -> None:
    response = respond(Upload(b"abc", "chair.glb", None), tags)
    assert response.status_code == 304
    assert response.body == b""
    assert response.headers["etag"] == '"sha256-ab"'
    assert response.headers["cache-control"] == "private"


@pytest.mark.parametrize("tags", ['"sha256-00"', "sha256-ab", ""])
def test_another_tag_gets_the_content(tags: str) -> None:
    assert respond(Upload(b"abc", "chair.glb", None), tags).status_code == 200


def test_every_format_has_the_media_type_of_its_reader() -> None:
    readers = {**READERS, "zip": ZippedFile}
    assert {name: MEDIA_TYPES[f".{name}"] for name in readers} == {
        name: reader.media_type for name, reader in readers.items()
    }
    assert len(MEDIA_TYPES) == len(readers)
