"""What goes out of the page and comes into it: files, errors, downloads, code."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import httpx
import numpy as np
import pytest
from playwright.sync_api import Page, Route, expect
from viewing import Shoot, Viewer, Visit, opened, shown, typed, upload

from service.main import create_app
from service.mesh.formats import read_mesh
from service.settings import Settings


def downloaded(page: Page) -> tuple[str, bytes]:
    with page.expect_download() as download:
        page.click("#download")
    return download.value.suggested_filename, download.value.path().read_bytes()


def edit(client: httpx.Client, data: bytes, edits: str, **fields: str) -> bytes:
    answer = client.post("/edit", files={"mesh": ("a.glb", data)}, data={"edits": edits, **fields})
    assert answer.status_code == 200, answer.text
    return answer.content


def test_a_download_is_what_edit_answers(
    chair_page: Page, service_client: httpx.Client, sample: Callable[[str], bytes]
) -> None:
    page = chair_page
    assert downloaded(page)[1] == sample("chair"), "nothing was changed"
    typed(page, "p-seat_width-number", "0.6")
    typed(page, "p-leg_height-number", "0.45")
    edits = '{"seat_width": 0.6, "leg_height": 0.45}'
    name, data = downloaded(page)
    assert re.fullmatch(r"chair-\d+-edited.glb", name)
    assert data == edit(service_client, sample("chair"), edits)
    found, sent = read_mesh(data, name), read_mesh(sample("chair"), "chair.glb")
    np.testing.assert_array_equal(found.faces, sent.faces)
    for form in ("obj", "stl"):
        page.get_by_label("Format of the download").select_option(form)
        name, data = downloaded(page)
        assert name.endswith(f"-edited.{form}")
        expected = read_mesh(edit(service_client, sample("chair"), edits, format=form), name)
        np.testing.assert_array_equal(read_mesh(data, name).vertices, expected.vertices)
    page.get_by_label("Format of the download").select_option("")


def test_a_file_that_can_not_be_read_is_told_of_and_no_harm_done(
    chair_page: Page, shoot: Shoot
) -> None:
    page = chair_page
    title = page.locator("#file").inner_text()
    broken = {"name": "broken.glb", "mimeType": "model/gltf-binary", "buffer": b"glTF nonsense"}
    page.locator("#file-input").set_input_files([broken])
    alert = page.get_by_role("alert")
    expect(alert.locator(".trace code")).to_have_text(re.compile(r"^[0-9a-f]{32}$"))
    assert len(alert.locator("p").all_inner_texts()) >= 3, "detail, suggestion and trace"
    shoot(page, "error")
    expect(page.locator("#progress")).to_be_hidden()
    expect(page.locator("#file")).to_have_text(title)
    typed(page, "p-back_height-number", "0.5")
    assert shown(page, "p-back_height-number") == 0.5
    alert.get_by_role("button", name="Dismiss").click()
    expect(page.locator(".alert")).to_have_count(0)


def test_an_upload_can_be_cancelled(visit: Visit) -> None:
    page = visit()
    held: list[Route] = []
    page.route("**/sliders", lambda route: held.append(route))
    page.click("[data-sample=chair]")
    expect(page.get_by_role("status").first).to_have_text(re.compile("Uploading|Finding|Opening"))
    with page.expect_event("requestfailed"):
        page.get_by_role("button", name="Cancel").click()
    expect(page.locator("#progress")).to_be_hidden()
    expect(page.get_by_role("heading", level=2)).to_be_visible()
    expect(page.locator(".alert")).to_have_count(0)


def test_files_are_dropped_anywhere_several_as_one(
    viewer: Viewer, chair_page: Page, box_chair: object
) -> None:
    page = chair_page
    obj = box_chair.export(file_type="obj", include_normals=False)  # type: ignore[attr-defined]
    files = [["box.obj", "mtllib box.mtl\n" + obj], ["box.mtl", "newmtl oak\nKd 0.4 0.2 0.1\n"]]
    data = page.evaluate_handle(
        """(files) => {
            const data = new DataTransfer();
            for (const [name, text] of files) data.items.add(new File([text], name));
            return data;
        }""",
        files,
    )
    page.dispatch_event("body", "dragenter", {"dataTransfer": data})
    expect(page.locator("#dropping")).to_be_visible()
    page.dispatch_event("body", "drop", {"dataTransfer": data})
    expect(page.locator("#dropping")).to_be_hidden()
    expect(page.locator("#file")).to_have_text("box.zip")
    typed(page, "p-seat_width-number", "0.6")
    name, archive = downloaded(page)
    assert name == "box-edited.zip"
    assert archive[:2] == b"PK"


def test_a_mesh_that_the_cache_has_dropped_is_sent_again(
    visit: Visit, serve: Callable[..., httpx.Client], sample: Callable[[str], bytes]
) -> None:
    forgetful = serve(create_app(Settings(workers=1, mesh_cache_bytes=1)))
    page = opened(visit(str(forgetful.base_url)), "chair")
    statuses: list[int] = []
    page.on("response", lambda response: statuses.append(response.status))
    typed(page, "p-seat_width-number", "0.6")
    assert downloaded(page)[1] == edit(forgetful, sample("chair"), '{"seat_width": 0.6}')
    assert statuses == [404, 200]


@pytest.mark.parametrize("language", ["curl", "Python", "JavaScript"])
def test_the_code_runs_as_it_stands(
    viewer: Viewer,
    service_client: httpx.Client,
    sample: Callable[[str], bytes],
    tmp_path: Path,
    language: str,
) -> None:
    programs = {"curl": "curl", "Python": sys.executable, "JavaScript": "node"}
    if shutil.which(programs[language]) is None:
        pytest.skip(f"{programs[language]} is not installed")
    page = viewer("chair")
    # Everything that a shell or a form could take amiss.
    upload(page, 'it\'s; a, "chair" $HOME', sample("chair"))
    typed(page, "p-seat_width-number", "0.6")
    page.locator(".code").evaluate("(details) => { details.open = true; }")
    page.get_by_role("tab", name=language).click()
    expect(page.locator("#snippet")).to_contain_text("seat_width")
    code = page.locator("#snippet").inner_text()
    name = page.locator("#file").inner_text()
    (tmp_path / name).write_bytes(sample("chair"))
    script = tmp_path / {"curl": "edit.sh", "Python": "edit.py", "JavaScript": "edit.mjs"}[language]
    script.write_text(code)
    command = [programs[language] if language != "curl" else "sh", str(script)]
    subprocess.run(command, cwd=tmp_path, check=True, timeout=120, capture_output=True)
    made = tmp_path / f"{name.removesuffix('.glb')}-edited.glb"
    assert made.read_bytes() == edit(service_client, sample("chair"), '{"seat_width": 0.6}')
    page.get_by_role("tab", name="curl").click()


def test_options_are_sent_with_every_request(visit: Visit, box_chair: object) -> None:
    page = visit()
    page.get_by_text("Options for reading the file").click()
    expect(page.locator("#option-category option")).to_have_count(4)
    page.locator("#option-units").select_option("cm")
    page.locator("#option-category").select_option("chair")
    page.locator("#option-up").select_option("+y")
    scaled = box_chair.copy()  # type: ignore[attr-defined]
    scaled.apply_scale(100)
    upload(page, "stool", scaled.export(file_type="stl"), ".stl")
    # Metres in the picture, centimetres in the answer: 46 is 0.46 m here.
    assert shown(page, "d-seat_top_height") == pytest.approx(0.46, abs=0.05)
    assert (
        page.locator("#d-total_height").input_value() == f"{np.ptp(box_chair.vertices[:, 1]):.3f}"
    )  # type: ignore[attr-defined]
    page.locator(".code").evaluate("(details) => { details.open = true; }")
    typed(page, "p-seat_width-number", "0.6")
    expect(page.locator("#snippet")).to_contain_text("seat_width")
    text = page.locator("#snippet").inner_text()
    assert json.loads(text.split("edits=")[1].split("'")[0]) == {"seat_width": {"set": 60}}
    assert all(f"-F '{field}'" in text for field in ("category=chair", "up=+y", "units=cm"))
    assert "front=" not in text
    assert read_mesh(downloaded(page)[1], "stool.stl").vertices.max() > 40, "still in centimetres"
