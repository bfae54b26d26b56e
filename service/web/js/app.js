// The page: opens files and wires keys, toolbar and theme to the mesh that is open.

import { $, announce } from "./dom.js";
import { DimensionLines } from "./dimensions.js";
import { Figure } from "./figure.js";
import { JointDots } from "./jointdots.js";
import { sample, takeFiles } from "./files.js";
import { Options } from "./options.js";
import { clearProblems, showProblem } from "./problem.js";
import { Progress } from "./progress.js";
import { Scene } from "./scene.js";
import { Source } from "./service.js";
import { Session } from "./session.js";
import { Theme } from "./theme.js";
import { Tools } from "./tools.js";
import { Units } from "./units.js";
import { drawing } from "./webgl.js";

const units = new Units();
const options = new Options();
const theme = new Theme($("theme"));
const progress = new Progress();
let session = null;
let opening = null;

let stage = null;

/** The 3D view, made when it is first needed: {scene, lines}, nulls where there is no WebGL. */
function staged() {
  if (stage) return stage;
  stage = { scene: null, lines: null, dots: null };
  const means = drawing();
  if (means) {
    const scene = new Scene($("view"), $("toolbar"), means.software);
    stage = {
      scene,
      lines: new DimensionLines(scene, $("labels"), units),
      dots: new JointDots(scene, $("labels")),
    };
    tools.press("ruler", true);
    tools.press("joints", true);
    paint();
  } else {
    document.body.dataset.webgl = "none";
    $("no-webgl").hidden = false;
    $("view").hidden = true;
    for (const name of ["compare", "wire", "ruler", "joints", "template", "frame"]) tools.buttons[name].hidden = true;
  }
  return stage;
}

const tools = new Tools($("toolbar"), {
  undo: () => session?.travel(-1),
  redo: () => session?.travel(1),
  reset: () => session?.reset(),
  compare: (on) => session?.compare(on),
  wires: (on) => session?.showWires(on),
  lines: (on) => stage?.lines.show(on),
  joints: (on) => stage?.dots.show(on),
  template: (on) => session?.showTemplate(on),
  frame: () => stage.scene.frame(),
});

/** Open a file, or the sample of that name; what was open stays until the new one is there. */
async function open(given, isSample = false) {
  opening?.abort();
  const control = (opening = new AbortController());
  clearProblems();
  progress.start(isSample ? given : given.name, () => control.abort());
  try {
    const file = isSample ? await sample(given) : given;
    const source = new Source(file, isSample ? {} : options.fields());
    const { buffer } = await source.post("sliders", {}, { on: progress.stages, signal: control.signal });
    const figure = await Figure.parse(buffer);
    if (control.signal.aborted) return;
    show(figure, source);
  } catch (error) {
    if (control.signal.aborted || error.name === "AbortError") {
      if (opening === control) announce("Cancelled");
    } else showProblem(error);
  } finally {
    if (opening === control) {
      opening = null;
      progress.stop();
    }
  }
}

function show(figure, source) {
  session?.close();
  session = null;
  const { scene, lines, dots } = staged();
  tools.press("template", false, true);
  tools.press("compare", false, true);
  tools.buttons.template.hidden = !scene;
  document.body.dataset.state = "open";
  $("toolbar").hidden = false;
  $("file").textContent = source.file.name;
  document.title = `${source.file.name} – Shape parameters`;
  // The stage has its size only now that the panel is beside it.
  $("panel").hidden = false;
  scene?.resize();
  session = new Session({ figure, source, scene, lines, dots, units, tools });
  const count = session.shape.parameters.size;
  announce(`${source.file.name} is open: a ${figure.notes.category} with ${count} parameters`);
}

function paint() {
  const dark = document.documentElement.dataset.theme === "dark";
  stage?.scene?.floor.paint(dark);
  stage?.lines?.paint(dark);
  stage?.scene?.invalidate();
}

theme.addEventListener("change", paint);
takeFiles(open);
// Shaders take their time: let the page be there first.
(window.requestIdleCallback ?? setTimeout)(staged);

addEventListener("keydown", (event) => {
  if (event.key === "Escape") {
    // That of a dialog is the dialog's own.
    if (event.target.closest?.("dialog")) return;
    if (opening) opening.abort();
    else clearProblems();
    return;
  }
  if (event.key === "Enter") delete event.target.dataset?.typing;
  // Within a text that is being typed, undo is the text's own.
  if (!(event.ctrlKey || event.metaKey) || event.altKey || event.target.dataset?.typing) return;
  const key = event.key.toLowerCase();
  if (key !== "z" && key !== "y") return;
  event.preventDefault();
  session?.travel(key === "y" || event.shiftKey ? 1 : -1);
});

addEventListener("input", ({ target }) => {
  if (target.type === "text" || target.type === "password") target.dataset.typing = "yes";
});
addEventListener("change", ({ target }) => delete target.dataset?.typing);
