// An expression of one's own, scored at once against what the model leaves.

import {h, put, setText, symbol} from "../dom";
import {floors, withError} from "../numbers";
import {rpc, RpcError} from "../rpc";
import {View} from "../view";
import {work} from "../work";
import {Scoreboard, workHead} from "./work_bar";

const places: {id: string; text: string}[] = [
  {id: "torque", text: "torque on the shaft, N m (positive accelerates)"}, {id: "voltage", text: "voltage added to the armature's, V"}, {id: "flux", text: "factor on K_b and K_m"},
];
const known = new Set(["omega", "i_a", "theta", "u_ref", "t", "pi", ..."abs sign sqrt exp log sin cos tan asin acos atan atan2 sinh cosh tanh rint min max".split(" ")]);

/// The names in an expression that nothing gives a value: parameters to be fitted.
export function parametersOf(formula: string): string[] {
  return [...new Set(formula.replace(/[0-9.]+e[-+]?[0-9]+/gi, " ").match(/[A-Za-z_][A-Za-z0-9_]*/g) ?? [])].filter((name) => !known.has(name));
}

interface Row {
  value: string;
  min: string;
  max: string;
  unit: string;
}

class Formula {
  readonly element: HTMLElement;
  private readonly board = new Scoreboard();
  private readonly place = h("select", {onchange: () => this.edited()}, ...places.map((p) => h("option", {value: p.id}, p.text)));
  private readonly text = h("textarea", {rows: "3", class: "mono", spellcheck: "false", id: "formula", autocomplete: "off", oninput: () => this.edited()});
  private readonly name = h("input", {type: "text", value: "my_effect", pattern: "[a-z][a-z0-9_]*", autocomplete: "off", oninput: () => this.edited()});
  private readonly rows = h("tbody", {});
  private readonly answer = h("div", {class: "stack", id: "formula-answer", "aria-live": "polite"});
  private readonly add = h("button", {class: "main", id: "formula-add", onclick: () => this.addIt()}, "Add to the model");
  private readonly head = workHead("Formula");
  private readonly kept = new Map<string, Row>();
  private timer = 0;
  private number = 0;
  private names = "";
  private readonly forget: () => void;

  constructor() {
    this.text.value = "-T*tanh(omega/w)";
    this.kept.set("T", {value: "0", min: "0", max: "1", unit: "N m"});
    this.kept.set("w", {value: "5", min: "0.5", max: "50", unit: "rad/s"});
    this.element = h("div", {class: "stack"}, this.head.element, h("div", {class: "two"},
      h("section", {class: "panel stack", "aria-label": "Expression"},
        h("label", {class: "field"}, "It is a", this.place), h("label", {class: "field"}, "Expression", this.text),
        h("p", {class: "muted small"}, "It may use omega, i_a, theta, u_ref, t and pi; + − * / ^, comparisons, a ? b : c; abs sign sqrt exp log sin cos tan tanh atan2 min max and their like. Every other name is a parameter, fitted between its bounds."),
        h("div", {class: "wide"}, h("table", {}, h("thead", {}, h("tr", {}, ...["parameter", "start", "from", "to", "unit"].map((t) => h("th", {scope: "col"}, t)))), this.rows)),
        h("label", {class: "field"}, "Name in the model", this.name), h("div", {class: "row"}, this.add)),
      h("div", {class: "stack"}, h("section", {class: "panel", "aria-label": "Score"}, h("h2", {}, "Score"), this.answer), h("section", {class: "panel", "aria-label": "Error"}, this.board.element))));
    this.forget = work.onChange(() => this.change());
    this.change();
    this.edited();
  }

  close(): void {
    this.forget();
    this.head.close();
    clearTimeout(this.timer);
  }

  private change(): void {
    this.board.write(work.state?.error);
    this.add.disabled = Boolean(work.busy);
  }

  private edited(): void {
    const names = parametersOf(this.text.value);
    if (names.join() !== this.names || !this.names) {
      this.names = names.join();
      put(this.rows, ...names.map((name) => this.row(name)));
    }
    clearTimeout(this.timer);
    this.timer = window.setTimeout(() => this.score(), 350);
  }

  private row(name: string): HTMLElement {
    const row = this.kept.get(name) ?? {value: "0", min: "0", max: "1", unit: ""};
    this.kept.set(name, row);
    const cell = (key: keyof Row, label: string) => h("td", {}, h("input", {type: "text", inputmode: key === "unit" ? "text" : "decimal", size: "7", maxlength: "40", autocomplete: "off", value: row[key], "aria-label": `${name}, ${label}`, oninput: (event: Event) => {
      row[key] = (event.target as HTMLInputElement).value;
      this.edited();
    }}));
    return h("tr", {}, h("th", {scope: "row"}, symbol(name)), cell("value", "start"), cell("min", "from"), cell("max", "to"), cell("unit", "unit"));
  }

  private request(): any {
    const parameters: {[name: string]: any} = {};
    for (const name of parametersOf(this.text.value)) {
      const row = this.kept.get(name) as Row;
      const [value, min, max] = [row.value, row.min, row.max].map((t) => Number(t.replace(",", ".")));
      parameters[name] = {value, min, max, unit: row.unit.trim() || "1"};
    }
    return {id: this.name.value, place: this.place.value, formula: this.text.value, parameters};
  }

  private async score(): Promise<void> {
    const number = ++this.number;
    if (!this.text.value.trim()) {
      put(this.answer, h("p", {class: "muted"}, "Type an expression."));
      return;
    }
    if (!this.answer.firstChild) put(this.answer, h("p", {class: "muted"}, "Scoring …"));
    this.answer.classList.add("muted");
    try {
      const answer = await rpc.call("formula", this.request());
      if (number !== this.number) return;
      this.show(answer);
      this.text.setAttribute("aria-invalid", "false");
    } catch (error) {
      if (number !== this.number) return;
      this.text.setAttribute("aria-invalid", "true");
      put(this.answer, h("p", {class: error instanceof RpcError && error.code === 0 ? "muted" : "bad"}, String((error as Error).message)));
    }
    this.answer.classList.remove("muted");
  }

  private show(a: any): void {
    const pair = (what: string, e: any) => (e ? [h("dt", {}, what), h("dd", {}, `${floors(e.before)} → `, h("b", {}, floors(e.after)))] : []);
    put(this.answer, h("dl", {class: "facts"}, ...pair("Error, train", a.train), ...pair("Error, held out", a.held_out),
      ...Object.entries<any>(a.parameters ?? {}).flatMap(([name, p]) => [h("dt", {}, symbol(name)), h("dd", {}, withError(p.value, p.std_error, p.unit ?? ""))])),
      a.text ? h("p", {class: "small"}, a.text) : null);
  }

  private addIt(): void {
    work.change("add", {formula: this.request()}, `Adding ${this.name.value} and fitting again`).then((done) => done && setText(this.answer, "It is in the model now; Undo takes it out again."));
  }
}

export const formulaView: View = {
  id: "formula", title: "Formula", needs: "files",
  show(main) {
    const formula = new Formula();
    main.append(formula.element);
    return () => formula.close();
  },
};
