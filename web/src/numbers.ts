// Numbers as a person reads them: SI prefixes, no more digits than they carry, a true minus.

const prefixes: {[exponent: number]: string} = {[-12]: "p", [-9]: "n", [-6]: "µ", [-3]: "m", 0: "", 3: "k", 6: "M", 9: "G"};
// Of these units a prefix is usual; "m rad/s" or "µkg m²" are not.
const takesPrefix = new Set(["A", "V", "s", "N m", "ohm", "Ω", "H", "W", "F", "Hz"]);

export interface Scale {
  factor: number;  ///< value times factor is what is shown
  unit: string;
}

/// Units as they are printed: Ω, kg m², rad/s².
export function unitText(unit: string): string {
  if (unit === "1") return "";
  if (unit.includes("^(")) return unit.replace(/ /g, "\u00a0");
  return unit.replace(/\bohm\b/g, "Ω").replace(/degC/g, "°C").replace(/\^?2\b/g, "²").replace(/\^?3\b/g, "³")
    .replace(/([A-Za-z])²/g, "$1²").replace(/ /g, "\u00a0");
}

/// The prefix that suits values of this size.
export function scaleFor(size: number, unit: string): Scale {
  if (!Number.isFinite(size) || size === 0) return {factor: 1, unit: unitText(unit)};
  if (takesPrefix.has(unit)) {
    const exponent = Math.max(-12, Math.min(9, Math.floor(Math.log10(Math.abs(size) * 1.0000001) / 3) * 3));
    if (exponent > 0 && unit === "s") return {factor: 1, unit: "s"};
    return {factor: 10 ** -exponent, unit: prefixes[exponent] + unitText(unit)};
  }
  const exponent = Math.floor(Math.log10(Math.abs(size) * 1.0000001));
  if (exponent >= -3 && exponent <= 5) return {factor: 1, unit: unitText(unit)};
  const third = Math.floor(exponent / 3) * 3;
  return {factor: 10 ** -third, unit: `10${superscript(third)}\u00a0${unitText(unit)}`.trim()};
}

export function superscript(exponent: number): string {
  return String(exponent).replace(/[-0-9]/g, (c) => (c === "-" ? "⁻" : "⁰¹²³⁴⁵⁶⁷⁸⁹"[Number(c)]));
}

function minus(text: string): string {
  return text.replace(/-/g, "−");
}

/// A number without a unit, to `digits` significant ones.
export function plain(value: number | null | undefined, digits = 4): string {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  if (value === 0) return "0";
  const exponent = Math.floor(Math.log10(Math.abs(value)));
  if (exponent < -4 || exponent > 5) {
    const mantissa = Number((value / 10 ** exponent).toPrecision(digits));
    return minus(`${mantissa}`) + `×10${superscript(exponent)}`;
  }
  return minus(String(Number(value.toPrecision(digits))));
}

/// A number with its unit: "54.7 mN m".
export function quantity(value: number | null | undefined, unit: string, digits = 4): string {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  const scale = scaleFor(value, unit);
  return withUnit(plain(value * scale.factor, digits), scale.unit);
}

function withUnit(number: string, unit: string): string {
  return /^10[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]/.test(unit) ? `${number}×${unit}` : `${number}\u00a0${unit}`.trim();
}

/// A reading whose digits stay in place while it changes: "  54.70".
export function reading(value: number | null | undefined, scale: Scale, places: number): string {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  return minus((value * scale.factor).toFixed(places));
}

/// "54.69 ± 0.02 mN m": the error with one digit, two where the first is a 1; the value to the same place.
export function withError(value: number | null | undefined, error: number | null | undefined, unit: string): string {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  if (error === null || error === undefined || !Number.isFinite(error) || error <= 0) return quantity(value, unit);
  const scale = scaleFor(Math.max(Math.abs(value), error), unit);
  const [v, e] = [value * scale.factor, error * scale.factor];
  const exponent = Math.floor(Math.log10(e));
  const places = Math.max(0, Math.min(9, (Number(String(e / 10 ** exponent)[0]) === 1 ? 1 : 0) - exponent));
  const both = `${minus(v.toFixed(places))} ± ${e.toFixed(places)}`;
  return withUnit(/^10/.test(scale.unit) ? `(${both})` : both, scale.unit);
}

/// "1.04": an error in units of the noise floor, with three digits as reports have it.
export function floors(value: number | null | undefined): string {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  return value >= 100 ? String(Math.round(value)) : value >= 10 ? value.toFixed(1) : value >= 1 ? value.toFixed(2) : value.toFixed(3);
}

export function percent(value: number | null | undefined): string {
  return value === null || value === undefined || !Number.isFinite(value) ? "–" : `${minus(value.toFixed(Math.abs(value) < 10 ? 1 : 0))} %`;
}

/// "2 min 05 s", "12.3 s".
export function duration(seconds: number): string {
  if (!Number.isFinite(seconds)) return "–";
  if (seconds < 60) return `${seconds.toFixed(seconds < 10 ? 1 : 0)}\u00a0s`;
  return `${Math.floor(seconds / 60)}\u00a0min\u00a0${String(Math.floor(seconds % 60)).padStart(2, "0")}\u00a0s`;
}

/// A moment in the reader's own time, its zone named.
export function localTime(utc: string | null | undefined): string {
  if (!utc) return "–";
  const date = new Date(utc);
  if (Number.isNaN(date.getTime())) return utc;
  return date.toLocaleString(undefined, {year: "numeric", month: "short", day: "numeric", hour: "2-digit", minute: "2-digit", second: "2-digit", timeZoneName: "short"});
}

export function clock(): string {
  return new Date().toLocaleTimeString(undefined, {hour: "2-digit", minute: "2-digit", second: "2-digit", timeZoneName: "short"});
}

/// What a person types: decimal commas, true minus signs and prefixes ("54.7m") are understood. NaN where it is no number.
export function parseNumber(text: string): number {
  const match = /^\s*([-+−]?[0-9]*[.,]?[0-9]*(?:e[-+−]?[0-9]+)?)\s*([pnuµmkM]?)\s*$/i.exec(text);
  if (!match || !/[0-9]/.test(match[1])) return NaN;
  const factors: {[prefix: string]: number} = {p: 1e-12, n: 1e-9, u: 1e-6, "µ": 1e-6, m: 1e-3, k: 1e3, M: 1e6, "": 1};
  return Number(match[1].replace(/−/g, "-").replace(",", ".")) * (factors[match[2]] ?? NaN);
}
