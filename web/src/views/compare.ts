// Model over measurement: drag a parameter and see where the simulation goes.

import {failed} from "../dialog";
import {h, put, setText, signalWords, symbol, symbolText, textFile} from "../dom";
import {duration, floors, percent, quantity} from "../numbers";
import {Group, Plot} from "../plot";
import {rpc} from "../rpc";
import {View} from "../view";
import {RunInfo, Work, work} from "../work";
import {missingFigures} from "./missing";
import {Sliders} from "./sliders";
import {Scoreboard, workHead} from "./work_bar";

const points = 900;
const usual = ["omega", "theta", "i_a", "e_a", "u_ref", "torque"];
const superseded = -32000;  // a newer question came, or the work was cancelled

/// The two plots of a signal: measured with simulated, and large below it what is between them.
class SignalFigures {
  readonly element: HTMLElement;
  readonly over: Plot;
  readonly residual: Plot;
  private measured: any = null;

  constructor(readonly name: string, unit: string, group: Group, run: string) {
    const x = {name: "t", unit: "s"}, y = {name, unit};
    this.over = new Plot({title: `${signalWords(name)} of ${run}`, about: "measured and simulated over time", x, y, height: 190, group});
    this.residual = new Plot({title: `Residual of the ${signalWords(name).toLowerCase()}`, about: "measured less simulated over time, with the noise floor", x, y, height: 210, group, zero: true});
    this.element = h("section", {class: "panel stack", "aria-label": signalWords(name)}, this.over.element, this.residual.element);
  }

  show(s: any): void {
    if (s.measured) this.measured = s.measured;
    const {t} = s;
    const m = this.measured;
    const readings = m?.min ?? m?.value;
    const fits = readings && readings.length === t.length;
    const sparse = fits && t.length < 400;
    this.over.show([
      ...(fits ? [{label: "measured", ink: "measured" as const, x: t, y: readings, high: m.max, as: sparse ? "points" as const : undefined}] : []),
      {label: "simulated", ink: "model", x: t, y: s.simulated, width: 2},
    ]);
    this.residual.floor = s.floor;
    const r = s.residual;
    this.residual.show([
      {label: "residual", ink: "measured", x: t, y: r.min ?? r.value ?? r.mean, high: sparse ? undefined : r.max, width: 1, as: sparse ? "points" : undefined},
      ...(sparse ? [] : [{label: "running mean", ink: "model" as const, x: t, y: r.mean, width: 2}]),
    ]);
  }

  destroy(): void {
    this.over.destroy();
    this.residual.destroy();
  }
}

class Compare {
  readonly element: HTMLElement;
  private readonly board = new Scoreboard(true);
  private readonly ownError = h("span", {class: "big", id: "error-run"});
  private readonly thisRun = h("div", {class: "scoreboard compact"}, h("div", {class: "one"}, h("span", {class: "what"}, "this run"), this.ownError));
  private readonly select = h("select", {"aria-label": "Run", onchange: () => this.choose(this.select.value)});
  private readonly figures = h("div", {class: "stack of-signals"});
  private readonly missing = missingFigures();
  private readonly table = h("div", {class: "wide", tabindex: "0", role: "region", "aria-label": "Errors by run and signal"});
  private readonly sliders = new Sliders((name, value) => this.dragged(name, value), (name, value) => this.done(name, value));
  private readonly head: {element: HTMLElement; close: () => void};
  private readonly fit = h("button", {class: "main", id: "fit", onclick: () => work.change("fit", {}, "Fitting to the training runs")}, "Fit from here");
  private signals = new Map<string, SignalFigures>();
  private group = new Group(() => this.zoomed());
  private run = "";
  private draft: {[name: string]: number} = {};
  private number = 0;
  private answered = 0;
  private flying = false;
  private again: boolean | null = null;
  private zoomTimer = 0;
  private of: Work | null = null;
  private readonly forget: () => void;

  constructor() {
    this.head = workHead("Compare", this.select, this.board.element, this.thisRun, h("button", {class: "quiet", onclick: () => this.export()}, "CSV of this run"));
    const side = h("div", {class: "stack sticky"}, h("section", {class: "panel stack", "aria-label": "Parameters"},
      h("div", {class: "row"}, h("h2", {}, "Parameters"), h("span", {class: "grow"}), this.fit), this.sliders.element));
    this.element = h("div", {class: "stack"}, this.head.element,
      h("div", {class: "two of-compare"}, h("div", {class: "stack"}, this.figures, this.missing.element,
        h("section", {class: "panel"}, h("h2", {}, "Errors by run and signal"), this.table)), side));
    this.forget = work.onChange(() => this.change());
    this.change();
  }

  close(): void {
    this.forget();
    this.head.close();
    this.missing.close();
    clearTimeout(this.zoomTimer);
    for (const s of this.signals.values()) s.destroy();
  }

  private change(): void {
    const state = work.state;
    this.fit.disabled = Boolean(work.busy || state?.findings);
    if (!state || state === this.of) return;
    this.of = state;
    this.draft = {};
    this.sliders.take(inOrder(state), state.effects);
    this.board.write(state.error);
    put(this.select, ...runOptions(state.runs));
    this.writeTable(state);
    if (!state.runs.some((r) => r.id === this.run)) this.choose((state.runs.find((r) => r.held_out) ?? state.runs[0])?.id ?? "");
    else this.ask(false);
    this.select.value = this.run;
    this.missing.load();
  }

  private choose(run: string): void {
    this.run = run;
    this.group.range = null;
    for (const s of this.signals.values()) s.destroy();
    this.signals.clear();
    this.figures.textContent = "";
    this.ask(true);
  }

  private dragged(name: string, value: number): void {
    this.draft[name] = value;
    this.ask(false);
  }

  private done(name: string, value: number): void {
    this.draft[name] = value;
    work.change("set", {parameters: {[name]: value}}, `Setting ${symbolText(name)}`);
  }

  /// The readings of this run with the simulation beside them.
  private export(): void {
    rpc.call("export", {run: this.run, format: "csv"}).then((answer) => textFile(answer.name, answer.text, "text/csv"), failed);
  }

  private zoomed(): void {
    clearTimeout(this.zoomTimer);
    this.zoomTimer = window.setTimeout(() => this.ask(true), 120);
  }

  /// Asks for the simulation. One question at a time; of those that came meanwhile the last is asked.
  private ask(measured: boolean): void {
    if (!this.run) return;
    if (this.flying) {
      this.again = measured || Boolean(this.again);
      return;
    }
    this.flying = true;
    const range = this.group.range;
    rpc.call("simulate", {seq: ++this.number, run: this.run, parameters: this.draft, points, measured, ...(range ? {from: range[0], to: range[1]} : {})})
      .then((answer) => this.draw(answer), (error) => error.code === superseded || failed(error)).finally(() => {
        this.flying = false;
        const again = this.again;
        this.again = null;
        if (again !== null) this.ask(again);
      });
  }

  private draw(answer: any): void {
    if (answer.seq <= this.answered || (answer.run && answer.run !== this.run)) return;
    this.answered = answer.seq;
    const run = work.state?.runs.find((r) => r.id === this.run)?.name ?? this.run;
    // What is off comes first, the worst before all; the order stays while one drags.
    const weight = ([name, s]: [string, any]) => (s.floors > 1.5 ? s.floors : usual.length - 100 - usual.indexOf(name));
    for (const [name, signal] of Object.entries<any>(answer.signals).sort((a, b) => weight(b) - weight(a))) {
      let figures = this.signals.get(name);
      if (!figures) {
        figures = new SignalFigures(name, signal.unit, this.group, run);
        this.signals.set(name, figures);
        this.figures.append(figures.element);
      }
      figures.show(signal);
    }
    setText(this.ownError, floors(answer.error?.held_out ?? answer.error?.train));
    window.dispatchEvent(new Event("emtb-drawn"));
  }

  private writeTable(state: Work): void {
    put(this.table, h("table", {},
      h("thead", {}, h("tr", {}, h("th", {scope: "col"}, "run"), h("th", {scope: "col"}, "signal"), h("th", {class: "n", scope: "col"}, "RMSE"), h("th", {class: "n", scope: "col"}, "in noise floors"), h("th", {class: "n", scope: "col"}, "fit"))),
      h("tbody", {}, ...state.table.map((row) => h("tr", {},
        h("td", {}, row.run, " ", row.held_out ? h("span", {class: "tag"}, "held out") : null), h("td", {}, symbol(row.signal)),
        h("td", {class: "n"}, quantity(row.rmse, row.unit, 3)), h("td", {class: "n"}, floors(row.floors)), h("td", {class: "n"}, percent(row.fit_percent)))))));
  }
}

/// The parameters in the order of the model: a JSON object has none.
function inOrder(state: Work): Work["parameters"] {
  const names = state.order ?? Object.keys(state.parameters);
  return Object.fromEntries(names.filter((name) => name in state.parameters).map((name) => [name, state.parameters[name]]));
}

export function runOptions(runs: RunInfo[]): HTMLElement[] {
  const group = (label: string, of: RunInfo[]) => (of.length ? [h("optgroup", {label}, ...of.map((r) => h("option", {value: r.id}, `${r.name}, ${duration(r.duration)}`)))] : []);
  return [...group("Held out", runs.filter((r) => r.held_out)), ...group("Training", runs.filter((r) => !r.held_out))];
}

export const compareView: View = {
  id: "compare", title: "Compare", needs: "files",
  show(main) {
    const compare = new Compare();
    main.append(compare.element);
    return () => compare.close();
  },
};
