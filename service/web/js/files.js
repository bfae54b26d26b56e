// Files from the user's hands: dropped anywhere on the page, chosen, or a sample.

import { $ } from "./dom.js";
import { zip } from "./zip.js";

const MESH = /\.(glb|gltf|obj|ply|stl|off|zip)$/i;

/** @param open (file) */
export function takeFiles(open) {
  const take = async (list) => {
    const file = await oneOf([...list]);
    if (file) open(file);
  };
  for (const id of ["file-input", "drop-input"]) {
    $(id).addEventListener("change", (event) => {
      take(event.target.files);
      // The same file can then be chosen again.
      event.target.value = "";
    });
  }
  let depth = 0;
  const holdsFiles = (event) => event.dataTransfer?.types.includes("Files");
  const over = (by) => {
    depth = Math.max(0, depth + by);
    $("dropping").hidden = depth === 0;
  };
  addEventListener("dragenter", (event) => holdsFiles(event) && over(1));
  addEventListener("dragleave", (event) => holdsFiles(event) && over(-1));
  addEventListener("dragover", (event) => holdsFiles(event) && event.preventDefault());
  addEventListener("drop", (event) => {
    if (!holdsFiles(event)) return;
    event.preventDefault();
    over(-depth);
    take(event.dataTransfer.files);
  });
  for (const button of document.querySelectorAll("[data-sample]")) {
    button.addEventListener("click", () => open(button.dataset.sample, true));
  }
}

export async function sample(name) {
  const answer = await fetch(`web/samples/${name}.glb`);
  if (!answer.ok) throw new Error("The sample can't be had");
  return new File([await answer.blob()], `${name}.glb`, { type: "model/gltf-binary" });
}

/** One upload: a mesh that comes with materials and textures goes as a zip. */
async function oneOf(files) {
  if (files.length < 2) return files[0];
  const mesh = files.find((file) => MESH.test(file.name)) ?? files[0];
  return new File([await zip(files)], mesh.name.replace(/\.\w+$/, ".zip"), { type: "application/zip" });
}
