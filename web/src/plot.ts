// One plot: uPlot with the page's colours, units, keyboard, numbers, PNG and CSV.

import uPlot from "uplot";
import {h, newId, put, setText, svg, symbol} from "./dom";
import {plain, Scale, scaleFor, unitText} from "./numbers";
import {exportCsv, exportPng, numbersTable} from "./plot_export";
import {colour, faint, Ink, onTheme} from "./theme";

export type Values = ArrayLike<number | null>;

/// One thing drawn. `high`: what is drawn lies between `y` and `high` (smallest and largest of each bin), so no peak is lost.
export interface Trace {
  label: string;
  ink: Ink;
  x: ArrayLike<number>;
  y: Values;
  high?: Values;
  error?: Values;  ///< standard errors of y
  as?: "line" | "steps" | "points" | "area" | "envelope";  ///< envelope: one line to and fro between y and high, cheap to draw
  dash?: boolean;
  width?: number;
}

export interface AxisText {
  name: string;  ///< a signal's or parameter's name, or words
  unit: string;
}

export interface PlotOptions {
  title: string;
  about: string;  ///< for those who do not see it
  x: AxisText;
  y: AxisText;
  height?: number;
  group?: Group;
  bare?: boolean;  ///< without header: a strip
  noTime?: boolean;  ///< the x axis without numbers: another plot below has them
  floor?: number;  ///< noise floor, drawn on top at plus and minus
  zero?: boolean;  ///< the range holds zero
  log?: boolean;
  logX?: boolean;
  smallest?: number;  ///< least height of the y axis, so that noise does not fill it
}

/// Plots that share the x range and the cursor.
export class Group {
  private members = new Set<Plot>();
  range: [number, number] | null = null;
  readonly key = newId("sync");
  constructor(private changed: (range: [number, number] | null) => void = () => {}) {}

  join(plot: Plot): void {
    this.members.add(plot);
  }
  leave(plot: Plot): void {
    this.members.delete(plot);
  }
  zoom(range: [number, number] | null): void {
    this.range = range;
    for (const plot of this.members) plot.showRange(range);
    this.changed(range);
  }
}

const dashes = [5, 4];

export class Plot {
  readonly element: HTMLElement;
  traces: Trace[] = [];
  scale: Scale = {factor: 1, unit: ""};
  xScale: Scale = {factor: 1, unit: ""};
  chart: uPlot | null = null;
  floor: number | undefined;
  private columns: uPlot.AlignedData = [[]];
  private signature = "";
  private readonly canvas = h("div", {class: "canvas", tabindex: "0", role: "img"});
  private readonly keys = h("span", {class: "row"});
  private readonly axis = h("span", {class: "axis"});
  readonly tools: HTMLElement;  ///< in the header; without one, wherever the view puts it
  private tableTimer = 0;
  private readonly table = h("div", {class: "numbers", hidden: true, tabindex: "0", role: "region", "aria-label": "Numbers of this plot"});
  private keyValues: HTMLElement[] = [];
  size = 0;  ///< largest value drawn; a strip keeps it, so that its digits do not jump
  private readonly watch: ResizeObserver;
  private readonly sight: IntersectionObserver;
  private inSight = true;
  private stale = false;  ///< what is out of sight is drawn when it comes into it
  private readonly forget: () => void;
  private xRange: [number, number] | null = null;

  constructor(readonly options: PlotOptions) {
    this.floor = options.floor;
    this.canvas.setAttribute("aria-label", `${options.title}: ${options.about}`);
    const numbers = h("button", {class: "quiet", "aria-expanded": "false", "aria-label": `Numbers of ${options.title}`, onclick: () => this.toggleNumbers(numbers)}, "Numbers");
    this.tools = h("span", {class: "tools"}, numbers,
      h("button", {class: "quiet", "aria-label": `PNG of ${options.title}`, onclick: () => exportPng(this)}, "PNG"),
      h("button", {class: "quiet", "aria-label": `CSV of ${options.title}`, onclick: () => exportCsv(this)}, "CSV"));
    const header = options.bare ? null : h("header", {}, h("span", {class: "title"}, options.title), this.axis, this.keys, this.tools);
    this.element = h("figure", {class: "figure"}, header, this.canvas, this.table);
    this.canvas.addEventListener("keydown", (event) => this.key(event));
    this.canvas.addEventListener("dblclick", () => this.zoomTo(null));
    this.watch = new ResizeObserver(() => this.resize());
    this.watch.observe(this.canvas);
    this.sight = new IntersectionObserver((changes) => {
      this.inSight = changes[changes.length - 1].isIntersecting;
      if (this.inSight) this.drawNow();
    }, {rootMargin: "100px"});
    this.sight.observe(this.canvas);
    this.forget = onTheme(() => this.chart?.redraw(true, true));
    options.group?.join(this);
    this.xRange = options.group?.range ?? null;
  }

  /// Ends the plot; its view is gone.
  destroy(): void {
    this.watch.disconnect();
    this.sight.disconnect();
    clearTimeout(this.tableTimer);
    this.forget();
    this.options.group?.leave(this);
    this.chart?.destroy();
    this.chart = null;
  }

  /// Draws these instead. As long as labels and kinds stay, only the data change. @param range of x, where it changes, too
  show(traces: Trace[], range?: [number, number]): void {
    this.traces = traces;
    if (range) this.xRange = range;
    this.columns = aligned(traces);
    const size = Math.max(largest(traces, this.floor), this.options.smallest ?? 0, this.options.bare ? this.size : 0);
    this.size = size;
    this.scale = scaleFor(size, this.options.y.unit);
    const signature = traces.map((t) => `${t.label}|${t.as}|${t.high ? 1 : 0}|${t.ink}`).join(";");
    if (!this.chart || signature !== this.signature) {
      this.signature = signature;
      this.build();
    } else {
      this.stale = true;
      if (this.inSight) this.drawNow();
    }
    this.labelAxis();
    if (!this.table.hidden && !this.tableTimer) this.tableTimer = window.setTimeout(() => this.writeTable(), 300);  // not 30 times a second
  }

  private writeTable(): void {
    this.tableTimer = 0;
    put(this.table, this.table.hidden ? null : numbersTable(this));
  }

  /// Draws what was shown while nobody saw it.
  drawNow(): void {
    if (!this.stale || !this.chart) return;
    this.stale = false;
    this.chart.setData(this.columns, false);
    this.fit();
  }

  /// The part of x that is shown; null: all of it.
  showRange(range: [number, number] | null): void {
    this.xRange = range;
    this.fit();
  }

  private fit(): void {
    if (!this.chart) return;
    const x = this.columns[0];
    const [low, high] = this.xRange ?? [x.length ? x[0] : 0, x.length ? x[x.length - 1] : 1];
    const margin = !this.xRange && this.traces.length && this.traces.every((t) => t.as === "points") ? 0.02 * (high - low) : 0;
    this.chart.batch(() => this.chart?.setScale("x", {min: low - margin, max: high > low ? high + margin : low + 1}));
  }

  private zoomTo(range: [number, number] | null): void {
    if (this.options.group) this.options.group.zoom(range);
    else this.showRange(range);
  }

  private build(): void {
    this.chart?.destroy();
    this.canvas.textContent = "";
    const width = Math.max(120, this.canvas.clientWidth || 600);
    this.stale = false;
    this.chart = new uPlot(chartOptions(this, width, (range) => this.zoomTo(range)), this.columns, this.canvas);
    this.fit();
    this.keyValues = [];
    put(this.keys, ...this.traces.filter((t) => t.label).map((trace) => {
      const value = h("span", {class: "value"});
      this.keyValues.push(value);
      return h("span", {class: "key"}, keyPicture(trace), trace.label, value);
    }));
  }

  private resize(): void {
    const width = this.canvas.clientWidth;
    if (this.chart && width > 0 && Math.abs(width - this.chart.width) > 1) this.chart.setSize({width, height: this.height()});
  }

  height(): number {
    return this.options.height ?? 190;
  }

  private labelAxis(): void {
    const unit = this.scale.unit && this.options.y.unit !== "1" ? ` [${this.scale.unit}]` : "";
    if (this.axis.textContent !== this.options.y.name + unit || !this.axis.firstChild) put(this.axis, symbol(this.options.y.name), unit);
  }

  /// What stands under the cursor, beside the names.
  cursor(index: number | null | undefined): void {
    this.traces.filter((t) => t.label).forEach((trace, n) => {
      const column = this.columns[columnOf(this.traces, this.traces.indexOf(trace))];
      const value = index === null || index === undefined ? null : column[index];
      if (this.keyValues[n]) setText(this.keyValues[n], value === null || value === undefined ? "" : plain(value * this.scale.factor, 4));
    });
  }

  get data(): uPlot.AlignedData {
    return this.columns;
  }

  private key(event: KeyboardEvent): void {
    if (!this.chart || event.ctrlKey || event.metaKey || event.altKey) return;
    const {min, max} = this.chart.scales.x;
    if (min === undefined || max === undefined || min === null || max === null) return;
    const step = (max - min) / 5, middle = (min + max) / 2;
    const zooms: {[key: string]: [number, number] | null} = {
      ArrowLeft: [min - step, max - step], ArrowRight: [min + step, max + step], "+": [middle - 1.5 * step, middle + 1.5 * step],
      "-": [middle - 4 * step, middle + 4 * step], "0": null, Home: null,
    };
    if (!(event.key in zooms)) return;
    event.preventDefault();
    this.zoomTo(zooms[event.key]);
  }

  private toggleNumbers(button: HTMLElement): void {
    this.table.hidden = !this.table.hidden;
    button.setAttribute("aria-expanded", String(!this.table.hidden));
    this.writeTable();
  }
}

/// Where the columns of a trace begin.
export function columnOf(traces: Trace[], index: number): number {
  return 1 + traces.slice(0, index).reduce((n, t) => n + (t.high ? 2 : 1), 0);
}

function aligned(traces: Trace[]): uPlot.AlignedData {
  const first = traces[0]?.x ?? [];
  const same = traces.every((t) => t.x === first || (t.x.length === first.length && t.x[0] === first[0] && t.x[t.x.length - 1] === first[first.length - 1]));
  const of = (t: Trace): any[] => (t.high ? [t.y, t.high] : [t.y]);
  if (same) return [first, ...traces.flatMap(of)] as unknown as uPlot.AlignedData;
  return uPlot.join(traces.map((t) => [t.x, ...of(t)] as unknown as uPlot.AlignedData));
}

function largest(traces: Trace[], floor = 0): number {
  let size = floor;
  for (const trace of traces) {
    for (const values of [trace.y, trace.high]) {
      for (let n = 0; values && n < values.length; ++n) {
        const value = values[n];
        if (value !== null && Math.abs(value) > size && Number.isFinite(value)) size = Math.abs(value);
      }
    }
  }
  return size;
}

function keyPicture(trace: Trace): SVGElement {
  const shape = trace.as === "points" ? svg("circle", {cx: 9, cy: 5, r: 3, class: `ink-${trace.ink}`})
    : svg("line", {x1: 1, x2: 17, y1: 5, y2: 5, class: `ink-${trace.ink}`, "stroke-width": trace.as === "area" ? 7 : 2.2, "stroke-dasharray": trace.dash ? "5 3" : "none"});
  return svg("svg", {viewBox: "0 0 18 10", "aria-hidden": "true"}, shape);
}

function seriesOf(trace: Trace): uPlot.Series[] {
  const points = trace.as === "points", soft = trace.high && trace.ink === "measured";  // a ground for what is drawn on it
  const one: uPlot.Series = {
    label: trace.label, width: points ? 0 : trace.width ?? 1.6, stroke: () => (soft ? faint(trace.ink, 0.7) : colour(trace.ink)), dash: trace.dash ? dashes : undefined,
    points: {show: points, size: 6, stroke: () => colour(trace.ink), fill: () => colour(trace.ink)}, spanGaps: false,
  };
  if (points) one.paths = () => null;
  if (trace.as === "steps" && uPlot.paths.stepped) one.paths = uPlot.paths.stepped({align: 1});
  if (trace.as === "area") one.width = 0;
  if (trace.as === "envelope") return [{...one, paths: () => null}, {...one, paths: envelope}];
  return trace.high ? [one, {...one}] : [one];
}

/// A stroke from bin to bin, and within each from its smallest to its largest: what a live strip can afford 30 times a second.
function envelope(u: uPlot, series: number, from: number, to: number): uPlot.Series.Paths {
  const [x, low, high] = [u.data[0], u.data[series - 1], u.data[series]], {left, top, width, height} = u.bbox;
  const {min: x0 = 0, max: x1 = 1} = u.scales.x, {min: y0 = 0, max: y1 = 1} = u.scales.y;
  const perX = width / ((x1 ?? 1) - (x0 ?? 0)), perY = height / ((y1 ?? 1) - (y0 ?? 0));
  const stroke = new Path2D();
  let down = false;
  for (let n = from; n <= to; ++n) {
    const a = low[n], b = high[n];
    if (a === null || b === null || a === undefined || b === undefined) {
      down = false;
      continue;
    }
    const at = left + (x[n] - (x0 ?? 0)) * perX, first = top + height - ((n % 2 ? b : a) - (y0 ?? 0)) * perY;
    if (down) stroke.lineTo(at, first);
    else stroke.moveTo(at, first);
    if (a !== b) stroke.lineTo(at, top + height - ((n % 2 ? a : b) - (y0 ?? 0)) * perY);
    down = true;
  }
  return {stroke, fill: null, clip: null, band: null, flags: 0};
}

function bandsOf(traces: Trace[]): uPlot.Band[] {
  return traces.flatMap((trace, n) => {
    if (!trace.high || trace.as === "envelope") return [];
    const from = columnOf(traces, n);
    return [{series: [from + 1, from] as [number, number], fill: () => faint(trace.ink, trace.as === "area" || trace.ink === "measured" ? 0.3 : 0.55)} as unknown as uPlot.Band];
  });
}

/// Plots share the cursor. What is dragged in one is told to the others as a range, once.
function notOfDrag(event: string): boolean {
  return event !== "mousedown" && event !== "mouseup";
}

function chartOptions(plot: Plot, width: number, zoom: (range: [number, number]) => void): uPlot.Options {
  const {options} = plot;
  const axis = {stroke: () => colour("muted"), grid: {stroke: () => colour("grid"), width: 1}, ticks: {stroke: () => colour("grid"), size: 4}, font: "12px system-ui, sans-serif"};
  const decades = {...axis.grid, filter: (_u: uPlot, splits: number[]) => splits.map((v) => (Math.abs(Math.log10(v) % 1) < 1e-6 ? v : null))};
  const gridX = options.logX ? {grid: decades, ticks: decades} : {}, gridY = options.log ? {grid: decades, ticks: decades} : {};
  const xUnit = unitText(options.x.unit) && ` ${unitText(options.x.unit)}`;
  return {
    width, height: plot.height(), pxAlign: 0, padding: [8, options.logX ? 40 : 22, 0, 0],
    cursor: {sync: options.group ? {key: options.group.key, setSeries: false, filters: {pub: notOfDrag}} : undefined, drag: {x: true, y: false, setScale: false}, points: {size: 7}},
    legend: {show: false},
    scales: {x: {time: false, auto: false, distr: options.logX ? 3 : 1}, y: {distr: options.log ? 3 : 1, range: (_u, low, high) => yRange(plot, low, high)}},
    series: [{}, ...plot.traces.flatMap(seriesOf)],
    bands: bandsOf(plot.traces),
    axes: [
      {...axis, ...gridX, size: options.noTime ? 6 : 30, gap: 3, space: 70,
        values: (_u, ticks) => ticks.map((v, n) => (options.noTime || v === null ? "" : plain(v, 6) + (n === ticks.length - 1 ? xUnit : "")))},
      {...axis, ...gridY, size: 58, gap: 4, space: options.bare ? 22 : 34, values: (_u, ticks) => ticks.map((v) => (v === null || v === undefined ? "" : plain(v * plot.scale.factor, 4)))},
    ],
    hooks: {
      setCursor: [(u) => plot.cursor(u.cursor.idx)],
      setSelect: [(u) => {
        if (u.select.width < 8) return;
        const from = u.posToVal(u.select.left, "x"), to = u.posToVal(u.select.left + u.select.width, "x");
        u.setSelect({left: 0, top: 0, width: 0, height: 0}, false);
        zoom([from, to]);
      }],
      draw: [(u) => drawFloor(u, plot.floor), (u) => drawErrors(u, plot.traces)],
    },
  };
}

function yRange(plot: Plot, low: number | null, high: number | null): uPlot.Range.MinMax {
  if (low === null || high === null || !Number.isFinite(low) || !Number.isFinite(high)) return plot.options.log ? [0.1, 10] : [0, 1];
  if (plot.options.log) return [10 ** Math.floor(Math.log10(Math.max(low, 1e-12)) - 0.05), 10 ** Math.ceil(Math.log10(Math.max(high, 1e-12)) + 0.05)];
  if (plot.floor) {
    low = Math.min(low, -1.6 * plot.floor);
    high = Math.max(high, 1.6 * plot.floor);
  }
  for (const trace of plot.traces) {
    for (let n = 0; trace.error && n < trace.x.length; ++n) {
      const value = trace.y[n], error = trace.error[n];
      if (value === null || error === null || !Number.isFinite(value + error)) continue;
      low = Math.min(low, value - error);
      high = Math.max(high, value + error);
    }
  }
  if (plot.options.zero) {
    low = Math.min(low, 0);
    high = Math.max(high, 0);
  }
  const least = plot.options.smallest ?? 0;
  if (high - low < least) [low, high] = [(low + high - least) / 2, (low + high + least) / 2];
  const margin = (high - low || Math.abs(high) || 1) * 0.06;
  return [low - margin, high + margin];
}

/// Plus and minus the noise floor, over the data: what lies between is the instrument's.
function drawFloor(u: uPlot, floor: number | undefined): void {
  if (!floor) return;
  const {ctx, bbox} = u;
  const top = u.valToPos(floor, "y", true), bottom = u.valToPos(-floor, "y", true);
  ctx.save();
  ctx.beginPath();
  ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
  ctx.clip();
  ctx.fillStyle = faint("floor", 0.35);
  ctx.fillRect(bbox.left, top, bbox.width, bottom - top);
  ctx.strokeStyle = colour("muted");
  ctx.lineWidth = devicePixelRatio;
  ctx.setLineDash([4 * devicePixelRatio, 3 * devicePixelRatio]);
  for (const y of [top, bottom]) {
    ctx.beginPath();
    ctx.moveTo(bbox.left, y);
    ctx.lineTo(bbox.left + bbox.width, y);
    ctx.stroke();
  }
  ctx.restore();
}

function drawErrors(u: uPlot, traces: Trace[]): void {
  for (const trace of traces) {
    if (!trace.error) continue;
    const {ctx} = u;
    ctx.save();
    ctx.strokeStyle = colour(trace.ink);
    ctx.lineWidth = 1.2 * devicePixelRatio;
    for (let n = 0; n < trace.x.length; ++n) {
      const [value, error] = [trace.y[n], trace.error[n]];
      if (value === null || error === null || !Number.isFinite(error)) continue;
      const x = u.valToPos(trace.x[n], "x", true);
      ctx.beginPath();
      ctx.moveTo(x, u.valToPos(value - error, "y", true));
      ctx.lineTo(x, u.valToPos(value + error, "y", true));
      ctx.stroke();
    }
    ctx.restore();
  }
}
