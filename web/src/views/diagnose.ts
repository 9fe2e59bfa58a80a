// What is missing in the model: candidates as cards, and the error falling as they are added.

import {bench} from "../bench";
import {ask, failed} from "../dialog";
import {h, marked, put, setText, signalWords, svg, symbol} from "../dom";
import {duration, floors, plain, quantity, unitText, withError} from "../numbers";
import {Plot} from "../plot";
import {drawingTools} from "../plot_export";
import {rpc} from "../rpc";
import {stopButton} from "../stop";
import {View} from "../view";
import {work} from "../work";
import {staircase} from "./staircase";
import {Scoreboard, workHead} from "./work_bar";

const verdictWords: {[verdict: string]: string} = {
  found: "Found", tied: "Several effects explain it equally well", unknown_effect: "Something is missing that the library does not know",
  nothing_missing: "Nothing is missing: the model agrees with the runs within the instruments' noise", cannot_tell: "These runs cannot tell",
};

/// What the candidate would do, over what is left of the measurement, and what gives its numbers away.
function signature(name: string, s: any): {picture: HTMLElement; tools: HTMLElement} | null {
  if (!s?.x?.length) return null;
  const width = 300, height = 84;
  const all = [...s.residual, ...s.effect].filter((v: number | null) => v !== null && Number.isFinite(v));
  const low = Math.min(0, ...all), high = Math.max(0, ...all), x0 = s.x[0], x1 = s.x[s.x.length - 1];
  const at = (x: number, y: number) => `${((width * (x - x0)) / (x1 - x0 || 1)).toFixed(1)},${(height - 4 - ((height - 8) * (y - low)) / (high - low || 1)).toFixed(1)}`;
  const line = (values: number[]) => s.x.map((x: number, n: number) => (values[n] === null ? "" : at(x, values[n]))).join(" ");
  const drawing = svg("svg", {viewBox: `0 0 ${width} ${height}`, class: "signature", role: "img", preserveAspectRatio: "none", "aria-label": "the effect's signature over the residual"},
    svg("polyline", {points: `${at(x0, 0)} ${at(x1, 0)}`, class: "axis-line"}),
    svg("polyline", {points: line(s.residual), class: "curve ink-measured", "fill-opacity": 0, "vector-effect": "non-scaling-stroke"}),
    svg("polyline", {points: line(s.effect), class: "curve ink-base", "fill-opacity": 0, "vector-effect": "non-scaling-stroke"}));
  const unit = unitText(s.unit) && ` [${s.unit}]`;
  const {tools, table} = drawingTools(`Signature of ${name}`, drawing, [{head: "t [s]", values: s.x}, {head: `${s.signal}, what is left${unit}`, values: s.residual}, {head: `${s.signal}, the effect${unit}`, values: s.effect}]);
  const words = `${signalWords(s.signal)}, ${quantity(low, s.unit, 2)} to ${quantity(high, s.unit, 2)} over ${duration(x1 - x0)}`;
  return {picture: h("div", {class: "figure"}, drawing, h("p", {class: "under"}, words), table), tools};
}

function card(c: any, best: boolean): HTMLElement {
  const values = Object.entries<any>(c.value ?? c.expected ?? {}).map(([name, v]) => {
    const p = typeof v === "object" && v !== null ? v : {value: v, unit: ""};
    return h("div", {}, symbol(name), " = ", p.std_error ? withError(p.value, p.std_error, p.unit) : quantity(p.value, p.unit ?? ""));
  });
  const add = h("button", {class: best ? "main" : "", "data-add": c.id, "aria-label": `Add ${c.name}`, onclick: () => work.change("add", {effect: c.id}, `Adding ${c.name} and fitting again`)}, "Add");
  const what = c.what ?? "", small = signature(c.name ?? c.id, c.signature);
  return h("article", {class: best ? "card best" : "card", "data-candidate": c.id},
    h("header", {}, h("h2", {}, c.name ?? c.id.replace(/_/g, " ")), best ? h("span", {class: "tag good"}, "missing") : c.tied ? h("span", {class: "tag warn"}, "tied") : null),
    what ? h("p", {class: "small"}, what) : null, small?.picture,
    h("dl", {class: "facts small"},
      c.held_out_error !== null && c.held_out_error !== undefined ? h("dt", {}, "Error held out with it") : null, c.held_out_error !== null && c.held_out_error !== undefined ? h("dd", {}, floors(c.held_out_error)) : null,
      h("dt", {}, "Drop foretold"), h("dd", {}, dropWords(c)),
      values.length ? h("dt", {}, values.length > 1 ? "Values" : "Value") : null, values.length ? h("dd", {}, ...values) : null,
      c.tied_with?.length ? h("dt", {}, "Tied with") : null, c.tied_with?.length ? h("dd", {}, c.tied_with.map((id: string) => id.replace(/_/g, " ")).join(", ")) : null,
      c.detectable_size !== null && c.detectable_size !== undefined ? h("dt", {}, "Would be found from") : null,
      c.detectable_size !== null && c.detectable_size !== undefined ? h("dd", {}, quantity(c.detectable_size, firstUnit(c), 2)) : null),
    c.equation ? h("p", {class: "mono muted"}, c.equation) : null, h("div", {class: "actions"}, add, small?.tools));
}

/// The curve of a law with its band of 95 %, over the first quantity that it holds.
function curve(law: any): Plot | null {
  const x: number[] = law.curve?.at ?? [], y: number[] = law.curve?.value ?? [], error: number[] = law.curve?.std_error ?? [], of: string = law.of?.[0] ?? "";
  if (!x.length) return null;
  const band = y.map((_, n) => 1.96 * (error[n] ?? 0)), place = law.place === "factor" ? "factor on the flux" : law.place;
  const plot = new Plot({title: `The law against the ${signalWords(of).toLowerCase()}`, about: "with its 95 % band", x: {name: of, unit: unitOf[of] ?? ""}, y: {name: place, unit: unitOfPlace[law.place] ?? "1"}, height: 170, zero: true});
  plot.show([{label: "95 % band", ink: "base", as: "area", x, y: y.map((v, n) => v - band[n]), high: y.map((v, n) => v + band[n])}, {label: "law", ink: "base", x, y}]);
  return plot;
}

const unitOf: {[quantity: string]: string} = {omega: "rad/s", i_a: "A", theta: "rad", u_ref: "V", t: "s"};
const unitOfPlace: {[place: string]: string} = {torque: "N m", voltage: "V", factor: "1"};

/// What is left without a name: a law for it, and runs that are not as the others.
function remainder(rest: any, named: boolean, plot: Plot | null): HTMLElement {
  const law = rest.law;
  const machine: string[] = rest.machine ?? [];
  const panel = h("article", {class: "card", id: "discovered"}, h("header", {}, h("h2", {}, "What is left"), law ? h("span", {class: "tag good"}, "a law") : h("span", {class: "tag"}, "no law")));
  if (law) {
    panel.append(...[h("p", {class: "mono"}, `${law.place} = ${law.formula}${law.memory ? `, dz/dt = ${law.memory.z}` : ""}`), plot?.element ?? null,
      h("dl", {class: "facts small"},
        h("dt", {}, "Error held out"), h("dd", {}, `${floors(law.error?.before?.held_out)} → `, h("b", {}, floors(law.error?.after?.held_out))),
        ...Object.entries<any>(law.parameters ?? {}).flatMap(([name, p]) => [h("dt", {}, symbol(name)), h("dd", {}, p.std_error ? withError(p.value, p.std_error, p.unit) : quantity(p.value, p.unit ?? ""))]),
        law.may_be ? h("dt", {}, "It may be") : null, law.may_be ? h("dd", {}, law.may_be) : null,
        law.tied_with?.length ? h("dt", {}, "As likely") : null, law.tied_with?.length ? h("dd", {class: "mono"}, ...law.tied_with.map((t: string) => h("div", {}, t))) : null)].filter((e) => e !== null) as Node[]);
    panel.append(named ? h("p", {class: "muted small"}, "It stands beside what is named above. Add that first, then diagnose again.")
      : h("div", {class: "actions"}, h("button", {class: "main", id: "add-law", onclick: () => work.change("add", {formula: law.add}, "Adding the law and fitting again")}, "Add the law")));
  } else if (rest.no_law) {
    panel.append(h("p", {}, `${rest.no_law}.`));
  }
  panel.append(...(rest.words ?? []).map((line: string) => h("p", {class: "small"}, line)));
  if (machine.length) panel.append(h("h3", {}, "Not the same in all runs"), ...machine.map((line) => h("p", {class: "small"}, `${line}.`)));
  return panel;
}

/// The unit of the parameter that says how large the effect is.
function firstUnit(c: any): string {
  return (Object.values<any>(c.value ?? {})[0] ?? {}).unit ?? "";
}

function dropWords(c: any): string {
  if (c.drop_percent !== null && c.drop_percent !== undefined) return `${plain(c.drop_percent, 3)} %, to first order`;
  return c.predicted_drop > 0 ? `${plain(c.predicted_drop, 3)} in the sum of squares` : "none";
}

class Diagnose {
  readonly element: HTMLElement;
  private readonly board = new Scoreboard();
  private readonly stairs = h("div", {});
  private readonly verdict = h("div", {class: "stack"});
  private readonly cards = h("div", {class: "cards"});
  private readonly key = h("p", {class: "muted small key", hidden: true}, "In the small pictures: ", h("span", {class: "measured-word"}, "what is left"), " of the signal that shows it most, and ", h("span", {class: "base-word"}, "what the effect would add"), ".");
  private readonly rest = h("div", {class: "stack"});
  private readonly others = h("div", {class: "cards"});
  private readonly more = h("details", {hidden: true}, h("summary", {}, "Other candidates"), this.others);
  private readonly model = h("div", {});
  private readonly button = h("button", {class: "main", id: "diagnose", onclick: () => this.run()}, "Diagnose");
  private readonly head = workHead("Diagnose", this.button);
  private readonly forget: () => void;
  private law: Plot | null = null;
  private steps: unknown = null;  // that the staircase shows

  constructor() {
    this.element = h("div", {class: "stack"}, this.head.element,
      h("div", {class: "two"},
        h("div", {class: "stack"}, h("section", {class: "panel stack", "aria-label": "Verdict"}, this.verdict), this.rest, this.key, this.cards, this.more),
        h("div", {class: "stack"}, h("section", {class: "panel stack", "aria-label": "Error"}, this.board.element, this.stairs),
          h("section", {class: "panel stack"}, h("h2", {}, "In the model"), this.model))));
    this.forget = work.onChange(() => this.change());
    this.change();
    this.showDiagnosis();
  }

  close(): void {
    this.forget();
    this.head.close();
    this.law?.destroy();
  }

  private change(): void {
    const state = work.state;
    this.button.disabled = Boolean(work.busy);
    setText(this.button, work.diagnosis ? "Diagnose again" : "Diagnose");
    for (const cards of [this.cards, this.rest]) cards.querySelectorAll("button").forEach((b) => (b.disabled = Boolean(work.busy)));
    if (!state) return;
    const law = this.rest.querySelector<HTMLButtonElement>("#add-law"), id = work.diagnosis?.discovered?.law?.add?.id;
    if (law) law.disabled = Boolean(work.busy) || state.effects.some((e) => e.id === id);
    this.board.write(state.error);
    if (state.steps !== this.steps) put(this.stairs, staircase(state.steps));
    this.steps = state.steps;
    put(this.model, state.effects.length ? h("div", {class: "stack"}, ...state.effects.map((e) => h("div", {class: "row"}, h("span", {}, e.name),
      h("button", {class: "quiet", "aria-label": `Remove ${e.name}`, disabled: Boolean(work.busy), onclick: () => work.change("remove", {effect: e.id}, `Removing ${e.name} and fitting again`)}, "Remove"))))
      : h("p", {class: "muted small"}, "No effect beyond the linear model."));
    const stale = work.diagnosis && work.diagnosed !== state;
    this.verdict.querySelector(".stale-note")?.toggleAttribute("hidden", !stale);
  }

  private async run(): Promise<void> {
    try {
      const {work: fitted, ...diagnosis} = await work.lasting("diagnose", {}, "Looking for what is missing");
      work.diagnosis = diagnosis;
      work.take(fitted);  // the diagnosis is of the model once fitted
      work.diagnosed = work.state;
    } catch (error) {
      put(this.verdict, h("p", {class: "bad"}, String((error as Error).message)));
      return;
    }
    this.showDiagnosis();
    this.change();
  }

  private showDiagnosis(): void {
    const d = work.diagnosis;
    if (!d) {
      put(this.verdict, h("p", {}, "Which effect of the library explains what the model leaves of these runs? Diagnose fits the model, tries every effect beside it, and ranks them on runs that no fit has seen."), h("p", {class: "muted small"}, "It takes some seconds to some minutes."));
      return;
    }
    const missing = new Set<string>((d.missing ?? []).map((m: any) => m.id));
    const tied = new Set<string>((d.missing ?? []).flatMap((m: any) => m.tied_with ?? []));
    const names = (d.missing ?? []).map((m: any) => m.name ?? d.candidates.find((c: any) => c.id === m.id)?.name ?? m.id.replace(/_/g, " "));
    put(this.verdict, h("p", {class: "verdict", id: "verdict"}, `${verdictWords[d.verdict] ?? d.verdict}${names.length ? `: ${names.join(", ")}` : "."}`),
      d.verdict_text ? h("p", {}, marked(d.verdict_text)) :
      h("p", {}, `Held out, the error falls from ${floors(d.error?.base?.held_out)} to ${floors(d.error?.final?.held_out)} noise floors. What is left unexplained: ${floors(d.unexplained)}.`),
      h("p", {class: "stale-note muted small", hidden: true}, "The model has changed since. Diagnose again to see what is still missing."),
      this.next(d.next_experiment));
    const inFront = (c: any) => missing.has(c.id) || tied.has(c.id);
    const list: any[] = (d.candidates ?? []).map((c: any) => ({...c, tied: tied.has(c.id)}));
    const front = [...list.filter(inFront), ...list.filter((c) => !inFront(c)).slice(0, Math.max(0, 6 - list.filter(inFront).length))];
    this.law?.destroy();
    this.law = d.discovered?.law ? curve(d.discovered.law) : null;
    put(this.rest, d.discovered ? remainder(d.discovered, missing.size > 0, this.law) : null);
    this.key.hidden = !list.some((c) => c.signature?.x?.length);
    put(this.cards, ...front.map((c) => card(c, missing.has(c.id))));
    const rest = list.filter((c) => !front.includes(c));
    this.more.hidden = rest.length === 0;
    put(this.others, ...rest.map((c) => card(c, false)));
  }

  private next(n: any): HTMLElement | null {
    if (!n) return null;
    const profile: string = n.profile ?? "";
    const go = h("button", {onclick: async () => {
      if (await ask(`Run ${profile} on ${bench.name}?`, [h("p", {}, `The motor will turn: `, h("b", {}, profile), " on the bench ", h("b", {}, bench.name), ".")], "Start the run", stopButton()))
        rpc.call("run", {profile: n.text ?? profile, note: "proposed by the diagnosis"}).then((answer) => {
          bench.ownRun = answer.run;
          location.hash = "#bench";
        }, failed);
    }}, "Run it …");
    return h("div", {class: "stack"}, h("h3", {}, "Next experiment"), h("p", {class: "small"}, [profile, n.what].filter(Boolean).join(": "), n.record?.length ? `; record ${n.record.join(", ")} beside` : ""),
      bench.present && bench.mayMove && profile ? h("div", {class: "row"}, go) : null);
  }
}

export const diagnoseView: View = {
  id: "diagnose", title: "Diagnose", needs: "files",
  show(main) {
    const diagnose = new Diagnose();
    main.append(diagnose.element);
    return () => diagnose.close();
  },
};
