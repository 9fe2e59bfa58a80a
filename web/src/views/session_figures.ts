// One session, or two over each other; and parts of them, chosen by dragging, as sessions of their own.

import {failed, notice} from "../dialog";
import {h, put, setText, signalWords} from "../dom";
import {duration, parseNumber} from "../numbers";
import {Group, Plot, Trace} from "../plot";
import {rpc} from "../rpc";

const points = 900;
const inks = ["model", "base"] as const;

export interface Shown {
  path: string;
  name: string;
  duration: number;
}

export class SessionFigures {
  readonly element = h("div", {class: "stack"});
  readonly part: Part;
  private readonly runs = h("div", {class: "row", hidden: true});
  private readonly figures = h("div", {class: "stack"});
  private readonly plots = new Map<string, Plot>();
  private readonly runOf = new Map<string, number>();  // the run that is shown of a session with several
  private group = new Group((range) => this.zoomed(range));
  private shown: Shown[] = [];
  private asked = 0;
  private timer = 0;

  /// @param made is called with the paths of new sessions
  constructor(made: (paths: string[]) => void) {
    this.part = new Part((range) => this.group.zoom(range), (path) => this.runName(path), made);
    this.element.append(this.runs, this.figures);
  }

  private readonly names = new Map<string, string[]>();
  private runName(path: string): string | undefined {
    const names = this.names.get(path) ?? [];
    return names.length > 1 ? names[this.runOf.get(path) ?? 0] : undefined;
  }

  close(): void {
    clearTimeout(this.timer);
    this.plots.forEach((p) => p.destroy());
  }

  show(sessions: Shown[]): void {
    this.shown = sessions;
    this.plots.forEach((p) => p.destroy());
    this.plots.clear();
    this.figures.textContent = "";
    this.group = new Group((range) => this.zoomed(range));
    this.part.of(sessions);
    this.draw();
  }

  /// The bins of the part that is shown, once the drag has ended.
  private zoomed(range: [number, number] | null): void {
    this.part.take(range);
    clearTimeout(this.timer);
    this.timer = window.setTimeout(() => this.draw(), 120);
  }

  private async draw(): Promise<void> {
    const number = ++this.asked, sessions = this.shown, range = this.group.range;
    const window = range ? {from: range[0], to: range[1]} : {};
    try {
      const answers = await Promise.all(sessions.map((s) => rpc.call("session_data", {path: s.path, points, ...window})));
      if (number !== this.asked) return;
      answers.forEach((answer, n) => this.names.set(sessions[n].path, answer.runs.map((r: any) => r.run)));
      this.writeRuns();
      const signals = new Map<string, {unit: string; traces: Trace[]}>();
      answers.forEach((answer, n) => {
        const run = answer.runs[this.runOf.get(sessions[n].path) ?? 0] ?? answer.runs[0];
        for (const [signal, bins] of Object.entries<any>(run?.signals ?? {})) {
          const of: {unit: string; traces: Trace[]} = signals.get(signal) ?? {unit: bins.unit ?? "", traces: []};
          of.traces.push({label: sessions[n].name, ink: inks[n], x: bins.t, y: bins.min ?? bins.value, high: bins.max, as: bins.t.length < 400 ? "points" : undefined, width: 1.3});
          signals.set(signal, of);
        }
      });
      for (const [signal, {unit, traces}] of signals) this.plot(signal, unit).show(traces);
    } catch (error) {
      if (number === this.asked) put(this.figures, h("p", {class: "bad"}, String((error as Error).message)));
    }
  }

  private plot(signal: string, unit: string): Plot {
    let plot = this.plots.get(signal);
    if (plot) return plot;
    plot = new Plot({title: signalWords(signal), about: "of the chosen sessions over their time", x: {name: "t", unit: "s"}, y: {name: signal, unit}, height: 150, group: this.group});
    this.plots.set(signal, plot);
    this.figures.append(h("section", {class: "panel", "aria-label": signalWords(signal)}, plot.element));
    return plot;
  }

  private writeRuns(): void {
    const several = this.shown.filter((s) => (this.names.get(s.path)?.length ?? 0) > 1);
    this.runs.hidden = several.length === 0;
    put(this.runs, ...several.map((s) => {
      const select = h("select", {onchange: () => {
        this.runOf.set(s.path, Number(select.value));
        this.show(this.shown);
      }}, ...(this.names.get(s.path) ?? []).map((name, n) => h("option", {value: n}, name)));
      select.value = String(this.runOf.get(s.path) ?? 0);
      return h("label", {class: "row small"}, `Run of ${s.name}`, select);
    }));
  }
}

/// Which part of a session: dragged across a plot, or typed; kept by itself, or split from the rest.
class Part {
  readonly element: HTMLElement;
  private readonly from = h("input", {type: "text", inputmode: "decimal", size: "6", autocomplete: "off", id: "part-from", onchange: () => this.typed()});
  private readonly to = h("input", {type: "text", inputmode: "decimal", size: "6", autocomplete: "off", id: "part-to", onchange: () => this.typed()});
  private readonly select = h("select", {"aria-label": "Session of the part", onchange: () => this.write()});
  private readonly keep = h("button", {id: "part-keep", onclick: () => this.make([this.range()])}, "Save this part");
  private readonly split = h("button", {id: "part-split", onclick: () => this.make(this.pieces())}, "Split there");
  private readonly whole = h("button", {class: "quiet", onclick: () => this.zoom(null)}, "All of it");
  private readonly words = h("p", {class: "muted small"});
  private sessions: Shown[] = [];
  private chosen: [number, number] | null = null;

  constructor(private readonly zoom: (range: [number, number] | null) => void, private readonly run: (path: string) => string | undefined, private readonly made: (paths: string[]) => void) {
    this.element = h("section", {class: "panel stack", "aria-label": "Part"}, h("h2", {}, "Trim or split"), this.words,
      this.select, h("div", {class: "row"}, h("label", {class: "field"}, "From, s", this.from), h("label", {class: "field"}, "To, s", this.to)),
      h("div", {class: "row"}, this.keep, this.split, this.whole));
  }

  of(sessions: Shown[]): void {
    this.sessions = sessions;
    this.chosen = null;
    put(this.select, ...sessions.map((s, n) => h("option", {value: n}, s.name)));
    this.select.hidden = sessions.length < 2;
    this.element.hidden = sessions.length === 0;
    this.write();
  }

  take(range: [number, number] | null): void {
    this.chosen = range;
    this.write();
  }

  private get session(): Shown | undefined {
    return this.sessions[Number(this.select.value) || 0];
  }

  /// Within the session, to a millisecond.
  private range(): [number, number] {
    const end = this.session?.duration ?? 0, to = (v: number) => Math.round(1000 * Math.max(0, Math.min(end, v))) / 1000;
    return this.chosen ? [to(this.chosen[0]), to(this.chosen[1])] : [0, end];
  }

  private pieces(): [number, number][] {
    const end = this.session?.duration ?? 0, [from, to] = this.range();
    const all: [number, number][] = [[0, from], [from, to], [to, end]];
    return all.filter(([a, b]) => b - a > 1e-3);
  }

  private typed(): void {
    const [from, to] = [parseNumber(this.from.value), parseNumber(this.to.value)];
    const wrong = !(from >= 0 && to > from);
    this.from.setAttribute("aria-invalid", String(wrong));
    this.to.setAttribute("aria-invalid", String(wrong));
    if (!wrong) this.zoom([from, to]);
  }

  private write(): void {
    const [from, to] = this.range(), end = this.session?.duration ?? 0;
    for (const [field, value] of [[this.from, from], [this.to, to]] as const) {
      if (document.activeElement !== field || this.chosen === null) field.value = String(value);
      field.setAttribute("aria-invalid", "false");
    }
    const part = to - from > 1e-3 && end - (to - from) > 1e-3;
    this.keep.disabled = this.split.disabled = !part;
    this.whole.disabled = this.chosen === null;
    setText(this.words, part ? `${duration(to - from)} of ${duration(end)}. A part becomes a session of its own; the recording stays as it is.`
      : "Drag across a plot to choose a part, or type its ends.");
  }

  /// One after the other: the worker does one thing at a time.
  private async make(pieces: [number, number][]): Promise<void> {
    const session = this.session;
    if (!session) return;
    const run = this.run(session.path), paths: string[] = [], names: string[] = [];
    try {
      for (const [from, to] of pieces) {
        const answer = await rpc.call("session_cut", {path: session.path, from, ...(to < session.duration ? {to} : {}), ...(run ? {run} : {})});
        paths.push(answer.path);
        names.push(answer.name);
      }
      notice(`Saved ${names.join(", ")}.`);
    } catch (error) {
      failed(error);
    }
    if (paths.length) this.made(paths);
  }
}
