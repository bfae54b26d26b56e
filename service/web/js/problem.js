// Errors: what the service says of them (RFC 9457), and what is shown.

import { $, h, icon } from "./dom.js";

export class Problem extends Error {
  constructor(status, document) {
    super(document.detail ?? document.title);
    this.status = status;
    this.document = document;
    this.code = document.code ?? "";
  }

  /** From an answer's body, whatever it is. */
  static of(status, buffer, traceId) {
    try {
      const document = JSON.parse(new TextDecoder().decode(buffer));
      if (document.detail) return new Problem(status, document);
    } catch {
      // Not JSON: something between the page and the service has answered.
    }
    return new Problem(status, {
      title: `The answer was ${status}`,
      detail: "It is no answer that this page can read.",
      suggestion: "Try again in a while.",
      trace_id: traceId,
    });
  }

  static offline() {
    return new Problem(0, {
      title: "The service can't be reached",
      detail: "The connection failed or was cut off.",
      suggestion: "Check that it runs and try again.",
    });
  }
}

/** What a person calls the problem; the statuses' own phrases say little. */
function titleOf(problem) {
  const { code, document } = problem;
  if (code === "constraints_conflict") return "These can't all be had";
  const titles = {
    401: "The service wants an API key", 413: "The file is too large", 415: "This file can't be read", 422: "This can't be done",
    429: "The service is busy", 503: "The service is busy",
  };
  return titles[problem.status] ?? document.title ?? "Something went wrong";
}

const sentence = (text) => (text ? text[0].toUpperCase() + text.slice(1) + (/[.!?]$/.test(text) ? "" : ".") : "");

/**
 * Show an error until it is closed or another comes.
 *
 * @param more {lines: in place of the service's own words, action: {label, run}}
 */
export function showProblem(error, { lines = [], action } = {}) {
  const problem = error instanceof Problem
    ? error
    : new Problem(0, { title: "Something went wrong", detail: String(error?.message ?? error) });
  const { detail, suggestion, trace_id: trace } = problem.document;
  const card = h("div", { className: "alert" },
    h("h2", {}, titleOf(problem)),
    h("button", { type: "button", className: "button quiet", "aria-label": "Dismiss the error", onclick: clearProblems }, icon("close")),
    ...(lines.length
      ? [h("ul", {}, ...lines.map((line) => h("li", {}, line)))]
      : [h("p", {}, sentence(detail)), suggestion ? h("p", {}, sentence(suggestion)) : null]));
  if (action) {
    card.append(h("button", { type: "button", className: "button action", onclick: () => {
      clearProblems();
      action.run();
    } }, action.label));
  }
  if (trace) card.append(h("p", { className: "trace" }, "Trace ", h("code", {}, trace)));
  $("alerts").replaceChildren(card);
}

export function clearProblems() {
  $("alerts").replaceChildren();
}
