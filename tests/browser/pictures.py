"""The page's own pictures, taken in a browser: run by hand when the page or the samples change.

    python tests/browser/pictures.py http://127.0.0.1:8000      # beside `make serve`

It writes the samples' thumbnails (service/web/samples/*.webp) and docs/viewer.png.
"""

from __future__ import annotations

import base64
import io
import sys
from pathlib import Path

from chromium import ARGUMENTS, chromium
from PIL import Image
from playwright.sync_api import Browser, sync_playwright

ROOT = Path(__file__).parents[2]

THUMBNAIL = """async (name) => {
  const THREE = await import("three");
  const { GLTFLoader } = await import("three/GLTFLoader");
  const { studio } = await import("/web/js/studio.js");
  const renderer = new THREE.WebGLRenderer(
    { antialias: true, alpha: true, preserveDrawingBuffer: true });
  renderer.setSize(1280, 960);
  renderer.toneMapping = THREE.NeutralToneMapping;
  const scene = new THREE.Scene();
  scene.environment = studio(renderer);
  scene.environmentIntensity = 0.7;
  const sun = new THREE.DirectionalLight(0xfff4e6, 1.8);
  sun.position.set(0.9, 2.1, 1.1);
  scene.add(sun);
  const { scene: root } = await new GLTFLoader().loadAsync(`web/samples/${name}.glb`);
  scene.add(root);
  const sphere = new THREE.Box3().setFromObject(root, true).getBoundingSphere(new THREE.Sphere());
  const camera = new THREE.PerspectiveCamera(28, 4 / 3, 0.01, 1000);
  const closer = { airplane: 0.66, chair: 1.1, human: 1.0 }[name];
  const from = name === "human" ? [0.45, 0.12, 1] : [0.8, 0.42, 1];
  camera.position.set(...from).normalize()
    .multiplyScalar(closer * sphere.radius / Math.sin(Math.PI * 14 / 180)).add(sphere.center);
  camera.lookAt(sphere.center);
  renderer.render(scene, camera);
  return renderer.domElement.toDataURL("image/png");
}"""


def thumbnails(browser: Browser, url: str) -> None:
    page = browser.new_page()
    page.goto(url)
    for name in ("chair", "airplane", "human"):
        data = page.evaluate(THUMBNAIL, name).partition(",")[2]
        picture = Image.open(io.BytesIO(base64.b64decode(data))).resize((640, 480), Image.LANCZOS)
        picture.save(ROOT / f"service/web/samples/{name}.webp", quality=82, method=6)
    page.close()


def readme(browser: Browser, url: str) -> None:
    """The page with a chair made higher, half its colours kept."""
    page = browser.new_page(viewport={"width": 1280, "height": 800}, color_scheme="light")
    page.add_init_script(NAMELESS)
    page.goto(url)
    page.click("[data-sample=chair]")
    number = page.locator("#p-back_height-number")
    number.fill("0.58")
    number.press("Enter")
    number.blur()
    page.evaluate("() => new Promise((done) => setTimeout(done, 800))")
    picture = Image.open(io.BytesIO(page.screenshot()))
    picture.convert("RGB").quantize(200, dither=Image.Dither.NONE).save(
        ROOT / "docs/viewer.png", optimize=True
    )
    page.close()


# Without the name of the renderer the page takes it for a graphics card, and draws its best.
NAMELESS = """
const get = WebGL2RenderingContext.prototype.getExtension;
WebGL2RenderingContext.prototype.getExtension = function (name) {
  return name === "WEBGL_debug_renderer_info" ? null : get.call(this, name);
};"""


def main() -> None:
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium(), args=ARGUMENTS)
        thumbnails(browser, sys.argv[1])
        readme(browser, sys.argv[1])
        browser.close()


if __name__ == "__main__":
    main()
