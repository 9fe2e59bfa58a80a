// A slider on every parameter: drag, type, or use the arrow keys; locked ones stay out of a fit.

import {h, put, setText, symbol, symbolText} from "../dom";
import {parseNumber, quantity, unitText} from "../numbers";
import {Parameter, work} from "../work";

const steps = 2000;

/// What a slider reaches. Bounds of effects are physics' own, many orders wide: a slider spans what is near the value, and
/// moves on when the value comes to its end.
export class Span {
  low = 0;
  high = 1;
  byRatio = false;

  constructor(p: Parameter, value: number) {
    const size = Math.abs(value);
    if (size === 0 || !Number.isFinite(size)) [this.low, this.high] = [p.min, Math.min(p.max, p.min + 1)];
    else if (value > 0 && p.min > 0) [this.low, this.high] = [Math.max(p.min, value / 4), Math.min(p.max, value * 4)];
    else if (value > 0 && p.min === 0) [this.low, this.high] = [0, Math.min(p.max, value * 3)];
    else [this.low, this.high] = [Math.max(p.min, value - 3 * size), Math.min(p.max, value + 3 * size)];
    this.byRatio = this.low > 0 && this.high / this.low > 4;
  }

  holds(value: number): boolean {
    const margin = 0.03 * (this.high - this.low);
    return value >= this.low + margin && value <= this.high - margin;
  }

  to(value: number): number {
    const part = this.byRatio ? Math.log(value / this.low) / Math.log(this.high / this.low) : (value - this.low) / (this.high - this.low);
    return Math.round(steps * Math.max(0, Math.min(1, Number.isFinite(part) ? part : 0)));
  }

  from(at: number): number {
    const part = at / steps;
    return this.byRatio ? this.low * (this.high / this.low) ** part : this.low + (this.high - this.low) * part;
  }
}

/// As one would type it.
function typed(value: number): string {
  return Math.abs(value) < 1e-3 && value !== 0 ? value.toExponential(4).replace(/\.?0*e/, "e") : String(Number(value.toPrecision(5)));
}

class Slider {
  readonly element: HTMLElement;
  private readonly range: HTMLInputElement;
  private readonly entry: HTMLInputElement;
  private readonly lock: HTMLInputElement;
  private readonly error = h("span", {class: "error"});
  private readonly lockLabel: HTMLElement;
  private parameter: Parameter;
  private span: Span;

  constructor(readonly name: string, parameter: Parameter, dragged: (name: string, value: number) => void, done: (name: string, value: number) => void) {
    this.parameter = parameter;
    this.span = new Span(parameter, parameter.value);
    const label = symbolText(name.split(".").pop() ?? name);
    this.range = h("input", {type: "range", min: 0, max: steps, step: 1, "aria-label": `${label}, slider`, "data-parameter": name, oninput: () => {
      const value = this.span.from(Number(this.range.value));
      this.write(value);
      dragged(name, value);
    }, onchange: () => done(name, this.span.from(Number(this.range.value)))});
    this.entry = h("input", {type: "text", inputmode: "decimal", autocomplete: "off", "aria-label": `${label}, value in ${unitText(parameter.unit) || "1"}`, onchange: () => this.typed(done)});
    this.lock = h("input", {type: "checkbox", "aria-label": `Lock ${label}: leave it out of a fit`, title: "Lock: a fit leaves it as it is", onchange: () =>
      work.change("lock", {parameter: name, fixed: this.lock.checked}, "locking")});
    this.lockLabel = h("label", {class: "check small muted"}, this.lock, "lock");
    this.element = h("div", {class: "parameter"}, symbol(name.split(".").pop() ?? name),
      h("span", {class: "entry"}, this.entry, h("span", {class: "unit"}, unitText(parameter.unit))),
      this.lockLabel, h("span", {class: "slide"}, this.range), this.error);
    this.take(parameter);
  }

  private typed(done: (name: string, value: number) => void): void {
    const value = parseNumber(this.entry.value), {min, max} = this.parameter;
    const wrong = !Number.isFinite(value) || value < min || value > max;
    this.entry.setAttribute("aria-invalid", String(wrong));
    if (wrong) setText(this.error, `between ${quantity(min, this.parameter.unit)} and ${quantity(max, this.parameter.unit)}`);
    else done(this.name, value);
  }

  take(parameter: Parameter): void {
    this.parameter = parameter;
    const tied = Boolean(parameter.tied_to);
    if (!this.span.holds(parameter.value)) this.span = new Span(parameter, parameter.value);
    this.range.value = String(this.span.to(parameter.value));
    this.range.hidden = this.lockLabel.hidden = tied;
    this.write(parameter.value);
    this.range.disabled = this.entry.disabled = tied;
    this.lock.checked = Boolean(parameter.fixed);
    this.lock.disabled = tied;
    this.entry.setAttribute("aria-invalid", "false");
    this.element.classList.toggle("locked", Boolean(parameter.fixed));
    const error = parameter.std_error;
    setText(this.error, tied ? `follows ${symbolText(parameter.tied_to ?? "")}` : parameter.at_bound ? "rests on its bound: no estimate" : error ? `± ${quantity(error, parameter.unit, 2)} standard error` : "");
  }

  private write(value: number): void {
    if (document.activeElement !== this.entry) this.entry.value = typed(value);
    this.range.setAttribute("aria-valuetext", quantity(value, this.parameter.unit));
  }
}

/// All sliders, those of an effect under its name with a way to take it out again.
export class Sliders {
  readonly element = h("div", {class: "parameters"});
  private readonly byName = new Map<string, Slider>();
  private of = "";

  constructor(private readonly dragged: (name: string, value: number) => void, private readonly done: (name: string, value: number) => void) {}

  take(parameters: {[name: string]: Parameter}, effects: {id: string; name: string}[]): void {
    const of = Object.keys(parameters).join();
    if (of !== this.of) {
      this.of = of;
      this.byName.clear();
      this.element.textContent = "";
      for (const [name, parameter] of Object.entries(parameters)) this.byName.set(name, new Slider(name, parameter, this.dragged, this.done));
      const in_ = (prefix: string) => [...this.byName.entries()].filter(([name]) => (prefix ? name.startsWith(`${prefix}.`) : !name.includes("."))).map(([, s]) => s.element);
      put(this.element, ...in_(""), ...effects.flatMap((effect) => [this.group(effect), ...in_(effect.id)]));
    }
    for (const [name, parameter] of Object.entries(parameters)) this.byName.get(name)?.take(parameter);
  }

  private group(effect: {id: string; name: string}): HTMLElement {
    return h("div", {class: "group"}, effect.name, h("button", {class: "quiet", "aria-label": `Remove ${effect.name}`, onclick: () =>
      work.change("remove", {effect: effect.id}, `Removing ${effect.name} and fitting again`)}, "Remove"));
  }
}
