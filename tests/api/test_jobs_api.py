from __future__ import annotations

import io
import json
import time
import zipfile
from typing import Any

import httpx
import pytest

from service.api.keys import Entry, digest_of, new_key
from service.main import create_app
from service.settings import Settings

ASYNC = {"Prefer": "respond-async"}
VARIANTS = [{"seat_width": {"scale": 1.1}}, {"nope": 1}, {"leg_height": {"scale": 0.9}}, {}]


def ask(
    client: httpx.Client,
    mesh: bytes,
    variants: Any = VARIANTS,
    path: str = "/edit",
    headers: dict[str, str] | None = None,
    **fields: str,
) -> httpx.Response:
    data = {"category": "chair", **fields}
    if variants is not None:
        data["variants"] = variants if isinstance(variants, str) else json.dumps(variants)
    files = {"mesh": ("a chair.glb", mesh)}
    return client.post(path, files=files, data=data, headers=headers or {})


def finished(client: httpx.Client, job: dict[str, Any]) -> dict[str, Any]:
    end = time.monotonic() + 60
    while job["status"] in ("queued", "running"):
        assert time.monotonic() < end
        time.sleep(0.02)
        job = client.get(job["links"]["self"]).json()
    return job


def unzipped(answer: httpx.Response) -> dict[str, bytes]:
    assert answer.status_code == 200, answer.text
    assert answer.headers["content-type"] == "application/zip"
    with zipfile.ZipFile(io.BytesIO(answer.content)) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def rows(files: dict[str, bytes]) -> list[dict[str, Any]]:
    return [json.loads(line) for line in files["manifest.jsonl"].splitlines()]


def events(text: str) -> list[tuple[int, dict[str, Any]]]:
    found = []
    for block in text.split("\n\n"):
        lines = dict(line.split(": ", 1) for line in block.splitlines() if line[0] != ":")
        if lines.get("event") == "status":
            found.append((int(lines["id"]), json.loads(lines["data"])))
    return found


def test_variants_are_what_single_edits_are(service_client: httpx.Client, chair_glb: bytes) -> None:
    answer = ask(service_client, chair_glb)
    assert answer.headers["content-disposition"].startswith("attachment; filename=")
    files = unzipped(answer)
    assert list(files) == [f"variants/{i:03d}.glb" for i in (0, 2, 3)] + ["manifest.jsonl"]
    manifest = rows(files)
    assert [row["index"] for row in manifest] == [0, 1, 2, 3]
    assert manifest[1]["problem"]["code"] == "unknown_parameter"
    assert manifest[1]["file"] is None
    for index in (0, 2, 3):
        single = ask(service_client, chair_glb, None, edits=json.dumps(VARIANTS[index]))
        assert files[manifest[index]["file"]] == single.content
        assert manifest[index]["edits"] == VARIANTS[index]


def test_a_zip_that_the_client_holds(service_client: httpx.Client, chair_glb: bytes) -> None:
    tag = ask(service_client, chair_glb).headers["etag"]
    again = ask(service_client, chair_glb, headers={"If-None-Match": tag})
    assert (again.status_code, again.headers["etag"]) == (304, tag)


@pytest.mark.parametrize("path", ["/edit", "/augment"])
def test_a_job_makes_the_same_zip(
    service_client: httpx.Client, chair_glb: bytes, path: str
) -> None:
    given = {"variants": VARIANTS} if path == "/edit" else {"variants": None, "count": "3"}
    at_once = ask(service_client, chair_glb, path=path, **given)
    answer = ask(service_client, chair_glb, path=path, headers=ASYNC, **given)
    job = answer.json()
    assert answer.status_code == 202
    assert answer.headers["location"] == job["links"]["self"] == f"/jobs/{job['id']}"
    assert answer.headers["preference-applied"] == "respond-async"
    assert answer.headers["vary"] == "Prefer"
    assert int(answer.headers["retry-after"]) >= 1
    assert job["durable"] is False
    job = finished(service_client, job)
    assert (job["status"], job["problem"]) == ("succeeded", None)
    assert service_client.get(job["links"]["result"]).content == at_once.content
    assert job["id"] in [own["id"] for own in service_client.get("/jobs").json()["jobs"]]
    assert service_client.delete(job["links"]["self"]).status_code == 204
    assert service_client.get(job["links"]["self"]).status_code == 404


def test_labels_are_of_each_vertex(service_client: httpx.Client, chair_glb: bytes) -> None:
    files = unzipped(ask(service_client, chair_glb, None, "/augment", count="2", seed="5"))
    labels = json.loads(files["labels.json"])
    assert set(labels["labels"]) <= set(range(len(labels["parts"])))
    first, second = rows(files)
    assert first["provenance"]["seed"] == 5
    assert first["sha256"] != second["sha256"]


def test_a_course_in_events(service_client: httpx.Client, chair_glb: bytes) -> None:
    many = [{"seat_width": {"scale": 1 + index / 100}} for index in range(20)]
    job = ask(service_client, chair_glb, many, headers=ASYNC).json()
    answer = service_client.get(job["links"]["events"])
    assert answer.headers["content-type"].startswith("text/event-stream")
    assert answer.headers["cache-control"] == "no-store"
    assert answer.headers["x-accel-buffering"] == "no"
    assert answer.text.startswith("retry: ")
    told = events(answer.text)
    assert [number for number, _ in told] == sorted({number for number, _ in told})
    assert told[-1][1]["status"] == "succeeded"
    assert told[-1][1]["progress"] == {"done": 20, "total": 20}
    last, early = str(told[-1][0]), str(told[-1][0] - 1)
    again = service_client.get(job["links"]["events"], headers={"Last-Event-ID": early})
    assert events(again.text) == told[-1:]
    heard = service_client.get(job["links"]["events"], headers={"Last-Event-ID": last})
    assert heard.status_code == 204


def test_events_end_at_the_drain(serve: Any, chair_glb: bytes) -> None:
    app = create_app(Settings(workers=1))
    client = serve(app)
    many = [{"seat_width": {"scale": 1 + index / 2000}} for index in range(900)]
    job = ask(client, chair_glb, many, headers=ASYNC).json()
    with client.stream("GET", job["links"]["events"]) as answer:
        lines = answer.iter_lines()
        assert next(line for line in lines if line.startswith("data:"))
        app.state.context.readiness.drain()
        for _ in lines:
            pass
    assert client.get(job["links"]["self"]).json()["status"] == "running"


def test_cancelling(service_client: httpx.Client, chair_glb: bytes, problem: Any) -> None:
    many = [{"seat_width": {"scale": 1 + index / 2000}} for index in range(900)]
    job = ask(service_client, chair_glb, many, headers=ASYNC).json()
    early = service_client.get(job["links"]["result"])
    problem(early, 409, "job_not_finished")
    assert early.headers["retry-after"] == "1"
    answer = service_client.delete(job["links"]["self"])
    assert (answer.status_code, answer.json()["status"]) == (200, "cancelled")
    problem(service_client.get(job["links"]["result"]), 409, "job_cancelled")


def test_a_failed_job_tells_the_problem_of_the_plain_call(
    service_client: httpx.Client, problem: Any
) -> None:
    at_once = problem(ask(service_client, b"glTF"), 422, "malformed_glb")
    job = finished(service_client, ask(service_client, b"glTF", headers=ASYNC).json())
    told = job["problem"]
    assert job["status"] == "failed"
    for name in ("status", "title", "code", "detail", "suggestion"):
        assert told[name] == getattr(at_once, name)
    problem(service_client.get(job["links"]["result"]), 409, "job_failed")


def test_a_key_is_good_for_one_job(
    service_client: httpx.Client, chair_glb: bytes, problem: Any
) -> None:
    headers = {**ASYNC, "Idempotency-Key": new_key()}
    ids = {ask(service_client, chair_glb, headers=headers).json()["id"] for _ in range(3)}
    assert len(ids) == 1
    other = ask(service_client, chair_glb, [{}], headers=headers)
    problem(other, 409, "idempotency_conflict")


@pytest.mark.parametrize("headers", [{}, ASYNC])
@pytest.mark.parametrize(
    ("variants", "code"),
    [
        ("[", "variants_not_json"),
        ("[" * 5000, "variants_not_json"),
        ('[{"a": 1, "a": 2}]', "variants_not_json"),
        ('[{"a": NaN}]', "variants_not_json"),
        ('[{"a": 1e999}]', "variants_malformed"),
        ('[{"a": {"set": [[1]]}}]', "variants_malformed"),
        ('[{"a": %s}]' % ('{"a":' * 900 + "1" + "}" * 900), "variants_malformed"),
        ("{}", "variants_malformed"),
        ("[]", "variants_malformed"),
        ("[1]", "variants_malformed"),
        (json.dumps([{}] * 1001), "variants_too_many"),
    ],
)  # fmt: skip
def test_variants_that_make_no_sense(
    service_client: httpx.Client,
    chair_glb: bytes,
    problem: Any,
    variants: str,
    code: str,
    headers: dict[str, str],
) -> None:
    problem(ask(service_client, chair_glb, variants, headers=headers), 422, code)


def test_variants_stand_alone(service_client: httpx.Client, chair_glb: bytes, problem: Any) -> None:
    problem(ask(service_client, chair_glb, edits="{}"), 422, "variants_exclusive")


@pytest.mark.parametrize(
    ("fields", "code"),
    [({"count": "0"}, "field_invalid"), ({"count": "1001"}, "field_invalid"),
     ({"seed": "-1"}, "field_invalid"), ({"strength": "1.5"}, "field_invalid"),
     ({"strength": "nan"}, "field_invalid"), ({"strict": "1"}, "unknown_field"),
     ({"category": "sofa"}, "unknown_category"), ({"keep": "nose"}, "unknown_keep")],
)  # fmt: skip
def test_draws_that_make_no_sense(
    service_client: httpx.Client,
    chair_glb: bytes,
    problem: Any,
    fields: dict[str, str],
    code: str,
) -> None:
    problem(ask(service_client, chair_glb, None, "/augment", **fields), 422, code)


def test_what_is_no_job(service_client: httpx.Client, problem: Any) -> None:
    for path in ("/jobs/job-x", "/jobs/job-x/events", "/jobs/job-x/result", "/jobs/%00"):
        problem(service_client.get(path), 404, "job_unknown")
    problem(service_client.delete("/jobs/job-x"), 404, "job_unknown")


def test_bounds_are_told(serve: Any, chair_glb: bytes, problem: Any) -> None:
    client = serve(create_app(Settings(workers=1, jobs_bytes=1000)))
    problem(ask(client, chair_glb, headers=ASYNC), 413, "job_too_large")
    client = serve(create_app(Settings(workers=1, jobs=1)))
    many = [{"seat_width": {"scale": 1 + index / 2000}} for index in range(900)]
    ask(client, chair_glb, many, headers=ASYNC)
    full = ask(client, chair_glb, headers=ASYNC)
    problem(full, 429, "jobs_full")
    assert int(full.headers["retry-after"]) >= 1
    client = serve(create_app(Settings(workers=1, max_pending_bytes=len(chair_glb) + 3000)))
    problem(ask(client, chair_glb, [{}] * 3), 413, "variants_too_large")


def test_each_owner_sees_their_own_jobs_alone(serve: Any, chair_glb: bytes, problem: Any) -> None:
    keys = {name: new_key() for name in ("ann", "bob")}
    entries = ",".join(str(Entry(name, digest_of(key))) for name, key in keys.items())
    client = serve(create_app(Settings(workers=1, api_keys=entries)))
    ann, bob = ({"X-API-Key": keys[name]} for name in ("ann", "bob"))
    job = ask(client, chair_glb, headers={**ASYNC, **ann}).json()
    links = job["links"]
    for path in links.values():
        problem(client.get(path, headers=bob), 404, "job_unknown")
        problem(client.get(path), 401, "key_missing")
    problem(client.delete(links["self"], headers=bob), 404, "job_unknown")
    assert client.get("/jobs", headers=bob).json() == {"jobs": []}
    assert [own["id"] for own in client.get("/jobs", headers=ann).json()["jobs"]] == [job["id"]]


def test_a_page_of_another_origin_ends_no_job(service_client: httpx.Client, problem: Any) -> None:
    headers = {"Sec-Fetch-Site": "cross-site", "Origin": "https://evil.example"}
    problem(service_client.delete("/jobs/job-x", headers=headers), 403, "cross_site")


def test_a_broken_database_takes_no_other_call_down(
    serve: Any, chair_glb: bytes, problem: Any, tmp_path: Any
) -> None:
    (tmp_path / "jobs.sqlite").write_bytes(b"no database" * 1000)
    client = serve(create_app(Settings(workers=1, jobs_dir=tmp_path)))
    problem(ask(client, chair_glb, headers=ASYNC), 503, "jobs_unavailable")
    problem(client.get("/jobs"), 503, "jobs_unavailable")
    assert unzipped(ask(client, chair_glb))
    assert client.get("/metrics").status_code == 200


def test_metrics_of_jobs(serve: Any, chair_glb: bytes) -> None:
    client = serve(create_app(Settings(workers=1)))
    finished(client, ask(client, chair_glb, headers=ASYNC).json())
    text = client.get("/metrics").text
    assert 'shape_parameters_jobs{status="succeeded"} 1.0' in text
    assert 'shape_parameters_job_variants_total{kind="edit",result="ok"} 3.0' in text
    assert 'shape_parameters_job_variants_total{kind="edit",result="failed"} 1.0' in text
    assert 'route="/jobs/{job_id}"' in text
