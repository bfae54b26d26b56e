from __future__ import annotations

import json
import threading
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import httpx
import numpy as np
import pytest
import trimesh

from service.api.schemas import InferReport


def obj(*lines: str) -> bytes:
    return "\n".join(lines).encode()


TRIANGLES = ("f 1 2 3", "f 1 3 4", "f 1 4 2", "f 2 4 3")
CORNERS = ("v 0 0 0", "v 1 0 0", "v 0 1 0", "v 0 0 1")


def test_the_report_is_the_answer_and_the_mesh_is_kept(client: httpx.Client) -> None:
    response = client.post("/infer", files={"mesh": ("a.obj", b"abc")})
    mesh_id = response.json()["mesh_id"]
    assert response.json() == {"mesh_id": mesh_id, "category": "stool"}
    assert client.get(f"/meshes/{mesh_id}").content == b"abc"
    assert client.post("/infer", data={"mesh_id": mesh_id}).json() == response.json()


def test_two_requests_work_at_once(client: httpx.Client, pretend: Any) -> None:
    # Each waits for the other: one at a time would never end.
    pretend.work = threading.Barrier(2, timeout=20).wait
    with ThreadPoolExecutor(2) as pool:
        responses = list(
            pool.map(lambda _: client.post("/infer", files={"mesh": ("a.obj", b"abc")}), range(2))
        )
    assert [response.status_code for response in responses] == [200, 200]


def test_a_chair_of_known_sizes(service_client: httpx.Client, chair_glb: bytes) -> None:
    response = service_client.post("/infer", files={"mesh": ("chair.glb", chair_glb)})
    assert response.status_code == 200, response.text
    report = InferReport.model_validate_json(response.content, extra="forbid")
    assert report.category == "chair"
    assert (report.frame.up, report.frame.front) == ("+y", "+z")
    # The template's own shape: the fit should be all but exact.
    assert report.parameters["seat_width"].value == pytest.approx(0.48, abs=0.02)
    assert report.derived["seat_top_height"].value == pytest.approx(0.46, abs=0.02)
    assert report.derived["total_height"].value == pytest.approx(0.88, abs=1e-6)
    assert report.fit.distance < 0.02
    assert all(estimate.sigma > 0 for estimate in report.parameters.values())
    assert all(estimate.unit == "m" for estimate in report.parameters.values())

    again = service_client.post("/infer", data={"mesh_id": report.mesh_id})
    assert again.json() == response.json()


def test_values_come_in_the_units_of_the_file(
    service_client: httpx.Client, box_chair: trimesh.Trimesh
) -> None:
    millimetres = box_chair.copy()
    millimetres.apply_scale(1000.0)
    data = millimetres.export(file_type="stl")
    report = InferReport.model_validate_json(
        service_client.post(
            "/infer", files={"mesh": ("chair.stl", data)}, data={"units": "mm"}
        ).content,
        extra="forbid",
    )
    assert report.parameters["seat_width"].unit == "mm"
    assert report.derived["total_height"].value == pytest.approx(880, abs=0.01)


@pytest.mark.parametrize(
    ("name", "data", "status"),
    [
        ("chair.glb", b"this is no mesh at all", 422),
        ("chair.obj", b"\x00\x01\x02\x03 nothing", 422),
        ("chair.stl", b"", 422),
        ("chair.glb", b"glTF\x02\x00\x00\x00\xff\xff\xff\xff", 422),
        ("chair.fbx", b"Kaydara FBX Binary", 415),
        ("chair", b"of what format?", 415),
        ("empty.obj", obj("# nothing here"), 422),
        ("nan.obj", obj("v nan 0 0", *CORNERS[1:], *TRIANGLES), 422),
        ("infinite.obj", obj("v inf 0 0", *CORNERS[1:], *TRIANGLES), 422),
        ("range.obj", obj(*CORNERS, "f 1 2 9"), 422),
        ("no-faces.obj", obj(*CORNERS), 422),
        ("point.obj", obj(*["v 1 1 1"] * 4, *TRIANGLES), 422),
        ("cloud.ply", trimesh.PointCloud(np.eye(3)).export(file_type="ply"), 422),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_a_bad_upload_is_told_apart_and_harms_nothing(
    service_client: httpx.Client, problem: Any, name: str, data: bytes, status: int
) -> None:
    response = service_client.post("/infer", files={"mesh": (name, data)})
    document = response.json()
    problem(response, status, document["code"])
    assert document["code"] != "internal_error"
    assert service_client.get("/readyz").status_code == 200


def test_a_category_that_is_not_installed(
    service_client: httpx.Client, problem: Any, chair_glb: bytes
) -> None:
    files = {"mesh": ("chair.glb", chair_glb)}
    response = service_client.post("/infer", files=files, data={"category": "teapot"})
    document = problem(response, 422, "unknown_category")
    assert "teapot" in document.detail
    assert "chair" in document.suggestion


def test_an_upload_in_disguise_is_read_by_its_first_bytes(
    service_client: httpx.Client, chair_glb: bytes
) -> None:
    files = {"mesh": ("upload", chair_glb, "application/octet-stream")}
    response = service_client.post("/infer", files=files)
    assert response.status_code == 200, json.dumps(response.json())
