// Live estimates: what the model's parameters seem to be just now, and whether the model fits at all.

import {bench} from "../bench";
import {Trail} from "../live_store";
import {h, put, setText, signalWords, svg, symbol} from "../dom";
import {floors, plain, quantity, withError} from "../numbers";
import {Plot} from "../plot";
import {rpc, RpcError} from "../rpc";
import {View} from "../view";

const period = 250;   // [ms] between questions
const seconds = 60;  // [s] of innovation and of values that the strips show

interface Moment {
  t: number;
  value: number;
  error: number;
}

// What was estimated in the last seconds, whichever view was open.
const remembered = 40;  // [s] of values
const pasts = new Map<string, Moment[]>(), innovations = new Map<string, Trail>();
let followed = "";

function remember(e: any): void {
  if (e.model !== followed) pasts.clear();
  followed = e.model;
  for (const [name, p] of Object.entries<any>(e.parameters)) {
    const past = pasts.get(name) ?? [];
    pasts.set(name, past);
    if (past.length && e.t < past[past.length - 1].t) past.length = 0;  // the daemon began anew
    if (!past.length || e.t > past[past.length - 1].t) past.push({t: e.t, value: p.value, error: p.std_error});
    while (past.length && past[0].t < e.t - remembered) past.shift();
  }
  for (const [signal, i] of Object.entries<any>(e.innovation ?? {})) {
    const trail = innovations.get(signal) ?? new Trail(2048);
    innovations.set(signal, trail);
    if (trail.last > e.t) trail.clear();
    if (Number.isFinite(i.normalised)) trail.push(e.t, i.normalised, i.normalised);
  }
}

/// Follows the estimates in the background while a run is on, so that the view has a past when it is opened.
export function followEstimates(): void {
  setInterval(() => {
    if (bench.present && bench.state === "running" && rpc.state === "open") rpc.call("estimates").then(remember, () => undefined);
  }, 1000);
}

/// Value over time with its band of two standard errors.
class Row {
  readonly element: HTMLElement;
  private readonly value = h("td", {class: "n"});
  private readonly tag = h("td", {});
  private readonly spark = svg("svg", {viewBox: "0 0 160 34", class: "spark", width: "160", height: "34", "aria-hidden": "true"});

  constructor(private readonly name: string, private readonly unit: string) {
    this.element = h("tr", {}, h("th", {scope: "row"}, nameOf(name)), this.value, h("td", {}, this.spark), this.tag);
  }

  write(parameter: any, fits: boolean): void {
    const {value, std_error: error, excited, at_bound: bound, fixed} = parameter;
    setText(this.value, excited && !fixed ? withError(value, error, this.unit) : quantity(value, this.unit));
    this.value.classList.toggle("muted", !fits || !excited);
    const [word, kind] = fixed ? ["fixed", ""] : bound ? ["at its bound: no estimate", "warn"] : !excited ? ["not excited", "warn"] : fits ? ["excited", "good"] : ["do not trust", "bad"];
    put(this.tag, h("span", {class: `tag ${kind}`}, word));
    this.draw(pasts.get(this.name) ?? []);
  }

  private draw(past: Moment[]): void {
    const now = past[past.length - 1]?.t ?? 0;
    const low = Math.min(...past.map((p) => p.value - 2 * p.error)), high = Math.max(...past.map((p) => p.value + 2 * p.error));
    const y = (v: number) => (high > low ? 32 - (30 * (v - low)) / (high - low) : 17).toFixed(1);
    const line = (f: (p: Moment) => number) => past.map((p) => `${(160 * (1 + (p.t - now) / remembered)).toFixed(1)},${y(f(p))}`);
    put(this.spark, svg("polygon", {points: [...line((p) => p.value + 2 * p.error), ...line((p) => p.value - 2 * p.error).reverse()].join(" "), class: "area ink-model"}),
      svg("polyline", {points: line((p) => p.value).join(" "), class: "curve ink-model", "fill-opacity": 0}));
  }
}

function nameOf(name: string): HTMLElement {
  const [effect, parameter] = name.split(".");
  if (!parameter) return symbol(name);
  return h("span", {}, symbol(parameter), h("span", {class: "muted small"}, ` ${effect.replace(/_/g, " ")}`));
}

/// The paper's parameters as the paper orders them, then those of effects.
function inOrder(parameters: {[name: string]: any}): [string, any][] {
  const usual = ["R_a", "K_b", "K_m", "B", "J"];
  const place = (name: string) => (usual.includes(name) ? usual.indexOf(name) : usual.length);
  return Object.entries(parameters).sort((a, b) => place(a[0]) - place(b[0]));
}

class Estimates {
  readonly element: HTMLElement;
  private readonly verdict = h("div", {class: "panel", id: "estimates-verdict"});
  private readonly rows = h("tbody", {});
  private readonly innovation = h("div", {class: "stack"});
  private readonly changes = h("div", {});
  private readonly byName = new Map<string, Row>();
  private readonly plots = new Map<string, Plot>();
  private readonly timer: number;
  private asking = false;
  private model = "";
  private fitted: boolean | null = null;

  constructor() {
    this.timer = window.setInterval(() => this.ask(), period);
    this.element = h("div", {class: "stack"}, this.verdict,
      h("div", {class: "two"},
        h("div", {class: "stack"},
          h("section", {class: "panel ages"}, h("h2", {}, "Parameters"), h("div", {class: "wide", tabindex: "0", role: "region", "aria-label": "Parameters"}, h("table", {class: "folds"},
            h("thead", {}, h("tr", {}, h("th", {scope: "col"}, "parameter"), h("th", {class: "n", scope: "col"}, "value ± std error"), h("th", {scope: "col"}, "last 40 s"), h("th", {scope: "col"}, "state"))), this.rows))),
          h("section", {class: "panel ages"}, h("h2", {}, "Innovation"), h("p", {class: "muted small"}, "Measured less predicted, RMS of the last second in noise floors: 1 where the model is right."), this.innovation)),
        h("section", {class: "panel stack"}, h("h2", {}, "What changed"), this.changes)));
    this.ask();
  }

  close(): void {
    clearInterval(this.timer);
    for (const plot of this.plots.values()) plot.destroy();
  }

  private async ask(): Promise<void> {
    if (this.asking || rpc.state !== "open") return;
    this.asking = true;
    try {
      const answer = await rpc.call("estimates");
      remember(answer);
      this.write(answer);
    } catch (error) {
      if (error instanceof RpcError && error.code !== 0) put(this.verdict, h("p", {class: "empty"}, error.message));
    }
    this.asking = false;
  }

  private write(e: any): void {
    if (e.model !== this.model || this.byName.size === 0) {
      this.model = e.model;
      this.byName.clear();
      for (const [name, p] of inOrder(e.parameters)) this.byName.set(name, new Row(name, p.unit));
      put(this.rows, ...[...this.byName.values()].map((row) => row.element));
      this.fitted = null;
    }
    for (const [name, p] of Object.entries<any>(e.parameters)) this.byName.get(name)?.write(p, e.fits);
    this.writeVerdict(e);
    this.writeInnovation(e);
    this.writeChanges(e);
  }

  private writeVerdict(e: any): void {
    if (this.fitted === e.fits && this.verdict.dataset.samples === String(e.samples > 0)) return;
    this.fitted = e.fits;
    this.verdict.dataset.samples = String(e.samples > 0);
    put(this.verdict, h("div", {class: "row"},
      h("span", {class: `tag ${e.samples === 0 ? "" : e.fits ? "good" : "bad"}`}, e.samples === 0 ? "waiting" : e.fits ? "fits" : "does not fit: do not trust"),
      h("span", {}, "Model ", h("b", {}, e.model), e.samples === 0 ? ": no samples yet; the estimates follow a run." : e.fits ? " follows the bench within its noise." : " does not follow the bench: something is missing in it, and the values below take it up."),
      e.left_out?.length ? h("span", {class: "muted small"}, `left out: ${e.left_out.join(", ")}`) : null));
  }

  private writeInnovation(e: any): void {
    for (const signal of Object.keys(e.innovation ?? {})) {
      let one = this.plots.get(signal);
      if (!one) {
        one = new Plot({title: signalWords(signal), about: "innovation in noise floors over the last minute", x: {name: "t", unit: "s"}, y: {name: "noise floors", unit: "1"}, height: 105, zero: true, smallest: 3});
        this.plots.set(signal, one);
        this.innovation.append(one.element);
      }
      const {x, low} = (innovations.get(signal) as Trail).view(e.t - seconds, 480, e.t);
      one.show([{label: "RMS", ink: "model", x, y: low}, {label: "right model", ink: "floor", x, y: x.map(() => 1), dash: true}], [-seconds, 0]);
    }
    if (this.plots.size === 0) put(this.innovation, h("p", {class: "empty"}, "Nothing yet: it begins with a run."));
    else this.innovation.querySelector(".empty")?.remove();
  }

  private writeChanges(e: any): void {
    const m = e.misfit ?? {};
    const suspects = (list: any[]) => list.map((s: any) => h("li", {}, nameOf(s.name), ` by ${withError(s.change, s.std_error, s.unit)}, ${plain(s.score, 2)} standard errors`));
    const changes = (m.changes ?? []).slice().reverse().map((c: any) => h("div", {class: "stack"},
      h("p", {}, h("b", {}, `At ${plain(c.since, 4)} s`), `, noticed at ${plain(c.noticed, 4)} s: ${c.text}`), h("ul", {class: "small"}, ...suspects(c.suspects ?? []))));
    put(this.changes, h("p", {class: "muted small"}, m.watching ? `Watching; the largest sign of a change is ${plain(m.score, 2)} standard errors, told from 5 on.` : "Not enough was seen yet to tell a change."),
      ...changes, m.points_to?.length ? h("div", {}, h("h3", {}, "What the model lacks all along"), h("ul", {class: "small"}, ...suspects(m.points_to))) : null,
      e.left && Object.keys(e.left).length ? h("dl", {class: "facts"}, ...Object.entries<any>(e.left).flatMap(([signal, left]) => [h("dt", {}, symbol(signal)), h("dd", {}, `${floors(typeof left === "number" ? left : left?.floors ?? left?.normalised)} noise floors left`)])) : null);
  }
}

export const estimatesView: View = {
  id: "estimates", title: "Estimates", needs: "bench",
  show(main) {
    const estimates = new Estimates();
    main.append(h("div", {class: "head"}, h("h1", {}, "Live estimates"), h("span", {class: "about"}, bench.name)), estimates.element);
    return () => estimates.close();
  },
};
