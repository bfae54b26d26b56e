"""The page for everyone: by keyboard, on a phone, in the dark, without WebGL."""

from __future__ import annotations

import re
from typing import Any

import pytest
from playwright.sync_api import Page, expect
from viewing import Shoot, Visit, drawn, opened, shown, typed

PHONE: dict[str, Any] = {
    "viewport": {"width": 390, "height": 844},
    "has_touch": True,
    "is_mobile": True,
}
NO_WEBGL = """
const get = HTMLCanvasElement.prototype.getContext;
HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
  return kind.startsWith("webgl") ? null : get.call(this, kind, ...rest);
};"""

# What a page must not do, with what does it.
FAULTS = """() => {
  const faults = [];
  const seen = (e) => e.checkVisibility({ visibilityProperty: true });
  const nameOf = (e) => {
    const labels = [...(e.labels ?? [])].map((l) => l.innerText).join(" ");
    const by = (e.getAttribute("aria-labelledby") ?? "").split(" ")
      .map((id) => document.getElementById(id)?.textContent ?? "").join(" ");
    return (e.getAttribute("aria-label") ?? by).trim() || labels.trim() || e.textContent.trim();
  };
  const all = (selector) => [...document.querySelectorAll(selector)];
  for (const e of all("input, select, textarea, button, a, canvas, summary, progress"))
    if (seen(e) && !nameOf(e)) faults.push(["no name", e.outerHTML.slice(0, 120)]);
  for (const e of all("img:not([alt])")) faults.push(["no alt", e.src]);
  const ids = [...document.querySelectorAll("[id]")].map((e) => e.id);
  for (const id of ids) if (ids.indexOf(id) !== ids.lastIndexOf(id)) faults.push(["id twice", id]);
  for (const e of document.querySelectorAll("[aria-describedby], [aria-controls], [for]"))
    for (const a of ["aria-describedby", "aria-controls", "for"])
      for (const id of (e.getAttribute(a) ?? "").split(" ").filter(Boolean))
        if (!document.getElementById(id)) faults.push([a + " of nothing", id]);
  let level = 0;
  for (const e of [...document.querySelectorAll("h1, h2, h3, h4")].filter(seen)) {
    const own = Number(e.tagName[1]);
    if (own > level + 1) faults.push(["heading skips a level", e.textContent]);
    level = own;
  }
  for (const e of all("button, a.button, label.button, summary, select, input[type=text]")) {
    const box = e.getBoundingClientRect();
    if (seen(e) && box.width && (box.width < 24 || box.height < 24) && !e.closest("p"))
      faults.push(["small target", e.outerHTML.slice(0, 120), box.width, box.height]);
  }
  const parse = (c) => {
    const context = new OffscreenCanvas(1, 1).getContext("2d", { willReadFrequently: true });
    context.fillStyle = c;
    context.fillRect(0, 0, 1, 1);
    return [...context.getImageData(0, 0, 1, 1).data];
  };
  const light = ([r, g, b]) => [r, g, b].map((v) => v / 255)
    .map((v) => (v <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4))
    .reduce((sum, v, i) => sum + v * [0.2126, 0.7152, 0.0722][i], 0);
  const behind = (e) => {
    for (let at = e; at; at = at.parentElement) {
      const c = parse(getComputedStyle(at).backgroundColor);
      if (c[3] > 250) return c;
    }
    return parse(getComputedStyle(document.body).backgroundColor);
  };
  const texts = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (texts.nextNode()) {
    const e = texts.currentNode.parentElement;
    if (!texts.currentNode.textContent.trim() || !seen(e)) continue;
    if (e.closest(".sr, .skip, script, option, :disabled")) continue;
    const both = [light(parse(getComputedStyle(e).color)), light(behind(e))];
    const ratio = (Math.max(...both) + 0.05) / (Math.min(...both) + 0.05);
    if (ratio < 4.5) faults.push(["contrast " + ratio.toFixed(2), e.outerHTML.slice(0, 120)]);
  }
  return faults;
}"""


def background(page: Page, selector: str) -> list[int]:
    color = page.locator(selector).evaluate("(e) => getComputedStyle(e).backgroundColor")
    return [int(part) for part in re.findall(r"\d+", color)[:3]]


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_everything_has_a_name_and_can_be_read(visit: Visit, shoot: Shoot, scheme: str) -> None:
    page = visit(color_scheme=scheme)
    assert page.evaluate(FAULTS) == []
    shoot(page, f"start-{scheme}")
    opened(page, "chair")
    typed(page, "p-seat_width-number", "0.6")
    page.locator(".code").evaluate("(details) => { details.open = true; }")
    shoot(page, f"chair-{scheme}")
    assert page.evaluate(FAULTS) == []
    assert (sum(background(page, "#panel")) < 200) is (scheme == "dark")
    # A choice of one's own is kept.
    theme = page.locator("#theme")
    for choice in ("light", "dark"):
        theme.click()
        expect(theme).to_have_attribute("aria-label", re.compile(choice))
        expect(page.locator("html")).to_have_attribute("data-theme", choice)
    page.reload()
    expect(page.locator("html")).to_have_attribute("data-theme", "dark")
    page.locator("#theme").click()
    expect(page.locator("html")).to_have_attribute("data-theme", scheme)


def test_by_keyboard_alone(visit: Visit) -> None:
    page = visit()
    page.keyboard.press("Tab")
    expect(page.locator(":focus")).to_have_text("Skip to the parameters")

    def tab_to(selector: str) -> None:
        for _ in range(80):
            page.keyboard.press("Tab")
            if page.evaluate("(s) => document.activeElement.matches(s)", selector):
                return
        raise AssertionError(f"Tab does not lead to {selector}")

    tab_to("[data-sample=chair]")
    page.keyboard.press("Enter")
    expect(page.locator("#panel h2")).to_be_visible()
    tab_to("#p-back_height")
    assert page.evaluate("() => getComputedStyle(document.activeElement).appearance") == "none"
    first = shown(page, "p-back_height-number")
    for _ in range(3):
        page.keyboard.press("ArrowRight")
    stepped = shown(page, "p-back_height-number")
    assert stepped > first
    page.keyboard.press("PageUp")
    assert shown(page, "p-back_height-number") > stepped + (stepped - first)
    page.keyboard.press("Control+z")
    assert shown(page, "p-back_height-number") == stepped
    page.keyboard.press("End")
    drawn(page)
    ends = page.locator("#p-back_height").evaluate("(s) => [s.value, s.max]")
    assert ends[0] == ends[1]
    tab_to("#download")
    with page.expect_download():
        page.keyboard.press("Enter")
    expect(page.locator("#announcer")).to_contain_text("Downloaded")
    tab_to("#view")
    before = page.locator("#labels span").first.get_attribute("style")
    page.keyboard.press("ArrowLeft")
    drawn(page)
    assert page.locator("#labels span").first.get_attribute("style") != before


def test_on_a_phone(visit: Visit, shoot: Shoot) -> None:
    page = visit(**PHONE)
    assert page.evaluate("() => document.documentElement.scrollWidth") == 390
    shoot(page, "phone-start")
    page.tap("[data-sample=chair]")
    expect(page.locator("#panel h2")).to_be_visible()
    drawn(page)
    shoot(page, "phone-chair")
    assert page.evaluate("() => document.documentElement.scrollWidth") == 390
    assert page.evaluate(FAULTS) == []
    panel, grip = (
        page.locator("#panel"),
        page.get_by_role("button", name="Height of the parameters"),
    )
    half = panel.bounding_box()
    assert half is not None
    assert half["y"] > 300, "the mesh is seen above the sliders"
    grip.tap()
    expect(panel).to_have_attribute("data-sheet", "full")
    grip.tap()
    expect(panel).to_have_attribute("data-sheet", "peek")
    grip.tap()
    expect(panel).to_have_attribute("data-sheet", "half")
    slider = page.locator("#p-back_height")
    box = slider.bounding_box()
    assert box is not None
    before = shown(page, "p-back_height-number")
    page.touchscreen.tap(box["x"] + 0.8 * box["width"], box["y"] + box["height"] / 2)
    drawn(page)
    assert shown(page, "p-back_height-number") > before
    tools = page.locator("#toolbar").bounding_box()
    assert tools is not None
    assert tools["x"] >= 0
    assert tools["x"] + tools["width"] <= 390


def test_without_webgl_the_parameters_still_work(visit: Visit, shoot: Shoot) -> None:
    page = visit(prepare=NO_WEBGL)
    page.click("[data-sample=chair]")
    expect(page.locator("#panel h2")).to_be_visible()
    expect(page.get_by_text("shows no WebGL")).to_be_visible()
    height = shown(page, "d-total_height")
    typed(page, "p-back_height-number", str(shown(page, "p-back_height-number") + 0.1))
    assert shown(page, "d-total_height") == pytest.approx(height + 0.1, abs=2e-3)
    with page.expect_download():
        page.click("#download")
    shoot(page, "no-webgl")
