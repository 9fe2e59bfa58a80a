// A slider on every parameter: drag, type, or use the arrow keys; locked ones stay out of a fit.

import {h, put, setText, symbol, symbolText} from "../dom";
import {parseNumber, plain, quantity, unitText} from "../numbers";
import {Parameter, work} from "../work";

const steps = 2000;

/// Where a value lies on a slider: by ratios where the bounds are positive and far apart, finer near zero where one is zero.
export function toSlider(p: Parameter, value: number): number {
  const {min, max} = p;
  const part = min > 0 && max / min > 8 ? Math.log(value / min) / Math.log(max / min) : min === 0 ? Math.cbrt(value / max) : (value - min) / (max - min);
  return Math.round(steps * Math.max(0, Math.min(1, Number.isFinite(part) ? part : 0)));
}

export function fromSlider(p: Parameter, at: number): number {
  const {min, max} = p, part = at / steps;
  if (min > 0 && max / min > 8) return min * (max / min) ** part;
  return min === 0 ? max * part ** 3 : min + (max - min) * part;
}

class Slider {
  readonly element: HTMLElement;
  private readonly range: HTMLInputElement;
  private readonly entry: HTMLInputElement;
  private readonly lock: HTMLInputElement;
  private readonly error = h("span", {class: "error"});
  private parameter: Parameter;

  constructor(readonly name: string, parameter: Parameter, dragged: (name: string, value: number) => void, done: (name: string, value: number) => void) {
    this.parameter = parameter;
    const label = symbolText(name.split(".").pop() ?? name);
    this.range = h("input", {type: "range", min: 0, max: steps, step: 1, "aria-label": `${label}, slider`, "data-parameter": name, oninput: () => {
      const value = fromSlider(this.parameter, Number(this.range.value));
      this.write(value);
      dragged(name, value);
    }, onchange: () => done(name, fromSlider(this.parameter, Number(this.range.value)))});
    this.entry = h("input", {type: "text", inputmode: "decimal", autocomplete: "off", "aria-label": `${label}, value in ${unitText(parameter.unit) || "1"}`, onchange: () => this.typed(done)});
    this.lock = h("input", {type: "checkbox", "aria-label": `Lock ${label}: leave it out of a fit`, title: "Lock: a fit leaves it as it is", onchange: () =>
      work.change("lock", {parameter: name, fixed: this.lock.checked}, "locking")});
    this.element = h("div", {class: "parameter"}, symbol(name.split(".").pop() ?? name),
      h("span", {class: "entry"}, this.entry, h("span", {class: "unit"}, unitText(parameter.unit))),
      h("label", {class: "check small muted"}, this.lock, "lock"), h("span", {class: "slide"}, this.range), this.error);
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
    this.range.value = String(toSlider(parameter, parameter.value));
    this.write(parameter.value);
    this.range.disabled = this.entry.disabled = tied;
    this.lock.checked = Boolean(parameter.fixed);
    this.lock.disabled = tied;
    this.entry.setAttribute("aria-invalid", "false");
    this.element.classList.toggle("locked", Boolean(parameter.fixed));
    const error = parameter.std_error;
    setText(this.error, tied ? `tied to ${symbolText(parameter.tied_to ?? "")}` : parameter.at_bound ? "rests on its bound: no estimate" : error ? `± ${quantity(error, parameter.unit, 2)} standard error of the last fit` : "");
  }

  private write(value: number): void {
    if (document.activeElement !== this.entry) this.entry.value = plain(value, 5).replace(/×10(.*)/, (_all, e: string) => `e${e.replace(/[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]/g, (c) => (c === "⁻" ? "-" : String("⁰¹²³⁴⁵⁶⁷⁸⁹".indexOf(c))))}`);
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
