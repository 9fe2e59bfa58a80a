// A recording in small: its speed, or what comes next to it, between the smallest and the largest of each moment.

import {h, signalWords, svg} from "../dom";
import {quantity} from "../numbers";

export interface Picture {
  signal: string;
  unit: string;
  t: number[];
  value?: (number | null)[];
  min?: (number | null)[];
  max?: (number | null)[];
}

const width = 112, height = 30;

export function thumbnail(picture: Picture | null | undefined): HTMLElement | null {
  const low = picture?.min ?? picture?.value, high = picture?.max ?? picture?.value;
  if (!picture || !low || !high || picture.t.length < 2) return null;
  const numbers = [...low, ...high].filter((v): v is number => v !== null);
  const least = Math.min(0, ...numbers), most = Math.max(0, ...numbers), end = picture.t[picture.t.length - 1] || 1;
  const x = (n: number) => ((width * picture.t[n]) / end).toFixed(1);
  const y = (v: number) => (height - 2 - ((height - 4) * (v - least)) / (most - least || 1)).toFixed(1);
  const line = (values: (number | null)[]) => values.flatMap((v, n) => (v === null ? [] : [`${x(n)},${y(v)}`]));
  const words = `${signalWords(picture.signal)}, ${quantity(Math.min(...numbers), picture.unit, 3)} to ${quantity(Math.max(...numbers), picture.unit, 3)}`;
  return h("span", {class: "thumbnail", title: words}, svg("svg", {viewBox: `0 0 ${width} ${height}`, width, height, role: "img", "aria-label": words},
    svg("polyline", {points: `0,${y(0)} ${width},${y(0)}`, class: "axis-line"}),
    svg("polygon", {points: [...line(high), ...line(low).reverse()].join(" "), class: "trace"})));
}
