// What the model misses: torque against speed, and the residuals by what they may depend on.

import {h, put, signalWords} from "../dom";
import {Plot, PlotOptions} from "../plot";
import {rpc} from "../rpc";

export function missingFigures(): {element: HTMLElement; load: () => void; close: () => void} {
  let plots = new Map<string, Plot>(), asked = 0, open = false;
  const curves = h("div", {class: "stack"}), maps = h("div", {class: "maps"});
  const details = h("details", {ontoggle: () => {
    open = details.open;
    if (open) load();
  }}, h("summary", {}, "Residual maps ", h("span", {class: "muted"}, "against speed, current, angle and time")), maps);
  const element = h("div", {class: "stack"}, h("section", {class: "panel stack", "aria-label": "What the model misses"}, h("h2", {}, "What the model misses"), curves),
    h("section", {class: "panel"}, details));

  async function load(): Promise<void> {
    const number = ++asked;
    try {
      const answer = await rpc.call("missing");
      if (number !== asked) return;
      const before = plots;
      plots = new Map();
      const one = (options: PlotOptions) => {
        const plot = before.get(options.title) ?? new Plot(options);  // one that is open with its numbers stays so
        before.delete(options.title);
        plots.set(options.title, plot);
        return plot;
      };
      const found: HTMLElement[] = (answer.curves ?? []).map((curve: any) => curvePlot(curve, one));
      if (!found.length) found.push(h("p", {class: "muted small"}, "These runs tell no missing torque or voltage."));
      place(curves, found);
      place(maps, open ? (answer.maps ?? []).map((map: any) => mapPlot(map, one)) : []);
      before.forEach((plot) => plot.destroy());
    } catch (error) {
      put(curves, h("p", {class: "muted small"}, String((error as Error).message)));
    }
  }

  /// Leaves alone what is there already, so that a button that was pressed keeps the focus.
  function place(host: HTMLElement, elements: HTMLElement[]): void {
    if (elements.length === host.children.length && elements.every((element, n) => element === host.children[n])) return;
    put(host, ...elements);
  }

  /// In the order of x, as a plot needs it.
  function sorted(x: number[], y: number[], error: number[]): {x: number[]; y: number[]; error: number[]} {
    const order = x.map((_v, n) => n).sort((a, b) => x[a] - x[b]);
    return {x: order.map((n) => x[n]), y: order.map((n) => y[n]), error: order.map((n) => error[n])};
  }

  function curvePlot(curve: any, one: (options: PlotOptions) => Plot): HTMLElement {
    const plot = one({title: `Missing ${curve.quantity} against ${signalWords(curve.against).toLowerCase()}`, about: "what would have to act on the model to make it agree with the measurement, with standard errors",
      x: {name: curve.against, unit: curve.against_unit ?? "rad/s"}, y: {name: `missing ${curve.quantity}`, unit: curve.unit}, height: 200, zero: true});
    plot.show([{label: "missing", ink: "base", ...sorted(curve.x, curve.value, curve.std_error), as: "points"}]);
    return plot.element;
  }

  function mapPlot(map: any, one: (options: PlotOptions) => Plot): HTMLElement {
    const plot = one({title: `${signalWords(map.signal)} against ${signalWords(map.against).toLowerCase()}`, about: "mean residual of each bin with its standard error",
      x: {name: map.against, unit: map.against_unit ?? ""}, y: {name: map.signal, unit: map.unit}, height: 150, zero: true, });
    plot.floor = map.floor ?? undefined;
    plot.show([{label: "mean residual", ink: "base", ...sorted(map.bins, map.mean, map.std_error), as: "points"}]);
    return plot.element;
  }

  return {element, load, close: () => plots.forEach((p) => p.destroy())};
}
