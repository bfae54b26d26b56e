from __future__ import annotations

import pytest
from fastapi import APIRouter, FastAPI

from service.api.routes import UNMATCHED, Routes


@pytest.mark.parametrize(
    ("path", "template"),
    [
        ("/livez", "/livez"),
        ("/meshes/sha256-0", "/meshes/{mesh_id}"),
        ("/web/js/a/b.js", "/web/{path:path}"),
        ("/", "/"),
        ("/livez/", UNMATCHED),
        ("/LIVEZ", UNMATCHED),
        ("/meshes/", UNMATCHED),
        ("/meshes/a/b", UNMATCHED),
        ("/meshes/{mesh_id}", "/meshes/{mesh_id}"),
        ("/web/{path:path}", "/web/{path:path}"),
        ("", UNMATCHED),
        ("//", UNMATCHED),
        ("/../livez", UNMATCHED),
        ("*", UNMATCHED),
    ],
)
def test_a_path_has_the_template_of_its_route(path: str, template: str) -> None:
    app = FastAPI()
    routes = Routes(app.routes)
    router = APIRouter()
    # Added after: middleware is made before the last route is.
    for known in ("/livez", "/meshes/{mesh_id}", "/web/{path:path}", "/"):
        router.get(known)(lambda: None)
    app.include_router(router)
    assert routes.template(path) == template
