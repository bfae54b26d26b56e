from __future__ import annotations

import json
import threading
import zipfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from io import BytesIO
from typing import Any

import httpx
import numpy as np
import pytest
import trimesh
from fastapi import FastAPI

from service.api.mesh_response import MEDIA_TYPES
from service.api.schemas import EditReport
from service.store.memory import OVERHEAD

MESH = ("my chair.obj", b"abc")
EDITS = {"edits": '{"seat_width": 0.5}'}


def test_the_edited_file_comes_with_its_headers(client: httpx.Client) -> None:
    response = client.post("/edit", files={"mesh": MESH}, data=EDITS)
    assert response.content == b"abc edited"
    assert response.headers["content-type"] == "model/obj"
    assert response.headers["content-disposition"] == (
        "attachment; filename=\"my_chair-edited.obj\"; filename*=UTF-8''my%20chair-edited.obj"
    )
    assert response.headers["shape-parameters"] == '{"seat_width":0.123457,"leg_height":0.4}'
    assert response.headers["vary"] == "Accept"


def test_a_client_that_holds_the_edit_is_not_sent_it_again(client: httpx.Client) -> None:
    etag = client.post("/edit", files={"mesh": MESH}, data=EDITS).headers["etag"]
    headers = {"if-none-match": etag}
    again = client.post("/edit", files={"mesh": MESH}, data=EDITS, headers=headers)
    assert (again.status_code, again.content, again.headers["etag"]) == (304, b"", etag)
    other = client.post("/edit", files={"mesh": ("a.obj", b"x")}, data=EDITS, headers=headers)
    assert other.status_code == 200


def test_the_report_names_both_meshes_and_both_are_kept(client: httpx.Client) -> None:
    headers = {"accept": "application/json"}
    response = client.post("/edit", files={"mesh": MESH}, data=EDITS, headers=headers)
    report = EditReport.model_validate_json(response.content, extra="forbid")
    assert report.warnings == ["a warning"]
    assert client.get(f"/meshes/{report.source_mesh_id}").content == b"abc"
    edited = client.get(f"/meshes/{report.mesh_id}")
    assert edited.content == b"abc edited"
    assert "my_chair-edited.obj" in edited.headers["content-disposition"]


def test_an_edit_too_large_to_keep_says_so(pretend_app: Callable[..., FastAPI], serve: Any) -> None:
    client = serve(pretend_app(mesh_cache_bytes=OVERHEAD + 5))
    headers = {"accept": "application/json"}
    report = client.post("/edit", files={"mesh": MESH}, data=EDITS, headers=headers).json()
    assert "too large" in report["warnings"][-1]
    assert client.get(f"/meshes/{report['source_mesh_id']}").status_code == 200
    assert client.get(f"/meshes/{report['mesh_id']}").status_code == 404


def test_it_is_alive_while_every_worker_edits(client: httpx.Client, pretend: Any) -> None:
    entered = threading.Semaphore(0)
    release = threading.Event()

    def block() -> None:
        entered.release()
        release.wait(20)

    pretend.work = block
    with ThreadPoolExecutor(2) as pool:
        edits = [
            pool.submit(client.post, "/edit", files={"mesh": MESH}, data=EDITS) for _ in range(2)
        ]
        try:
            assert all(entered.acquire(timeout=20) for _ in edits)
            assert client.get("/livez").status_code == 200
            assert client.get("/readyz").status_code == 200
            assert not any(edit.done() for edit in edits)
        finally:
            release.set()
        assert [edit.result().status_code for edit in edits] == [200, 200]


def load(data: bytes, file_type: str = "glb") -> trimesh.Trimesh:
    return trimesh.load(BytesIO(data), file_type=file_type, process=False, force="mesh")


def test_a_wider_chair_is_the_same_file_but_wider(
    service_client: httpx.Client, chair_glb: bytes
) -> None:
    response = service_client.post(
        "/edit",
        files={"mesh": ("chair.glb", chair_glb)},
        data={"edits": '{"seat_width": {"scale": 1.25}}'},
    )
    assert response.status_code == 200, response.text
    assert response.headers["content-type"] == "model/gltf-binary"
    before, after = load(chair_glb), load(response.content)
    assert np.array_equal(before.faces, after.faces)
    assert after.extents[0] / before.extents[0] == pytest.approx(1.25, abs=0.02)
    assert after.extents[1:] == pytest.approx(before.extents[1:], abs=0.02)
    values = json.loads(response.headers["shape-parameters"])
    assert values["seat_width"] == pytest.approx(after.extents[0], abs=0.02)


def test_an_empty_edit_gives_the_bytes_back(service_client: httpx.Client, chair_glb: bytes) -> None:
    files = {"mesh": ("chair.glb", chair_glb)}
    response = service_client.post("/edit", files=files, data={"edits": "{}"})
    assert response.content == chair_glb


@pytest.fixture(scope="module")
def chair_zip(box_chair: trimesh.Trimesh) -> bytes:
    """The box chair as a glTF, its buffer and a picture, zipped."""
    files = box_chair.export(file_type="gltf")
    target = BytesIO()
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in {**files, "wood.png": b"\x89PNG"}.items():
            archive.writestr(f"chair/{name}", content)
    return target.getvalue()


def test_a_zip_comes_back_as_a_zip(service_client: httpx.Client, chair_zip: bytes) -> None:
    form = {"files": {"mesh": ("chair.zip", chair_zip)}}
    same = service_client.post("/edit", data={"edits": "{}"}, **form)
    assert same.content == chair_zip
    response = service_client.post(
        "/edit", data={"edits": '{"seat_width": {"scale": 1.25}}'}, **form
    )
    assert response.headers["content-type"] == "application/zip"
    assert 'filename="chair-edited.zip"' in response.headers["content-disposition"]
    assert response.headers["etag"] != same.headers["etag"]
    before, after = (zipfile.ZipFile(BytesIO(data)) for data in (chair_zip, response.content))
    assert after.testzip() is None
    assert after.namelist() == before.namelist()
    changed = [name for name in before.namelist() if before.read(name) != after.read(name)]
    assert "chair/model.gltf" in changed
    assert all(name.endswith((".gltf", ".bin")) for name in changed)
    report = service_client.post(
        "/edit",
        data={"edits": '{"seat_width": {"scale": 1.25}}'},
        headers={"accept": "application/json"},
        **form,
    ).json()
    kept = service_client.get(f"/meshes/{report['mesh_id']}")
    assert kept.content == response.content
    assert kept.headers["content-type"] == "application/zip"


def test_a_zipped_gltf_is_in_metres(
    service_client: httpx.Client, chair_zip: bytes, chair_glb: bytes
) -> None:
    plain, packed = (
        service_client.post("/infer", files={"mesh": mesh}, data={"units": "cm"}).json()
        for mesh in (("chair.glb", chair_glb), ("chair.zip", chair_zip))
    )
    assert packed["parameters"] == plain["parameters"]
    assert packed["parameters"]["seat_width"]["value"] == pytest.approx(48, abs=3)


def test_a_zip_in_another_format_is_a_plain_file(
    service_client: httpx.Client, chair_zip: bytes
) -> None:
    response = service_client.post(
        "/edit",
        files={"mesh": ("chair.zip", chair_zip)},
        data={"edits": "{}", "format": "glb"},
    )
    assert response.headers["content-type"] == "model/gltf-binary"
    assert 'filename="chair-edited.glb"' in response.headers["content-disposition"]
    assert load(response.content).extents[1] == pytest.approx(0.88, abs=1e-5)


def test_an_edit_by_id_with_a_report(service_client: httpx.Client, chair_glb: bytes) -> None:
    files = {"mesh": ("chair.glb", chair_glb)}
    inferred = service_client.post("/infer", files=files).json()
    response = service_client.post(
        "/edit",
        data={"mesh_id": inferred["mesh_id"], "edits": '{"leg_height": {"add": 0.1}}'},
        headers={"accept": "application/json"},
    )
    assert response.status_code == 200, response.text
    report = EditReport.model_validate_json(response.content, extra="forbid")
    assert report.source_mesh_id == inferred["mesh_id"]
    change = report.parameters["leg_height"]
    assert change.after - change.before == pytest.approx(0.1)
    assert change.before == pytest.approx(inferred["parameters"]["leg_height"]["value"])
    assert 0 < report.vertices.moved <= report.vertices.total
    edited = service_client.get(f"/meshes/{report.mesh_id}")
    assert edited.headers["etag"] == f'"{report.mesh_id}"'
    assert load(edited.content).extents[1] == pytest.approx(0.98, abs=0.02)


@pytest.mark.parametrize("suffix", ["gltf", "obj", "ply", "stl", "off"])
def test_another_format(service_client: httpx.Client, chair_glb: bytes, suffix: str) -> None:
    response = service_client.post(
        "/edit",
        files={"mesh": ("chair.glb", chair_glb)},
        data={"edits": '{"seat_width": {"scale": 1.1}}', "format": suffix},
    )
    assert response.status_code == 200, response.text
    assert f'filename="chair-edited.{suffix}"' in response.headers["content-disposition"]
    assert response.headers["content-type"] == MEDIA_TYPES[f".{suffix}"]
    assert load(response.content, suffix).extents[0] == pytest.approx(0.528, abs=0.02)


@pytest.mark.parametrize(
    "edits",
    [
        "not json",
        "[]",
        "3",
        '{"seat_width": "wide"}',
        '{"seat_width": {"set": 0.4, "scale": 2}}',
        '{"seat_width": {"grow": 2}}',
        '{"seat_width": {"set": null}}',
        '{"seat_width": NaN}',
        '{"seat_width": {"scale": 1e999}}',
        '{"seat_width": {"add": -5}}',
        '{"seat_width": -0.4}',
        '{"seat_width": {"scale": -1}}',
        '{"seat_width": true}',
        '{"seat_with": 0.4}',
        '{"wing_length": {"scale": 2}}',
    ],
)
@pytest.mark.parametrize("accept", ["*/*", "application/json"])
def test_edits_that_make_no_sense(
    service_client: httpx.Client, problem: Any, chair_glb: bytes, edits: str, accept: str
) -> None:
    response = service_client.post(
        "/edit",
        files={"mesh": ("chair.glb", chair_glb)},
        data={"edits": edits},
        headers={"accept": accept},
    )
    problem(response, 422, response.json()["code"])
    assert service_client.get("/readyz").status_code == 200


def test_a_mistyped_parameter_is_told_with_those_that_there_are(
    service_client: httpx.Client, chair_glb: bytes
) -> None:
    response = service_client.post(
        "/edit", files={"mesh": ("chair.glb", chair_glb)}, data={"edits": '{"seat_with": 0.4}'}
    )
    document = response.json()
    assert "seat_with" in document["detail"]
    assert "seat_width" in document["detail"] + document["suggestion"]


def test_a_point_that_the_category_does_not_have(
    service_client: httpx.Client, problem: Any, chair_glb: bytes
) -> None:
    response = service_client.post(
        "/edit",
        files={"mesh": ("chair.glb", chair_glb)},
        data={"edits": '{"seat_width": 0.5}', "keep": "ceiling"},
    )
    document = problem(response, 422, "unknown_keep")
    assert "ceiling" in document.detail
    assert "floor" in document.suggestion


def test_real_edits_in_parallel_agree(service_client: httpx.Client, chair_glb: bytes) -> None:
    def edit(_: int) -> bytes:
        files = {"mesh": ("chair.glb", chair_glb)}
        response = service_client.post("/edit", files=files, data=EDITS)
        assert response.status_code == 200, response.text
        return response.content

    with ThreadPoolExecutor(2) as pool:
        answers = set(pool.map(edit, range(4)))
    assert len(answers) == 1


def test_an_edit_too_far_is_the_nearest_or_when_strict_refused(
    service_client: httpx.Client, problem: Any, chair_glb: bytes
) -> None:
    def send(**fields: str) -> httpx.Response:
        return service_client.post(
            "/edit",
            files={"mesh": ("chair.glb", chair_glb)},
            data={"edits": '{"leg_width": 0.4}', **fields},
        )

    near = json.loads(send().headers["shape-parameters"])
    assert near["leg_width"] == pytest.approx(0.4 * near["seat_width"], rel=0.005)
    document = problem(send(strict="true"), 422, "edit_out_of_bounds")
    assert "0.8 * seat_width - 2 * leg_width - 2 * leg_inset >= 0" in document.detail
    assert f"{near['leg_width']:.4g}" in document.suggestion


def constrain(
    client: httpx.Client, chair_glb: bytes, constraints: str, accept: str = "*/*", **fields: str
) -> httpx.Response:
    return client.post(
        "/edit",
        files={"mesh": ("chair.glb", chair_glb)},
        data={"constraints": constraints, **fields},
        headers={"accept": accept},
    )


def test_constraints_are_kept_by_the_mesh(service_client: httpx.Client, chair_glb: bytes) -> None:
    wishes = '{"total_height": {"max": 0.8}, "total_width": {"min": 0.5}, "seat_top_height": 0.43}'
    response = constrain(service_client, chair_glb, wishes)
    assert response.status_code == 200, response.text
    extents = load(response.content).extents
    assert extents[1] == pytest.approx(0.8, abs=2e-6)
    assert extents[0] == pytest.approx(0.5, abs=2e-6)
    values = json.loads(response.headers["shape-parameters"])
    assert values["seat_top_height"] == pytest.approx(0.43)
    # By the parameters it is as far off as the fit is.
    assert values["leg_height"] + values["seat_thickness"] == pytest.approx(0.43, rel=0.01)
    report = EditReport.model_validate_json(
        constrain(service_client, chair_glb, wishes, "application/json").content, extra="forbid"
    )
    height = report.dimensions["total_height"]
    assert (height.before, height.after) == (pytest.approx(0.88), pytest.approx(0.8))
    assert height.asked is not None
    assert height.asked.max == 0.8
    seat = report.dimensions["seat_top_height"]
    assert (seat.before, seat.after) == (pytest.approx(0.46), pytest.approx(0.43))
    assert report.dimensions["total_depth"].asked is None


def test_constraints_that_the_mesh_keeps_change_no_byte(
    service_client: httpx.Client, chair_glb: bytes
) -> None:
    for wishes in ("{}", '{"total_width": {"max": 0.6}, "leg_height": {"min": 0.3}}'):
        assert constrain(service_client, chair_glb, wishes).content == chair_glb
    both = constrain(service_client, chair_glb, "{}", edits='{"seat_width": 0.5}')
    alone = service_client.post(
        "/edit", files={"mesh": ("chair.glb", chair_glb)}, data={"edits": '{"seat_width": 0.5}'}
    )
    assert both.content == alone.content


def test_constraints_that_conflict_are_told_with_what_comes_nearest(
    service_client: httpx.Client, problem: Any, chair_glb: bytes
) -> None:
    response = constrain(
        service_client, chair_glb, '{"total_width": {"max": 0.4}}', edits='{"seat_width": 0.5}'
    )
    document = problem(response, 422, "constraints_conflict")
    assert "the edit of seat_width stays" in document.detail
    (conflict,) = response.json()["conflicts"]
    assert (conflict["name"], conflict["asked"], conflict["unit"]) == (
        "total_width", {"max": 0.4}, "m"
    )  # fmt: skip
    assert conflict["nearest"] - conflict["by"] == pytest.approx(0.4)
    again = constrain(
        service_client,
        chair_glb,
        json.dumps({"total_width": {"max": conflict["nearest"]}}),
        edits='{"seat_width": 0.5}',
    )
    assert again.status_code == 200, again.text


@pytest.mark.parametrize(
    ("wishes", "code"),
    [
        ("not json", "constraints_not_json"),
        ("[1]", "constraints_not_object"),
        ('{"seat_width": {"add": 1}}', "constraint_malformed"),
        ('{"seat_with": {"max": 1}}', "unknown_parameter"),
        ('{"seat_taper": {"max": 1}}', "unknown_parameter"),
        ('{"seat_width": {"max": 0}}', "constraints_conflict"),
        ('{"seat_width": {"min": 2, "max": 1}}', "constraints_conflict"),
    ],
)
def test_constraints_that_make_no_sense(
    service_client: httpx.Client, problem: Any, chair_glb: bytes, wishes: str, code: str
) -> None:
    problem(constrain(service_client, chair_glb, wishes), 422, code)
