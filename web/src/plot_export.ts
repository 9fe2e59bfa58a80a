// What a plot gives away: its numbers as a table, as CSV in SI units, and its picture.

import {download, h, symbolText, textFile} from "./dom";
import {plain} from "./numbers";
import {columnOf, Plot} from "./plot";
import {colour} from "./theme";

const mostRows = 200;

function columnsOf(plot: Plot): {head: string; values: ArrayLike<number | null>}[] {
  const columns: {head: string; values: ArrayLike<number | null>}[] = [];
  plot.traces.forEach((trace, n) => {
    const at = columnOf(plot.traces, n);
    const name = trace.label || plot.options.y.name;
    columns.push({head: trace.high ? `${name}, smallest` : name, values: plot.data[at] as ArrayLike<number | null>});
    if (trace.high) columns.push({head: `${name}, largest`, values: plot.data[at + 1] as ArrayLike<number | null>});
    if (trace.error) columns.push({head: `${name}, standard error`, values: trace.error});
  });
  return columns;
}

export function numbersTable(plot: Plot): HTMLElement {
  const x = plot.data[0], columns = columnsOf(plot);
  const step = Math.max(1, Math.ceil(x.length / mostRows));
  const rows = [];
  for (let n = 0; n < x.length; n += step) {
    rows.push(h("tr", {}, h("td", {class: "n"}, plain(x[n], 6)), ...columns.map((c) => {
      const value = c.values[n];
      return h("td", {class: "n"}, value === null || value === undefined ? "–" : plain(value * plot.scale.factor, 5));
    })));
  }
  const unit = plot.scale.unit && plot.options.y.unit !== "1" ? ` [${plot.scale.unit}]` : "";
  return h("table", {},
    h("caption", {class: "only-read"}, plot.options.title + (step > 1 ? `, every ${step}th of ${x.length} rows` : "")),
    h("thead", {}, h("tr", {}, h("th", {class: "n", scope: "col"}, `${symbolText(plot.options.x.name)}${plot.options.x.unit ? ` [${plot.options.x.unit}]` : ""}`),
      ...columns.map((c) => h("th", {class: "n", scope: "col"}, c.head + unit)))),
    h("tbody", {}, ...rows));
}

function fileName(title: string): string {
  return title.toLowerCase().replace(/[^a-z0-9]+/g, "-").replace(/^-|-$/g, "") || "plot";
}

function quoted(text: string): string {
  const safe = /^[=+@\t\r]/.test(text) ? `'${text}` : text;  // a table program must not take a name for a formula
  return /[",\n]/.test(safe) ? `"${safe.replace(/"/g, '""')}"` : safe;
}

export function exportCsv(plot: Plot): void {
  const x = plot.data[0], columns = columnsOf(plot);
  const unit = plot.options.y.unit ? ` [${plot.options.y.unit}]` : "";
  const lines = [[`${plot.options.x.name} [${plot.options.x.unit}]`, ...columns.map((c) => c.head + unit)].map(quoted).join(",")];
  for (let n = 0; n < x.length; ++n) lines.push([x[n], ...columns.map((c) => c.values[n] ?? "")].join(","));
  textFile(`${fileName(plot.options.title)}.csv`, lines.join("\n") + "\n", "text/csv");
}

export function exportPng(plot: Plot): void {
  plot.drawNow();
  const source = plot.chart?.ctx.canvas;
  if (!source) return;
  const ratio = devicePixelRatio, head = 34 * ratio;
  const canvas = h("canvas", {width: source.width, height: source.height + head});
  const ctx = canvas.getContext("2d");
  if (!ctx) return;
  ctx.fillStyle = colour("surface");
  ctx.fillRect(0, 0, canvas.width, canvas.height);
  ctx.fillStyle = colour("ink");
  ctx.font = `600 ${14 * ratio}px system-ui, sans-serif`;
  ctx.fillText(plot.options.title, 8 * ratio, 20 * ratio);
  let at = 16 * ratio + ctx.measureText(plot.options.title).width;
  ctx.font = `${12 * ratio}px system-ui, sans-serif`;
  ctx.fillStyle = colour("muted");
  const {min, max} = plot.chart?.scales.x ?? {};
  const span = plot.options.noTime ? `, ${symbolText(plot.options.x.name)} from ${plain(min)} to ${plain(max)} ${plot.options.x.unit}` : "";
  const axis = `${symbolText(plot.options.y.name)}${plot.scale.unit ? ` [${plot.scale.unit}]` : ""}${span}`;
  ctx.fillText(axis, at, 20 * ratio);
  at += ctx.measureText(axis).width + 16 * ratio;
  for (const trace of plot.traces.filter((t) => t.label)) {
    ctx.fillStyle = colour(trace.ink);
    ctx.fillText(`— ${trace.label}`, at, 20 * ratio);
    at += ctx.measureText(`— ${trace.label}`).width + 12 * ratio;
  }
  ctx.drawImage(source, 0, head);
  canvas.toBlob((blob) => blob && download(`${fileName(plot.options.title)}.png`, blob));
}

/// A column of a small drawing: numbers or words.
export interface Column {
  head: string;
  values: (number | string | null)[];
}

/// A small drawing without axes that scale gives away the same as a plot does. @return the buttons, and the table that they open
export function drawingTools(title: string, drawing: SVGElement, columns: Column[]): {tools: HTMLElement; table: HTMLElement} {
  const rows = columns[0].values.map((_, n) => h("tr", {}, ...columns.map((c) => {
    const value = c.values[n];
    return h("td", {class: typeof value === "string" ? null : "n"}, typeof value === "number" ? plain(value, 4) : value ?? "–");
  })));
  const table = h("div", {class: "numbers", hidden: true, tabindex: "0", role: "region", "aria-label": `Numbers of ${title}`},
    h("table", {}, h("thead", {}, h("tr", {}, ...columns.map((c) => h("th", {scope: "col", class: typeof c.values[0] === "string" ? null : "n"}, c.head)))), h("tbody", {}, ...rows)));
  const numbers = h("button", {class: "quiet", "aria-expanded": "false", "aria-label": `Numbers of ${title}`, onclick: () => {
    table.hidden = !table.hidden;
    numbers.setAttribute("aria-expanded", String(!table.hidden));
  }}, "Numbers");
  const csv = () => textFile(`${fileName(title)}.csv`, [columns.map((c) => quoted(c.head)), ...columns[0].values.map((_, n) => columns.map((c) => quoted(String(c.values[n] ?? ""))))].map((row) => row.join(",")).join("\n") + "\n", "text/csv");
  const tools = h("span", {class: "tools"}, numbers, h("button", {class: "quiet", "aria-label": `PNG of ${title}`, onclick: () => drawingPng(title, drawing)}, "PNG"),
    h("button", {class: "quiet", "aria-label": `CSV of ${title}`, onclick: csv}, "CSV"));
  return {tools, table};
}

const drawn = ["stroke", "stroke-width", "stroke-dasharray", "stroke-opacity", "fill", "fill-opacity", "opacity", "font-size", "font-family"];

/// The style sheet is not in the picture: what it says goes into attributes.
function drawingPng(title: string, drawing: SVGElement): void {
  const box = drawing.getBoundingClientRect(), ratio = 2;
  const copy = drawing.cloneNode(true) as SVGElement;
  const [originals, copies] = [drawing, copy].map((root) => [root, ...root.querySelectorAll<SVGElement>("*")]);
  originals.forEach((original, n) => {
    const style = getComputedStyle(original);
    for (const name of drawn) copies[n].setAttribute(name, style.getPropertyValue(name));
  });
  copy.setAttribute("width", String(box.width));
  copy.setAttribute("height", String(box.height));
  const image = new Image();
  image.onload = () => {
    const canvas = h("canvas", {width: box.width * ratio, height: (box.height + 30) * ratio}), ctx = canvas.getContext("2d");
    if (!ctx) return;
    ctx.scale(ratio, ratio);
    ctx.fillStyle = colour("surface");
    ctx.fillRect(0, 0, box.width, box.height + 30);
    ctx.fillStyle = colour("ink");
    ctx.font = "600 14px system-ui, sans-serif";
    ctx.fillText(title, 8, 20);
    ctx.drawImage(image, 0, 30, box.width, box.height);
    canvas.toBlob((blob) => blob && download(`${fileName(title)}.png`, blob));
  };
  image.src = `data:image/svg+xml,${encodeURIComponent(new XMLSerializer().serializeToString(copy))}`;
}
