// What Compare, Diagnose and Formula have in common: the errors, undo and redo, and what is being computed.

import {h, put, setText} from "../dom";
import {floors} from "../numbers";
import {Errors, work} from "../work";

/// Errors on training and held-out runs, in large.
export class Scoreboard {
  readonly element = h("div", {class: "scoreboard"});
  private readonly train = h("span", {class: "big", id: "error-train"});
  private readonly heldOut = h("span", {class: "big", id: "error-held-out"});

  /// @param small fits into the head of a view
  constructor(small = false) {
    this.element.classList.toggle("compact", small);
    fillOne(this.element, small ? "Error in noise floors, training" : "Error, training runs", this.train);
    fillOne(this.element, small ? "held out" : "Error, held-out runs", this.heldOut);
    if (!small) this.element.append(h("p", {class: "muted small"}, "in multiples of the noise floor: 1 is a perfect model"));
  }

  write(error: Errors | null | undefined): void {
    setText(this.train, floors(error?.train));
    setText(this.heldOut, floors(error?.held_out));
  }
}

function fillOne(to: HTMLElement, what: string, value: HTMLElement): void {
  to.append(h("div", {class: "one"}, h("span", {class: "what"}, what), value));
}

/// A heading with undo and redo, which act on every change of the model wherever it was made.
export function workHead(title: string, ...more: HTMLElement[]): {element: HTMLElement; close: () => void} {
  const undo = h("button", {id: "undo", onclick: () => work.change("undo", {}, "undoing")}, "Undo");
  const redo = h("button", {id: "redo", onclick: () => work.change("redo", {}, "redoing")}, "Redo");
  const busy = h("div", {class: "panel progress", hidden: true, role: "status"});
  const findings = h("p", {class: "panel findings", hidden: true});
  const change = () => {
    const state = work.state;
    findings.hidden = !state?.findings;
    const lines = (state?.findings ?? "").split("\n").filter((line) => line && !line.startsWith("Nothing was fitted"));  // and what to do at a terminal
    const why = /Nothing was fitted: these (.*?)\. /.exec(state?.findings ?? "")?.[1] ?? "recordings contradict themselves";
    setText(findings, lines.length ? `These ${why}, so nothing is fitted to them:\n${lines.join("\n")}` : "");
    undo.disabled = Boolean(work.busy) || !state?.undo;
    redo.disabled = Boolean(work.busy) || !state?.redo;
    undo.title = state?.undo ? `Undo: ${state.undo}` : "There is nothing to undo";
    redo.title = state?.redo ? `Redo: ${state.redo}` : "There is nothing to redo";
    busy.hidden = !work.busy;
    if (work.busy) {
      const p = work.progress;
      put(busy, h("div", {class: "row"}, h("span", {}, p?.text ? `${work.busy}: ${p.text}` : work.busy), h("button", {class: "quiet", onclick: () => work.cancel()}, "Cancel")),
        h("progress", p && p.of > 0 ? {value: p.done, max: p.of, "aria-label": work.busy} : {"aria-label": work.busy}));
    }
  };
  const keys = (event: KeyboardEvent) => {
    if (!(event.ctrlKey || event.metaKey) || /^(INPUT|TEXTAREA)$/.test((event.target as HTMLElement).tagName) && (event.target as HTMLInputElement).type !== "range") return;
    if (event.key === "z" && !event.shiftKey) undo.click();
    else if (event.key === "y" || (event.key === "Z" && event.shiftKey)) redo.click();
    else return;
    event.preventDefault();
  };
  window.addEventListener("keydown", keys);
  const forget = work.onChange(change);
  change();
  return {
    element: h("div", {}, h("div", {class: "head"}, h("h1", {}, title), ...more, h("span", {class: "grow"}), h("span", {class: "row"}, undo, redo)), findings, busy),
    close: () => {
      window.removeEventListener("keydown", keys);
      forget();
    },
  };
}
