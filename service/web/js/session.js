// A mesh that is open: its shape, its picture, and everything that is done with both.

import * as THREE from "three";
import { $, announce, save } from "./dom.js";
import { History } from "./history.js";
import { keyring } from "./key.js";
import { Measure } from "./measure.js";
import { Overlay } from "./overlay.js";
import { fillPanel } from "./panel.js";
import { clearProblems, showProblem } from "./problem.js";
import { Readout } from "./readout.js";
import { Shape } from "./shape.js";
import { Sliders } from "./sliders.js";
import { Snippet, outputName } from "./snippet.js";
import { Wishes } from "./wishes.js";

/** Measuring may take this share of the time while a slider moves. */
const MEASURING = 0.25;
const AXES = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];

export class Session {
  /** @param scene null where there is no WebGL */
  constructor({ figure, source, scene, lines, dots, units, tools }) {
    Object.assign(this, { figure, source, scene, lines, units, tools });
    this.shape = new Shape(figure.notes);
    source.meshId = this.shape.notes.mesh_id;
    this.measurer = new Measure(figure);
    this.shape.measure = this.measurer;
    this.before = false;
    this.format = "";
    this.history = new History(this.shape);
    this.wishes = new Wishes(this);
    this.sliders = new Sliders(this.shape, units);
    this.readout = new Readout(this.shape, units, (name, wish) => this.wishes.ask(name, wish));
    this.snippet = new Snippet(() => this.request());
    fillPanel($("panel"), { ...this, file: source.file }, {
      download: (format) => this.download(format),
      format: (format) => {
        this.format = format;
        this.snippet.update();
      },
    });
    if (scene) {
      scene.place(figure, this.shape.notes.frame?.rotation);
      lines.use(this.shape);
      dots.use(figure, (joint) => this.sliders.reveal(joint));
      tools.buttons.ruler.hidden = !lines.marks.length;
      tools.buttons.joints.hidden = !dots.dots.length;
      this.overlay = new Overlay(scene, source, { keep: this.shape.notes.keep });
      this.wires = figure.echo(new THREE.MeshBasicMaterial({ color: 0x7d8796, wireframe: true, transparent: true, opacity: 0.55 }));
      for (const twin of this.wires) twin.visible = tools.pressed("wire");
    }
    this.shape.addEventListener("input", () => this.follow());
    this.shape.addEventListener("commit", () => this.settle());
    this.history.addEventListener("change", () => this.updateTools());
    units.addEventListener("change", this.onUnits = () => this.settle());
    this.show();
    this.settle();
    scene?.frame(false);
    this.updateTools();
  }

  /** The fields of an edit that do not depend on the file. */
  fields() {
    const { keep } = this.shape.notes;
    return { edits: JSON.stringify(this.shape.edits()), keep, format: this.format || null };
  }

  request() {
    const { file, options } = this.source;
    const fields = Object.fromEntries(Object.entries({ ...options, ...this.fields() }).filter(([, v]) => v));
    return { url: new URL("edit", document.baseURI).href, file: file.name, fields, output: outputName(file.name, this.format), locked: keyring.wanted };
  }

  show() {
    const values = this.before ? this.shape.originals : this.shape.values;
    this.figure.show(values);
    this.overlay?.show(values);
    this.scene?.invalidate(true);
  }

  /** While a slider moves: the picture at once, the dimensions as time allows. */
  follow() {
    if (this.before) this.compare(false);
    this.show();
    this.snippet.update();
    this.updateTools();
    const now = performance.now();
    if (now < (this.nextMeasure ?? 0)) {
      clearTimeout(this.late);
      this.late = setTimeout(() => this.settle(), this.nextMeasure - now);
      return;
    }
    this.settle();
    const cost = performance.now() - now;
    this.nextMeasure = now + cost / MEASURING;
  }

  /** Measure exactly what is shown now. */
  settle() {
    clearTimeout(this.late);
    const values = this.before ? this.shape.originals : this.shape.values;
    const dimensions = this.readout.measure(values);
    if (!this.scene) return;
    const rows = this.shape.notes.frame?.rotation ?? AXES;
    const extents = rows.map((row) => this.measurer.extent(row, values));
    if (extents.some((extent) => !extent)) return;
    const [low, high] = [0, 1].map((end) => new THREE.Vector3(...extents.map((extent) => extent[end])));
    const box = new THREE.Box3(low, high);
    this.scene.fit(box);
    this.lines.update(box, dimensions);
    this.show();
  }

  updateTools() {
    const changed = this.shape.changed.length > 0 || Object.keys(this.shape.asked).length > 0;
    this.tools.update({ canUndo: this.history.canUndo, canRedo: this.history.canRedo, changed });
  }

  travel(by) {
    if (this.history.go(by)) {
      this.settle();
      announce(by < 0 ? "Undone" : "Redone");
    }
  }

  reset() {
    this.shape.reset();
    this.shape.commit();
    announce("Back to the mesh as it came");
  }

  compare(before) {
    this.before = before;
    this.tools.press("compare", before, true);
    this.settle();
    this.show();
    this.updateTools();
  }

  showWires(visible) {
    for (const twin of this.wires ?? []) twin.visible = visible;
    this.scene?.invalidate();
  }

  async showTemplate(visible) {
    try {
      await this.overlay.toggle(visible, this.before ? this.shape.originals : this.shape.values);
      this.scene.invalidate();
      announce(visible ? "The fitted template is shown" : "The fitted template is hidden");
    } catch (error) {
      this.tools.press("template", false, true);
      // A service without templates to show: no use in asking again.
      if (error.status === 404) this.tools.buttons.template.hidden = true;
      else showProblem(error);
    }
  }

  async download(format) {
    const button = $("download");
    button.disabled = true;
    try {
      const { buffer, header } = await this.source.post("edit", { ...this.fields(), format: format || null }, { accept: "*/*" });
      const type = header("Content-Type") ?? "application/octet-stream";
      save(new Blob([buffer], { type }), outputName(this.source.file.name, format));
      clearProblems();
      announce("Downloaded");
    } catch (error) {
      showProblem(error);
    } finally {
      button.disabled = false;
      button.focus();
    }
  }

  close() {
    clearTimeout(this.late);
    this.wishes.close();
    this.units.removeEventListener("change", this.onUnits);
    this.overlay?.dispose();
    this.figure.root.removeFromParent();
    this.figure.dispose();
  }
}
