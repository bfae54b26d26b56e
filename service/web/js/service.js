// Requests to the service this page came from.

import { keyring } from "./key.js";
import { Problem } from "./problem.js";

/**
 * Send a form, with a key where one is wanted, and follow it on its way; the answer is
 * {buffer, header}.
 *
 * @param on {uploading(share), waiting(), receiving(share)}
 */
export function send(path, form, more = {}) {
  return keyring.unlock((headers) => attempt(path, form, headers, more));
}

/** XMLHttpRequest, as fetch tells nothing of an upload's progress. */
function attempt(path, form, headers, { accept, on = {}, signal }) {
  return new Promise((resolve, reject) => {
    const request = new XMLHttpRequest();
    request.open("POST", path);
    request.responseType = "arraybuffer";
    for (const [name, value] of Object.entries(headers)) request.setRequestHeader(name, value);
    if (accept) request.setRequestHeader("Accept", accept);
    const share = (event) => (event.lengthComputable && event.total ? event.loaded / event.total : null);
    request.upload.onprogress = (event) => on.uploading?.(share(event));
    request.upload.onload = () => on.waiting?.();
    request.onprogress = (event) => on.receiving?.(share(event));
    request.onerror = () => reject(Problem.offline());
    request.onabort = () => reject(new DOMException("cancelled", "AbortError"));
    request.onload = () => {
      const header = (name) => request.getResponseHeader(name);
      if (request.status < 300) resolve({ buffer: request.response, header });
      else reject(Problem.of(request.status, request.response, header("Trace-Id")));
    };
    signal?.addEventListener("abort", () => request.abort());
    request.send(form);
  });
}

/** A file that the service may still hold: named by its id, sent anew when the cache has dropped it. */
export class Source {
  constructor(file, options) {
    this.file = file;
    this.options = options;
    this.meshId = null;
  }

  async post(path, fields, more = {}) {
    if (this.meshId) {
      try {
        return await send(path, this.form({ mesh_id: this.meshId }, fields), more);
      } catch (error) {
        if (error.code !== "mesh_id_unknown") throw error;
      }
    }
    return send(path, this.form({ mesh: this.file }, fields), more);
  }

  form(mesh, fields) {
    const form = new FormData();
    for (const [name, value] of Object.entries({ ...this.options, ...fields })) {
      if (value !== undefined && value !== null) form.append(name, value);
    }
    for (const [name, value] of Object.entries(mesh)) form.append(name, value);
    return form;
  }
}

/** The installed categories; none while the service wants a key that is not there yet. */
export async function categories() {
  const answer = await fetch("categories", { headers: keyring.headers });
  return answer.ok ? (await answer.json()).categories : [];
}
