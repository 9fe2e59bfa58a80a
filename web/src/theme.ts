// Light or dark: as the system says, until the reader chooses; the choice is kept in this browser.

export type Ink = "measured" | "model" | "base" | "floor" | "mark" | "ink" | "third" | "fourth";

const dark = window.matchMedia("(prefers-color-scheme: dark)");
const listeners = new Set<() => void>();
let colours = new Map<string, string>();

function chosen(): string | null {
  try {
    return localStorage.getItem("emtb-theme");
  } catch {
    return null;  // a browser that keeps nothing
  }
}

export function isDark(): boolean {
  const choice = chosen();
  return choice ? choice === "dark" : dark.matches;
}

function apply(): void {
  document.documentElement.dataset.theme = isDark() ? "dark" : "light";
  colours = new Map();
  for (const listener of listeners) listener();
}

export function toggleTheme(): void {
  const next = isDark() ? "light" : "dark";
  try {
    localStorage.setItem("emtb-theme", next);
  } catch {
    // then it lasts as long as the page
  }
  apply();
}

export function startTheme(): void {
  dark.addEventListener("change", apply);
  apply();
}

/// @return how to stop listening
export function onTheme(listener: () => void): () => void {
  listeners.add(listener);
  return () => listeners.delete(listener);
}

/// The colour that the style sheet gives a name.
export function colour(name: Ink | "muted" | "grid" | "surface" | "line"): string {
  let value = colours.get(name);
  if (value === undefined) {
    value = getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim() || "#888";
    colours.set(name, value);
  }
  return value;
}

/// The same, let through: for areas.
export function faint(name: Ink, opacity: number): string {
  return colour(name) + Math.round(opacity * 255).toString(16).padStart(2, "0");
}
