from __future__ import annotations

import json
import zipfile
from pathlib import Path

import pytest
from cli_runs import Run, documents, extents

from service.client import ShapeClient


@pytest.fixture
def job(debug_url: str, box_glb: Path) -> str:
    """The id of a job that makes three variants of a box."""
    with ShapeClient(debug_url) as client:
        return client.submit_augment(box_glb, category="debug", count=3).id


@pytest.fixture
def jobs(shape_edit: Run, debug_url: str) -> Run:
    return lambda *words: shape_edit("jobs", *words, "--url", debug_url)


def test_a_job_is_waited_for_and_its_result_written(jobs: Run, job: str, tmp_path: Path) -> None:
    out = tmp_path / "variants.zip"
    done = jobs("wait", job, "-o", out)
    assert done.exit_code == 0, done.output
    assert "succeeded  3 of 3" in done.stdout
    assert "variants/002.glb" in zipfile.ZipFile(out).namelist()
    assert "file_exists" in jobs("wait", job, "-o", out).stderr
    (shown,) = documents(jobs("show", job, "--json"))
    assert (shown["id"], shown["status"]) == (job, "succeeded")
    assert set(shown["links"]) == {"self", "events", "result"}


def test_jobs_are_listed_and_removed(jobs: Run, job: str) -> None:
    assert jobs("wait", job, "-q").stdout == ""
    (listed,) = documents(jobs("list", "--json"))
    assert job in [entry["id"] for entry in listed["jobs"]]
    assert job in jobs("list").stdout
    assert jobs("cancel", job).stdout == f"{job} is removed\n"
    gone = jobs("cancel", job, "--json")
    assert gone.exit_code == 1
    assert documents(gone)[0]["code"] == "job_unknown"


def test_a_job_that_failed_is_a_failure(jobs: Run, debug_url: str, tmp_path: Path) -> None:
    bad = tmp_path / "bad.glb"
    bad.write_bytes(b"no mesh")
    with ShapeClient(debug_url) as client:
        job = client.submit_augment(bad, category="debug").id
    done = jobs("wait", job)
    assert done.exit_code == 1
    assert "malformed_glb" in done.stdout


def test_jobs_are_at_a_service(shape_edit: Run) -> None:
    done = shape_edit("jobs", "list")
    assert done.exit_code == 2
    assert "--url" in done.stderr


def test_a_folder_is_varied_at_a_service(
    shape_edit: Run, debug_url: str, box_glb: Path, tall_glb: Path, tmp_path: Path
) -> None:
    box_glb.with_name("bad.glb").write_bytes(b"no mesh")
    out = tmp_path / "varied"
    line = ["augment", box_glb.parent, "--out", out, "-n", "2", "-c", "debug", "--json"]
    done = shape_edit(*line, "--url", debug_url)
    assert done.exit_code == 1, done.output
    (summary,) = documents(done)
    counts = {name: summary[name] for name in ("sources", "kept", "done", "failed", "ok")}
    assert counts == {"sources": 3, "kept": 0, "done": 3, "failed": 1, "ok": 4}
    assert summary["failures"][0]["file"] == "bad.glb"
    (folder,) = out.glob("tall-*")
    rows = [json.loads(row) for row in (folder / "manifest.jsonl").read_text().splitlines()]
    assert [len(extents(folder / row["file"])) for row in rows] == [3, 3]
    (again,) = documents(shape_edit(*line, "--url", debug_url))
    assert (again["kept"], again["done"]) == (2, 1)


def test_what_a_service_has_none_of_is_refused(
    shape_edit: Run, debug_url: str, tmp_path: Path
) -> None:
    line = ["augment", tmp_path, "--out", tmp_path / "out", "--url", debug_url]
    assert shape_edit(*line, "--shard", "1/2").exit_code == 2
    empty = shape_edit(*line)
    assert empty.exit_code == 1
    assert "no_meshes" in empty.stderr
