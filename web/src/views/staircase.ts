// The error after each step, train and held out, down to the noise floor at 1.

import {h, svg} from "../dom";
import {floors} from "../numbers";
import {drawingTools} from "../plot_export";
import {Work} from "../work";

const width = 320, height = 210, left = 34, right = 10, top = 14, bottom = 40;

export function staircase(steps: Work["steps"]): HTMLElement {
  if (!steps.length) return h("div", {class: "stack"}, h("h2", {}, "The falling error"), h("p", {class: "muted small"}, "It begins with the first fit."));
  const values = steps.flatMap((s) => [s.train, s.held_out]).filter((v): v is number => v !== null && v > 0);
  const lowest = Math.min(0.7, ...values), highest = Math.max(2, ...values) * 1.3;
  const y = (v: number) => top + ((height - top - bottom) * Math.log(highest / v)) / Math.log(highest / lowest);
  const span = (width - left - right) / steps.length;
  const path = (of: (s: Work["steps"][0]) => number | null) => {
    let d = "";
    steps.forEach((s, n) => {
      const v = of(s);
      if (v !== null && v > 0) d += `${d ? "L" : "M"}${left + n * span},${y(v).toFixed(1)}L${left + (n + 1) * span},${y(v).toFixed(1)}`;
    });
    return d;
  };
  const ticks = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000].filter((v) => v >= lowest && v <= highest && (highest < 30 || /^[15]/.test(String(v))));
  const drawing = svg("svg", {viewBox: `0 0 ${width} ${height}`, role: "img", class: "stairs", "aria-label": `Error by step: ${steps.map((s) => `${s.added ?? "fitted"} ${floors(s.train)} train, ${floors(s.held_out)} held out`).join("; ")}`},
    ...ticks.flatMap((v) => [svg("line", {x1: left, x2: width - right, y1: y(v), y2: y(v), class: "axis-line"}), svg("text", {x: left - 6, y: y(v) + 4, "text-anchor": "end"}, v)]),
    svg("line", {x1: left, x2: width - right, y1: y(1), y2: y(1), class: "ink-ink", "stroke-dasharray": "4 3"}), svg("text", {x: width - right, y: y(1) - 4, "text-anchor": "end"}, "noise floor"),
    svg("path", {d: path((s) => s.train), class: "curve ink-base", "fill-opacity": 0, "stroke-dasharray": "6 3"}),
    svg("path", {d: path((s) => s.held_out), class: "curve ink-model", "fill-opacity": 0}),
    ...steps.map((s, n) => svg("text", {x: left + (n + 0.5) * span, y: height - bottom + 16, "text-anchor": "middle"}, short(s.added, steps.length))),
    svg("line", {x1: left, x2: left + 20, y1: height - 8, y2: height - 8, class: "curve ink-base", "stroke-dasharray": "6 3"}), svg("text", {x: left + 25, y: height - 4}, "train"),
    svg("line", {x1: left + 80, x2: left + 100, y1: height - 8, y2: height - 8, class: "curve ink-model"}), svg("text", {x: left + 105, y: height - 4}, "held out"));
  const {tools, table} = drawingTools("The falling error", drawing, [{head: "step", values: steps.map((s) => (s.added ? s.added.replace(/_/g, " ") : "fitted"))},
    {head: "train [noise floors]", values: steps.map((s) => s.train)}, {head: "held out [noise floors]", values: steps.map((s) => s.held_out)}]);
  return h("div", {class: "stack figure", id: "staircase"}, h("header", {}, h("h2", {}, "The falling error"), tools), drawing, table);
}

function short(added: string | null, count: number): string {
  const words = (added ?? "fitted").replace(/_/g, " "), most = Math.max(6, Math.floor(44 / count));
  return words.length > most ? `${words.slice(0, most - 1)}…` : words;
}
