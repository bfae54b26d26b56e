"""Opening a mesh and moving its sliders, by mouse."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import httpx
import numpy as np
import pytest
from playwright.sync_api import Page, expect
from viewing import Picture, Shoot, Viewer, changed, drawn, shown, typed, view

from service.mesh.formats import read_mesh


def handle(page: Page, name: str) -> tuple[float, float]:
    """Where on the screen a slider's thumb is."""
    page.locator(f"#p-{name}").scroll_into_view_if_needed()
    place = page.locator(f"#p-{name}").evaluate(
        """(s) => {
            const r = s.getBoundingClientRect(), share = (s.value - s.min) / (s.max - s.min);
            return [r.x + 8 + share * (r.width - 16), r.y + r.height / 2];
        }"""
    )
    return place[0], place[1]


def drag(page: Page, name: str, by: int) -> None:
    x, y = handle(page, name)
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + by, y, steps=6)
    page.mouse.up()
    drawn(page)


def edited(client: httpx.Client, data: bytes, edits: dict[str, Any], **fields: str) -> Any:
    response = client.post(
        "/edit",
        files={"mesh": ("mesh.glb", data)},
        data={"edits": json.dumps(edits), **fields},
        headers={"Accept": "application/json"},
    )
    assert response.status_code == 200, response.text
    return response.json()


def edits_of(page: Page) -> dict[str, Any]:
    """The edit as the page's own snippet has it."""
    page.locator(".code").evaluate("(details) => { details.open = true; }")
    expect(page.locator("#snippet")).to_contain_text("curl")
    text = page.locator("#snippet").inner_text()
    return dict(json.loads(text.split("edits=")[1].split("'")[0]))


def test_a_drag_moves_the_mesh_with_no_request(
    chair_page: Page, service_client: httpx.Client, sample: Callable[[str], bytes], shoot: Shoot
) -> None:
    page = chair_page
    requests = requests_of(page)
    before = view(page)
    drag(page, "back_height", 70)
    drag(page, "seat_width", 50)
    after = view(page)
    assert requests == []
    assert changed(before, after) > 0.02
    shoot(page, "chair-edited")
    edits = edits_of(page)
    assert set(edits) == {"back_height", "seat_width"}
    report = edited(service_client, sample("chair"), edits)
    for name, change in report["parameters"].items():
        assert shown(page, f"p-{name}-number") == pytest.approx(change["after"], abs=6e-4)
    assert set(report["dimensions"]) == {
        "seat_top_height", "total_height", "total_width", "total_depth",
    }  # fmt: skip
    for name, change in report["dimensions"].items():
        assert shown(page, f"d-{name}") == pytest.approx(change["after"], abs=6e-4)
        assert page.locator(f"[data-dimension={name}]").is_visible()


def test_undo_redo_and_reset(chair_page: Page) -> None:
    page = chair_page
    undo, redo = page.locator("[data-tool=undo]"), page.locator("[data-tool=redo]")
    expect(undo).to_be_disabled()
    first = shown(page, "p-back_height-number")
    fresh = view(page)
    drag(page, "back_height", 60)
    second = shown(page, "p-back_height-number")
    assert second > first
    drag(page, "leg_height", 40)
    page.keyboard.press("Control+z")
    drawn(page)
    assert shown(page, "p-back_height-number") == second
    undo.click()
    drawn(page)
    assert shown(page, "p-back_height-number") == first
    # The focus has gone back and forth: all else is as it was.
    assert changed(fresh, view(page)) < 0.005
    page.keyboard.press("Control+Shift+z")
    assert shown(page, "p-back_height-number") == second
    redo.click()
    expect(redo).to_be_disabled()
    page.locator("[data-parameter=back_height] .undo-one").click()
    assert shown(page, "p-back_height-number") == first
    assert edits_of(page).keys() == {"leg_height"}
    page.locator("[data-tool=reset]").click()
    assert edits_of(page) == {}


def test_before_and_after_wires_sizes_and_template(chair_page: Page, shoot: Shoot) -> None:
    page = chair_page
    fresh = view(page)
    typed(page, "p-back_height-number", "0.6")
    after = view(page)
    page.click("[data-tool=compare]")
    drawn(page)
    assert page.locator("[data-tool=compare]").get_attribute("aria-pressed") == "true"
    assert changed(fresh, view(page)) < changed(fresh, after) / 2
    page.click("[data-tool=compare]")
    drawn(page)
    assert changed(after, view(page)) < 0.005
    for tool in ("wire", "template"):
        before = view(page)
        page.click(f"[data-tool={tool}]")
        if tool == "template":
            expect(page.locator("#announcer")).to_contain_text("template")
        drawn(page)
        assert changed(before, view(page)) > 0.004, tool
    shoot(page, "chair-template")
    expect(page.locator("#labels span").first).to_be_visible()
    page.click("[data-tool=ruler]")
    drawn(page)
    expect(page.locator("#labels span").first).to_be_hidden()


def test_units_change_what_is_written_and_nothing_else(chair_page: Page) -> None:
    page = chair_page
    metres = shown(page, "p-seat_width-number")
    requests = requests_of(page)
    for unit, factor, digits in (("cm", 100, 1), ("mm", 1000, 0), ("in", 1 / 0.0254, 2)):
        page.get_by_role("radio", name=unit, exact=True).check()
        value = shown(page, "p-seat_width-number")
        assert value == pytest.approx(metres * factor, abs=0.51 * 10**-digits + 6e-4 * factor)
        spoken = page.locator("#p-seat_width").get_attribute("aria-valuetext") or ""
        assert spoken.endswith(unit)
    assert edits_of(page) == {}
    page.get_by_role("radio", name="cm", exact=True).check()
    typed(page, "p-seat_width-number", "55,5")
    assert edits_of(page)["seat_width"]["set"] == pytest.approx(0.555)
    assert requests == []


def test_a_body_turns_its_arm_and_both_if_so_wished(
    viewer: Viewer, service_client: httpx.Client, sample: Callable[[str], bytes], shoot: Shoot
) -> None:
    page = viewer("human")
    page.locator("#labels [data-joint=left_elbow]").click()
    assert page.evaluate("() => document.activeElement.id") == "p-left_elbow_x"
    expect(page.locator("#p-left_elbow_x")).to_be_in_viewport()
    before = view(page)
    typed(page, "p-left_elbow_y-number", "-80")
    bent = view(page)
    left, right = halves_changed(before, bent)
    assert right > 0.002
    assert right > 2 * left, "the body's left is on the right of the picture, and only it moves"
    page.locator("#symmetric").check()
    drag(page, "left_shoulder_z", 20)
    assert changed(bent, view(page)) > 0.002
    shoot(page, "person-edited")
    edits = edits_of(page)
    for axis, sign in (("x", 1), ("y", -1), ("z", -1)):
        pair = edits.get(f"left_shoulder_{axis}"), edits.get(f"right_shoulder_{axis}")
        if all(pair):
            assert pair[1]["set"] == pytest.approx(sign * pair[0]["set"])
    assert edits["right_shoulder_z"]["set"] == pytest.approx(-edits["left_shoulder_z"]["set"])
    report = edited(service_client, sample("human"), edits)
    elbow = report["parameters"]["left_elbow_y"]["after"]
    assert shown(page, "p-left_elbow_y-number") == pytest.approx(elbow * 180 / 3.14159265, abs=0.06)
    page.locator("#symmetric").uncheck()
    typed(page, "d-stature", "1.85")
    expect(page.locator("#d-stature")).to_have_value("1.850")
    assert shown(page, "p-shape_0-number") != 0.3
    typed(page, "p-shape_0-number", "0")
    expect(page.locator("#d-stature")).not_to_have_value("1.850")


def requests_of(page: Page) -> list[str]:
    """The addresses that the page asks from now on."""
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    return asked


def halves_changed(before: Picture, after: Picture) -> tuple[float, float]:
    """How much of the left and of the right half of two pictures differs."""
    middle = before.shape[1] // 2
    halves = (slice(0, middle), slice(middle, None))
    left, right = (changed(before[:, half], after[:, half]) for half in halves)
    return left, right


def test_a_dimension_can_be_asked_for(
    chair_page: Page, service_client: httpx.Client, sample: Callable[[str], bytes]
) -> None:
    page = chair_page
    typed(page, "p-seat_depth-number", "0.5")
    typed(page, "d-total_height", "1.05")
    expect(page.locator("[data-dimension=total_height] .asked")).to_contain_text("1.050")
    expect(page.locator("#d-total_height")).to_have_value("1.050")
    edits = edits_of(page)
    assert edits["seat_depth"]["set"] == 0.5
    assert len(edits) > 1
    report = edited(service_client, sample("chair"), edits)
    assert report["derived"]["total_height"]["after"] == pytest.approx(1.05, abs=1e-3)
    page.locator("[data-dimension=total_height] select").select_option("max")
    typed(page, "d-total_height", "0.85")
    expect(page.locator("#d-total_height")).to_have_value("0.850")
    page.keyboard.press("Escape")
    page.locator("[data-tool=undo]").click()
    expect(page.locator("#d-total_height")).to_have_value("1.050")


def test_what_can_not_be_had_together_is_said(chair_page: Page, shoot: Shoot) -> None:
    page = chair_page
    for name in ("leg_height", "seat_thickness"):
        typed(page, f"p-{name}-number", str(shown(page, f"p-{name}-number") + 0.01))
    typed(page, "d-seat_top_height", "0.9")
    alert = page.locator(".alert")
    expect(alert).to_contain_text("can't all be had")
    expect(alert.locator("li").first).to_contain_text("0.900")
    shoot(page, "conflict")
    alert.get_by_role("button", name="Let the sliders").click()
    expect(page.locator("#d-seat_top_height")).to_have_value("0.900")
    expect(alert).to_have_count(0)


def test_a_limit_that_is_broken_is_told_beside_the_slider(chair_page: Page) -> None:
    page = chair_page
    typed(page, "p-leg_width-number", "0.4")
    warning = page.locator("[data-parameter=leg_width] .row-warn")
    expect(warning).to_be_visible()
    page.keyboard.press("Control+z")
    typed(page, "p-leg_width-number", "0.04")
    expect(warning).to_be_hidden()


def test_a_new_file_takes_the_place_of_the_last(chair_page: Page, viewer: Viewer) -> None:
    typed(chair_page, "p-back_height-number", "0.6")
    viewer("airplane")
    expect(chair_page.locator("#panel h2")).to_have_text("Airplane")
    expect(chair_page.locator("[data-tool=undo]")).to_be_disabled()


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("chair", {"seat_width": 0.1, "leg_height": -0.05, "back_height": 0.1}),
        ("human", {"left_elbow_y": -1.0, "right_hip_x": -0.7, "shape_0": 1.0, "shape_1": -0.5}),
    ],
)
def test_the_loader_of_three_js_reads_what_an_edit_makes(
    chair_page: Page,
    service_client: httpx.Client,
    sample: Callable[[str], bytes],
    name: str,
    changes: dict[str, float],
) -> None:
    read = chair_page.evaluate(THREE_JS_READS, {"name": name, "changes": changes})
    assert set(changes) <= set(read["values"])
    assert all(low <= value <= high for value, (low, high) in read["ranges"].values())
    edits = {key: {"set": value} for key, value in read["values"].items() if key in changes}
    files = {"mesh": (f"{name}.glb", sample(name))}
    answer = service_client.post("/edit", files=files, data={"edits": json.dumps(edits)})
    expected = read_mesh(answer.content, "a.glb").vertices
    found = np.array(read["vertices"]).reshape(-1, 3)
    size = np.linalg.norm(np.ptp(expected, axis=0))
    # A body's mesh bends where it is bound to several joints, and its lowest point may be another.
    tolerance = 1e-5 if name == "chair" else 3e-3
    assert np.abs(found - expected).max() < tolerance * size


THREE_JS_READS = """async ({ name, changes }) => {
  const { Figure } = await import(new URL("web/js/figure.js", document.baseURI));
  const THREE = await import("three");
  const form = new FormData();
  form.append("mesh", await (await fetch(`web/samples/${name}.glb`)).blob(), `${name}.glb`);
  const answer = await fetch("sliders", { method: "POST", body: form });
  const figure = await Figure.parse(await answer.arrayBuffer());
  const parameters = Object.entries(figure.notes.parameters);
  const moved = parameters.map(([key, p]) => [key, p.value + (changes[key] ?? 0)]);
  const values = Object.fromEntries(moved);
  figure.show(values);
  figure.root.updateMatrixWorld(true);
  const vertices = [];
  const point = new THREE.Vector3();
  for (const { mesh } of figure.meshes) {
    for (let i = 0; i < mesh.geometry.attributes.position.count; i += 1) {
      mesh.getVertexPosition(i, point).applyMatrix4(mesh.matrixWorld);
      vertices.push(point.x, point.y, point.z);
    }
  }
  const named = parameters.filter(([key]) => key in changes || !figure.joints.length);
  const ranges = Object.fromEntries(named.map(([key, p]) => [key, [p.value, p.range]]));
  return { values, vertices, ranges };
}"""
