// The same edit as a command or a program that runs as it stands.

import { h, icon, announce } from "./dom.js";

const shell = (text) => `'${text.replaceAll("'", "'\\''")}'`;

/** A file's name within curl's -F: quoted, as it may hold commas and semicolons. */
const curlFile = (name) => shell(`mesh=@"${name.replaceAll("\\", "\\\\").replaceAll('"', '\\"')}"`);

/** Python and JavaScript read JSON's strings as their own. */
const literal = (value) => JSON.stringify(value);

export function outputName(name, format) {
  const dot = name.lastIndexOf(".");
  const [stem, suffix] = dot > 0 ? [name.slice(0, dot), name.slice(dot + 1)] : [name, "glb"];
  return `${stem}-edited.${format || suffix.toLowerCase()}`;
}

/**
 * A key is never shown: the code takes it from the environment.
 *
 * @param request {url, file, fields: {edits, ...}, output, locked: whether a key is wanted}
 */
export const LANGUAGES = {
  curl: ({ url, file, fields, output, locked }) => [
    `curl --fail-with-body -F ${curlFile(file)}`,
    ...(locked ? ['-H "Authorization: Bearer $API_KEY"'] : []),
    ...Object.entries(fields).map(([name, value]) => `-F ${shell(`${name}=${value}`)}`),
    `-o ${shell(output)} ${shell(url)}`,
  ].join(" \\\n  "),

  Python: ({ url, file, fields, output, locked }) => `${locked ? "import os\n\n" : ""}import httpx

with open(${literal(file)}, "rb") as mesh:
    answer = httpx.post(
        ${literal(url)},
${locked ? `        headers={"Authorization": "Bearer " + os.environ["API_KEY"]},\n` : ""}        files={"mesh": mesh},
        data={
${Object.entries(fields).map(([name, value]) => `            ${literal(name)}: ${literal(value)},`).join("\n")}
        },
        timeout=60,
    )
answer.raise_for_status()
with open(${literal(output)}, "wb") as edited:
    edited.write(answer.content)
`,

  JavaScript: ({ url, file, fields, output, locked }) => `import { openAsBlob } from "node:fs";
import { writeFile } from "node:fs/promises";

const form = new FormData();
form.append("mesh", await openAsBlob(${literal(file)}), ${literal(file)});
${Object.entries(fields).map(([name, value]) => `form.append(${literal(name)}, ${literal(value)});`).join("\n")}
${locked ? "const headers = { Authorization: `Bearer ${process.env.API_KEY}` };\n" : ""}const answer = await fetch(${literal(url)}, { method: "POST",${locked ? " headers," : ""} body: form });
if (!answer.ok) throw new Error((await answer.json()).detail);
await writeFile(${literal(output)}, Buffer.from(await answer.arrayBuffer()));
`,
};

export class Snippet {
  /** @param request () => what `LANGUAGES` take */
  constructor(request) {
    this.request = request;
    this.language = "curl";
    this.code = h("code");
    const pre = h("pre", { tabIndex: 0, role: "tabpanel", id: "snippet", "aria-label": "The edit as code" }, this.code);
    this.tabs = Object.keys(LANGUAGES).map((name) => h("button", {
      type: "button", role: "tab", "aria-controls": "snippet", onclick: () => this.choose(name), onkeydown: (event) => this.key(event),
    }, name));
    const copy = h("button", { type: "button", className: "button small copy", onclick: () => this.copy() }, icon("copy"), "Copy");
    const list = h("div", { role: "tablist", "aria-label": "Language" }, ...this.tabs);
    this.element = h("details", { className: "code", ontoggle: () => this.update() },
      h("summary", {}, "The same edit as code"), h("div", { className: "tabs" }, list, copy), pre);
    this.choose("curl");
  }

  choose(language) {
    this.language = language;
    for (const tab of this.tabs) {
      const chosen = tab.textContent === language;
      tab.setAttribute("aria-selected", String(chosen));
      tab.tabIndex = chosen ? 0 : -1;
    }
    this.update();
  }

  key(event) {
    const way = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (!way) return;
    const at = this.tabs.findIndex((tab) => tab.textContent === this.language);
    const next = this.tabs[(at + way + this.tabs.length) % this.tabs.length];
    this.choose(next.textContent);
    next.focus();
  }

  update() {
    if (this.element.open) this.code.textContent = LANGUAGES[this.language](this.request());
  }

  async copy() {
    this.update();
    try {
      await navigator.clipboard.writeText(this.code.textContent);
      announce("Copied");
    } catch {
      // No clipboard without a secure origin: the text is selected for the user's own copy.
      getSelection().selectAllChildren(this.code);
      announce("Selected; copy it by the keyboard");
    }
  }
}
