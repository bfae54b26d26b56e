from __future__ import annotations

import httpx
import pytest
from weighted import json_of

MEDIA_TYPE = "model/gltf-binary"


@pytest.mark.parametrize("call", ["sliders", "template"])
def test_a_glb_comes_back(service_client: httpx.Client, chair_glb: bytes, call: str) -> None:
    answer = service_client.post(f"/{call}", files={"mesh": ("my chair.glb", chair_glb)})
    assert answer.status_code == 200, answer.text
    assert answer.headers["content-type"] == MEDIA_TYPE
    assert f"my_chair-{call}.glb" in answer.headers["content-disposition"]
    told = json_of(answer.content)["asset"]["extras"]["shape_parameters"]
    assert told["category"] == "chair"
    again = service_client.post(
        f"/{call}",
        data={"mesh_id": told["mesh_id"]},
        headers={"If-None-Match": answer.headers["etag"]},
    )
    assert again.status_code == 304


def test_options_reach_the_pipeline(service_client: httpx.Client, chair_glb: bytes) -> None:
    options = {
        "parameters": "seat_width",
        "keep": "seat",
        "paired": "true",
        "quantize": "true",
        "category": "chair",
    }
    files = {"mesh": ("chair.glb", chair_glb)}
    root = json_of(service_client.post("/sliders", files=files, data=options).content)
    (mesh,) = root["meshes"]
    assert mesh["extras"]["targetNames"] == ["seat_width+", "seat_width-"]
    assert root["extensionsRequired"] == ["KHR_mesh_quantization"]
    assert root["asset"]["extras"]["shape_parameters"]["keep"] == "seat"


@pytest.mark.parametrize(
    ("options", "code"),
    [
        ({"parameters": "wings"}, "unknown_parameter"),
        ({"parameters": "[1"}, "names_malformed"),
        ({"rest": "lotus"}, "field_invalid"),
    ],
)
def test_options_that_make_no_sense(
    service_client: httpx.Client, chair_glb: bytes, problem, options: dict[str, str], code: str
) -> None:
    files = {"mesh": ("chair.glb", chair_glb)}
    answer = service_client.post("/sliders", files=files, data={"category": "chair", **options})
    problem(answer, 422, code)
